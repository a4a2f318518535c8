// SPDX-License-Identifier: BSD-3-Clause
// What a smoother keeps, refuses and reports around its algebra: the gate, refusals that change nothing, the
// end of its memory, and a forward pass that is the filter's.
#include <gtest/gtest.h>

#include <jml/interval/smoother.hpp>
#include <vector>

#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using jml::Status;
const jml::Estimate<double, 2> start{{1, 0}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};

double measured(int i) { return 0.8 * std::sin(0.05 * i) + 0.1 * std::cos(7.0 * i); }

using VanDerPol = jml::Smoother<jml::Ekf<>, models::VanDerPol>;
VanDerPol van_der_pol(int capacity) {
  return {jml::Filter{jml::Ekf{}, models::VanDerPol{}, start}, capacity};
}

/// Every number that a smoother shows.
template <typename Smoother>
std::vector<double> numbers(const Smoother& smoother) {
  std::vector<double> out{smoother.filter().time(), double(smoother.samples())};
  const auto add = [&](const auto& a) { out.insert(out.end(), a.data(), a.data() + a.size()); };
  add(smoother.filter().x());
  add(smoother.filter().P());
  for (int k = 0; k < smoother.samples(); ++k) {
    out.push_back(smoother.time(k));
    add(smoother.x(k));
    add(smoother.P(k));
    add(smoother.filtered(k).x);
    add(smoother.filtered(k).P);
  }
  return out;
}

TEST(Smoother, ARejectedMeasurementChangesNothing) {
  VanDerPol gated = van_der_pol(20), twin = van_der_pol(20);
  gated.gate = {0.999};
  const models::SaturatingPosition sensor;
  for (int i = 0; i < 20; ++i) {
    if (i % 4 == 2) {
      const auto report = gated.step(sensor, 50.0);
      EXPECT_EQ(report.status, Status::ok);
      EXPECT_EQ(report.gate, jml::Verdict::rejected);
      EXPECT_EQ(twin.predict(), Status::ok);
    } else {
      EXPECT_EQ(gated.step(sensor, measured(i)).gate, jml::Verdict::accepted);
      EXPECT_EQ(twin.step(sensor, measured(i)).status, Status::ok);
      EXPECT_EQ(gated.update(sensor, -50.0).gate, jml::Verdict::rejected);
    }
  }
  EXPECT_EQ(gated.smooth(), Status::ok);
  EXPECT_EQ(twin.smooth(), Status::ok);
  EXPECT_EQ(numbers(gated), numbers(twin));
}

TEST(Smoother, TakesTheGateOfItsFilter) {
  jml::Filter filter{jml::Ekf{}, models::VanDerPol{}, start};
  filter.gate = {0.99};
  jml::Smoother smoother{filter, 3};
  EXPECT_EQ(smoother.gate.probability, 0.99);
  EXPECT_EQ(smoother.step(models::SaturatingPosition{}, 50.0).gate, jml::Verdict::rejected);
}

// A refused step has overwritten what the rule keeps by then: only a twin that never refused shows whether
// that leaks.
TEST(Smoother, ARefusalChangesNothing) {
  VanDerPol refusing = van_der_pol(20), twin = van_der_pol(20);
  const models::SaturatingPosition sensor, other{.r = 0.5}, bad{.r = -1};
  const double nan = std::nan("");
  const auto refuse = [&] {
    const std::vector<double> before = numbers(refusing);
    EXPECT_EQ(refusing.step(sensor, nan).status, Status::invalid_measurement);
    EXPECT_EQ(refusing.step(bad, 0.1).status, Status::invalid_noise_covariance);
    EXPECT_EQ(refusing.step(sensor, 0.1, -1.0).status, Status::invalid_time_step);
    EXPECT_EQ(refusing.predict(nan), Status::invalid_time_step);
    EXPECT_EQ(refusing.update(sensor, nan).status, Status::invalid_measurement);
    EXPECT_EQ(refusing.step(sensor, nan).status, Status::invalid_measurement);
    EXPECT_EQ(numbers(refusing), before);
  };
  refuse();
  for (int i = 0; i < 12; ++i) {
    for (VanDerPol* s : {&refusing, &twin}) {
      EXPECT_EQ(s->step(sensor, measured(i)).status, Status::ok);
      if (s == &refusing) refuse();
      EXPECT_EQ(s->update(other, measured(i + 2)).status, Status::ok);
      if (s == &refusing) refuse();
      EXPECT_EQ(s->smooth(), Status::ok);
    }
  }
  EXPECT_EQ(numbers(refusing), numbers(twin));
}

