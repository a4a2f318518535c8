// SPDX-License-Identifier: BSD-3-Clause
// Everything that a continuous filter refuses has its own name and leaves estimate and time as they were.
#include <gtest/gtest.h>

#include <jml/continuous/continuous.hpp>
#include <jml/riccati/davison_maki.hpp>

#include "continuous/continuous_faulty.hpp"

namespace {

using namespace jml::operators;

using namespace continuous_faulty;
using jml::DavisonMaki;
using jml::RungeKutta4;
using jml::Status;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// A filter at time 3 and a copy of its numbers.
template <typename Integrator, typename Rule = jml::Rnls<>>
struct Watched {
  explicit Watched(const Integrator& integrator, const Plant& plant = {})
      : filter{jml::Continuous{Rule{}, integrator}, plant, start(), 3.0} {}
  jml::Filter<jml::Continuous<Rule, Integrator>, Plant> filter;

  /// `late`: it begins in the middle of the interval, where only what became of it is seen; refused it must
  /// be.
  void expect(Status got, Status wanted, bool late = false) {
    EXPECT_TRUE(got == wanted || (late && got != Status::ok))
        << jml::describe(got) << "; wanted: " << jml::describe(wanted);
    EXPECT_EQ(filter.x(), start().x);
    EXPECT_EQ(filter.P(), start().P);
    EXPECT_EQ(filter.time(), 3);
    EXPECT_EQ(filter.status(), Status::ok);
  }
};

template <typename Integrator>
class Refusals : public testing::Test {};
using Integrators = testing::Types<RungeKutta4, DavisonMaki>;
TYPED_TEST_SUITE(Refusals, Integrators);

TYPED_TEST(Refusals, Measurements) {
  const Sensor s;
  for (const double bad : {nan, infinity, -infinity}) {
    const jml::Vector<double, 2> wrong(0.5, bad);
    Watched w{TypeParam{4}};
    w.expect(w.filter.step(s, wrong, 0.1, u).status, Status::invalid_measurement);
    w.expect(w.filter.step(s, jml::Line{wrong, y}, 0.1, u).status, Status::invalid_measurement);
    w.expect(w.filter.step(s, jml::Line{y, wrong}, 0.1, u).status, Status::invalid_measurement);
    w.expect(w.filter.step(s, [&](double) { return wrong; }, 0.1, u).status, Status::invalid_measurement);
    w.expect(w.filter.step(
                         s, [&](double t) { return t > 3.05 && t < 3.09 ? wrong : y; }, 0.1, u)
                 .status,
             Status::invalid_measurement, true);
  }
}

TYPED_TEST(Refusals, TimeStepsAndControls) {
  Watched w{TypeParam{}};
  for (const double bad : {nan, infinity, -infinity, -1e-9}) {
    w.expect(w.filter.step(Sensor{}, y, bad, u).status, Status::invalid_time_step);
    w.expect(w.filter.predict(bad, u), Status::invalid_time_step);
  }
  for (const double bad : {nan, infinity}) {
    w.expect(w.filter.step(Sensor{}, y, 0.1, jml::Vector<double, 1>(bad)).status, Status::invalid_control);
    w.expect(w.filter.predict(0.1, jml::Vector<double, 1>(bad)), Status::invalid_control);
  }
}

TYPED_TEST(Refusals, Options) {
  for (const int bad : {0, -1}) {
    Watched w{TypeParam{bad}};
    w.expect(w.filter.step(Sensor{}, y, 0.1, u).status, Status::invalid_option);
    w.expect(w.filter.predict(0.1, u), Status::invalid_option);
  }
}

/// The slots of RNLS and EKF: the latter does not look at F and M.
template <typename Rule>
bool sees(Fault f) {
  return !(std::is_same_v<Rule, jml::Ekf<>> && (f == Fault::F || f == Fault::M));
}

template <typename Rule, typename Integrator>
void models(const Integrator& integrator) {
  for (const double since : {-1.0, 3.04}) {  // from the first, or in the middle of the interval
    for (const auto& [fault, status] : of_plant) {
      SCOPED_TRACE(testing::Message() << "plant's fault " << static_cast<int>(fault) << " since " << since);
      if (!sees<Rule>(fault)) continue;
      Watched<Integrator, Rule> w{integrator, Plant{fault, since}};
      w.expect(w.filter.step(Sensor{}, y, 0.1, u).status, status, since > 3);
      w.expect(w.filter.predict(0.1, u), status, since > 3);
    }
    for (const auto& [fault, status] : of_sensor) {
      SCOPED_TRACE(testing::Message() << "sensor's fault " << static_cast<int>(fault) << " since " << since);
      if (!sees<Rule>(fault)) continue;
      Watched<Integrator, Rule> w{integrator};
      w.expect(w.filter.step(Sensor{fault, since}, y, 0.1, u).status, status, since > 3);
    }
  }
}
TYPED_TEST(Refusals, ModelsUnderRnls) { models<jml::Rnls<>>(TypeParam{4}); }
TYPED_TEST(Refusals, ModelsUnderEkf) { models<jml::Ekf<>>(TypeParam{4}); }

TYPED_TEST(Refusals, Starts) {
  const auto expect = [](const jml::Estimate<double, 2>& e, double time, Status wanted) {
    jml::Filter filter{jml::Continuous{jml::Rnls{}, TypeParam{}}, Plant{}, e, time};
    EXPECT_EQ(filter.status(), wanted);
    EXPECT_EQ(filter.step(Sensor{}, y, 0.1, u).status, wanted);
    EXPECT_EQ(filter.predict(0.1, u), wanted);
    EXPECT_EQ(filter.reset(start(), 1.0), Status::ok);
    EXPECT_EQ(filter.step(Sensor{}, y, 0.1, u).status, Status::ok);
    EXPECT_EQ(filter.time(), 1.1);
  };
  auto e = start();
  expect(e, nan, Status::invalid_time_step);
  e.x(0) = nan;
  expect(e, 0, Status::invalid_state);
  e = start();
  e.P(1, 1) = nan;
  expect(e, 0, Status::invalid_covariance);
  e = start();
  e.P(1, 1) = -0.1;
  expect(e, 0, Status::invalid_covariance);
  e = start();
  e.P(1, 0) = 0.3;  // indefinite
  e.P(0, 1) = 0.3;
  expect(e, 0, Status::invalid_covariance);
}

TYPED_TEST(Refusals, AsymmetryOfASymmetricRule) {
  auto e = start();
  e.P(0, 1) += 0.01;
  EXPECT_EQ((jml::Filter{jml::Continuous{jml::Ekf{}, TypeParam{}}, Plant{}, e}.status()),
            Status::invalid_covariance);
  EXPECT_EQ((jml::Filter{jml::Continuous{jml::Rnls{}, TypeParam{}}, Plant{}, e}.status()), Status::ok);
}

// A step of zero is none; one of a few units in the last place of the time is one.
TYPED_TEST(Refusals, ZeroAndTinyStepsAreFine) {
  Watched w{TypeParam{}};
  w.expect(w.filter.step(Sensor{}, y, 0.0, u).status, Status::ok);
  w.expect(w.filter.step(Sensor{}, jml::Line{y, y}, 0.0, u).status, Status::ok);
  w.expect(w.filter.predict(0.0, u), Status::ok);
  EXPECT_EQ(w.filter.step(Sensor{}, y, 1e-15, u).status, Status::ok);
  EXPECT_EQ(w.filter.step(Sensor{}, jml::Line{y, y}, 1e-15, u).status, Status::ok);
  EXPECT_EQ(w.filter.step(Sensor{}, [](double) { return y; }, 1e-320, u).status, Status::ok);
  EXPECT_LT((w.filter.P() - start().P).norm(), 1e-13);
  EXPECT_GE(w.filter.time(), 3);
}

// A hundred million pieces are not taken, and not too long a step either.
TEST(RefusalsOfTheirOwn, Limits) {
  Watched maki{DavisonMaki{.substeps = 1, .max_pieces = 8}};
  maki.expect(maki.filter.predict(1e3, u), Status::step_limit);
  Watched none{DavisonMaki{.substeps = 1, .max_pieces = 0}};
  none.expect(none.filter.predict(0.1, u), Status::invalid_option);
  Watched runge{RungeKutta4{}};
  runge.expect(runge.filter.step(Sensor{}, y, 10.0, u).status, Status::step_too_long);
}

// R constant and wrong: found at each step; Q constant and wrong: found when the filter is made.
struct ConstantPlant {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  double q = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(-x(0));
  }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(q); }
};
struct ConstantSensor {
  static constexpr int measurements = 1;
  double r = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(r); }
};
TYPED_TEST(Refusals, Constants) {
  const jml::Estimate one{jml::Vector<double, 1>(1), jml::Matrix<double, 1, 1>(1)};
  for (const double bad : {-1.0, nan, infinity}) {
    jml::Filter filter{jml::Continuous{jml::Ekf{}, TypeParam{}}, ConstantPlant{bad}, one};
    EXPECT_EQ(filter.status(), Status::invalid_disturbance_covariance);
    EXPECT_EQ(filter.step(ConstantSensor{}, 1.0, 0.1).status, Status::invalid_disturbance_covariance);
  }
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    jml::Filter filter{jml::Continuous{jml::Ekf{}, TypeParam{}}, ConstantPlant{}, one};
    EXPECT_EQ(filter.step(ConstantSensor{bad}, 1.0, 0.1).status, Status::invalid_noise_covariance);
    EXPECT_EQ(filter.P(), one.P);
    EXPECT_EQ(filter.step(ConstantSensor{}, 1.0, 0.1).status, Status::ok);  // and nothing is left of it
  }
}

// A step that is long for the model, whatever is measured: ẋ = -x over 1.5 s in one substep, and in two.
TEST(RefusalsOfTheirOwn, AStepThatIsLongForTheModel) {
  const jml::Estimate<double, 1> one{1.0, 1.0};
  for (const int substeps : {1, 2}) {
    jml::Filter filter{jml::Continuous{jml::Ekf{}, RungeKutta4{substeps}}, ConstantPlant{}, one};
    EXPECT_EQ(filter.predict(1.5), substeps == 1 ? Status::step_too_long : Status::ok);
    EXPECT_NEAR(filter.x()(0), substeps == 1 ? 1 : std::exp(-1.5), 2e-3);
    EXPECT_EQ(filter.time(), substeps == 1 ? 0 : 1.5);
    EXPECT_EQ(filter.predict(1.3), Status::ok);
  }
}

}  // namespace