TEST(Smoother, RefusesWhatItCannotRemember) {
  VanDerPol smoother = van_der_pol(5);
  const models::SaturatingPosition sensor;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(smoother.step(sensor, measured(i)).status, Status::ok);
  const std::vector<double> before = numbers(smoother);
  EXPECT_EQ(smoother.step(sensor, 0.1).status, Status::memory_full);
  EXPECT_EQ(smoother.step(sensor, jml::Vector<double, 1>(0.1), 0.0).status, Status::memory_full);
  EXPECT_EQ(smoother.predict(), Status::memory_full);
  EXPECT_EQ(numbers(smoother), before);
  EXPECT_EQ(smoother.update(sensor, 0.1).status, Status::ok);  // needs no memory
  EXPECT_EQ(smoother.smooth(), Status::ok);
  EXPECT_EQ(smoother.samples(), 6);
  for (const int none : {0, -3}) {
    VanDerPol small = van_der_pol(none);
    EXPECT_EQ(small.step(sensor, 0.1).status, Status::memory_full);
    EXPECT_EQ(small.update(sensor, 0.1).status, Status::ok);
    EXPECT_EQ(small.smooth(), Status::ok);
    EXPECT_EQ(small.x(0), small.filter().x());
  }
}

TEST(Smoother, SmoothsTwiceToTheSameBits) {
  VanDerPol smoother = van_der_pol(30);
  for (int i = 0; i < 30; ++i)
    EXPECT_EQ(smoother.step(models::SaturatingPosition{}, measured(i)).status, Status::ok);
  EXPECT_EQ(smoother.x(3), smoother.filtered(3).x);  // not smoothed yet
  EXPECT_EQ(smoother.smooth(), Status::ok);
  EXPECT_NE(smoother.x(3), smoother.filtered(3).x);
  const std::vector<double> once = numbers(smoother);
  const VanDerPol copy = smoother;
  EXPECT_EQ(smoother.smooth(), Status::ok);
  EXPECT_EQ(numbers(smoother), once);
  EXPECT_EQ(numbers(copy), once);
}

TEST(Smoother, ABadStartIsNamedAndCanBeReplaced) {
  jml::Estimate<double, 2> bad = start;
  bad.P(0, 0) = -1;
  jml::Smoother smoother{jml::Filter{jml::Ekf{}, models::VanDerPol{}, bad}, 4};
  const models::SaturatingPosition sensor;
  EXPECT_EQ(smoother.status(), Status::invalid_covariance);
  EXPECT_EQ(smoother.step(sensor, 0.1).status, Status::invalid_covariance);
  EXPECT_EQ(smoother.predict(), Status::invalid_covariance);
  EXPECT_EQ(smoother.update(sensor, 0.1).status, Status::invalid_covariance);
  EXPECT_EQ(smoother.smooth(), Status::invalid_covariance);
  EXPECT_EQ(smoother.samples(), 1);

  VanDerPol fresh = van_der_pol(4);
  EXPECT_EQ(smoother.reset(start, 0), Status::ok);
  for (int round = 0; round < 2; ++round) {  // and once more with the memory full
    EXPECT_EQ(smoother.samples(), 1);
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(smoother.step(sensor, measured(i)).status, Status::ok);
      if (round == 0) {
        EXPECT_EQ(fresh.step(sensor, measured(i)).status, Status::ok);
      }
    }
    EXPECT_EQ(smoother.smooth(), Status::ok);
    EXPECT_EQ(fresh.smooth(), Status::ok);
    EXPECT_EQ(numbers(smoother), numbers(fresh));
    EXPECT_EQ(smoother.reset(start, 0), Status::ok);
  }
}

/// x⁺ = x + u dt, and a sensor that sees the control.
struct Pushed {
  static constexpr int states = 1, disturbances = 1, controls = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(x(0) + at.dt * at.control(0));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.1); }
};
struct SeesControl {
  static constexpr int measurements = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>((1 + at.control(0)) * x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.2); }
};

// The forward pass is the filter itself: same estimates and same reports.
TEST(Smoother, StepsAsTheFilterDoes) {
  const jml::Estimate<double, 1> prior{jml::Vector<double, 1>(0.5), jml::Matrix<double, 1, 1>(1)};
  jml::Filter filter{jml::Ekf{}, Pushed{}, prior, 3.0};
  jml::Smoother smoother{filter, 60};
  for (int i = 0; i < 20; ++i) {
    const jml::Vector<double, 1> u(std::cos(1.0 * i)), y(std::sin(0.3 * i));
    const auto a = smoother.step(SeesControl{}, y, 0.1, u);
    const auto b = filter.step(SeesControl{}, y, 0.1, u);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.innovation, b.innovation);
    EXPECT_EQ(a.gain, b.gain);
    EXPECT_EQ(smoother.update(SeesControl{}, 0.2).innovation, filter.update(SeesControl{}, 0.2).innovation);
    EXPECT_EQ(smoother.predict(0.2, u), filter.predict(0.2, u));
    EXPECT_EQ(smoother.step(SeesControl{}, 0.3, 0.1, u).innovation,
              filter.step(SeesControl{}, 0.3, 0.1, u).innovation);
    EXPECT_EQ(smoother.filter().x(), filter.x());
    EXPECT_EQ(smoother.filter().P(), filter.P());
    EXPECT_EQ(smoother.filter().time(), filter.time());
  }
}

}  // namespace
