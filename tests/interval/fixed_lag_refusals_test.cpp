// SPDX-License-Identifier: BSD-3-Clause
// Every refusal of a fixed-lag filter has its name and leaves the whole window bit by bit as it was, also
// where the window had already slid to make room; and the next good step never learns of it.
#include <gtest/gtest.h>

#include <cstring>
#include <jml/filter/filter.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <vector>

#include "models/linear.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using jml::Status, jml::usable;
using Vector1 = jml::Vector<double, 1>;
using Vector2 = jml::Vector<double, 2>;
using Matrix1 = jml::Matrix<double, 1, 1>;
using Matrix2 = jml::Matrix<double, 2, 2>;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr int L = 5;

/// What is wrong with one step of a Plant; its control input says which.
enum Fault : int { none, f_nan, f_inf, f_x_nan, Q_negative, Q_nan, G_nan };

/// Van der Pol over any dt. `varying`: G and Q depend on state and time, and can go wrong too.
template <bool varying>
struct Plant {
  static constexpr int states = 2, disturbances = 1, controls = 1;
  static bool has(Fault fault, const auto& at) { return at.control(0) == static_cast<double>(fault); }

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    jml::Vector<T, 2> f = models::VanDerPol{.dt = at.dt, .c = 0.5}.dynamics(x);
    if (has(f_nan, at)) f(1) = T(nan);
    if (has(f_inf, at)) f(0) = T(inf);
    return f;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x, const auto& at) const {
    jml::Matrix<T, 2, 2> J = models::VanDerPol{.dt = at.dt, .c = 0.5}.dynamics_jacobian(x);
    if (has(f_x_nan, at)) J(1, 0) = T(nan);
    return J;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const
    requires(!varying)
  {
    return {0, 0.1};
  }
  Matrix1 disturbance_covariance() const
    requires(!varying)
  {
    return Matrix1(10);
  }
  jml::Matrix<double, 2, 1> disturbance_input(const Vector2& x, const auto& at) const
    requires varying
  {
    return {has(G_nan, at) ? nan : 0, at.dt * (1 + 0.1 * std::sin(x(1)))};
  }
  Matrix1 disturbance_covariance(const Vector2& x, const auto& at) const
    requires varying
  {
    return Matrix1(has(Q_negative, at) ? -1 : has(Q_nan, at) ? nan : (1 + 0.2 * x(0) * x(0)) / at.dt);
  }
};

/// y = x / sqrt(1 + x²) + v; `varying`: R depends on the state.
template <bool varying>
struct Gauge {
  static constexpr int measurements = 1;
  double r = 5e-3;
  bool m_nan = false, m_x_nan = false;
  double m_x_ends = -inf;  // m_x is NaN where the position is below this, m is sound

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return m_nan ? jml::Vector<T, 1>(T(nan)) : models::SaturatingPosition{}.measurement(x);
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>& x) const {
    if (m_x_nan || x(0) < m_x_ends) return {T(nan), T(0)};
    return models::SaturatingPosition{}.measurement_jacobian(x);
  }
  Matrix1 noise_covariance() const
    requires(!varying)
  {
    return Matrix1(r);
  }
  Matrix1 noise_covariance(const Vector2& x) const
    requires varying
  {
    return Matrix1(r * (1 + 0.3 * x(0) * x(0)));
  }
};

/// y = (position, velocity) + v.
struct Both {
  static constexpr int measurements = 2;
  Matrix2 R = (Matrix2() << 0.02, 0.01, 0.01, 0.03).finished();
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return x;
  }
  Matrix2 noise_covariance() const { return R; }
};

/// Everything that a FixedLag shows.
template <typename Filter>
std::vector<double> snapshot(const Filter& filter) {
  std::vector<double> out{static_cast<double>(filter.depth()), static_cast<double>(filter.status())};
  for (int age = 0; age <= filter.depth(); ++age) {
    const auto P = filter.P(age);
    out.insert(out.end(), filter.x(age).data(), filter.x(age).data() + filter.x(age).size());
    out.insert(out.end(), P.data(), P.data() + P.size());
    out.push_back(filter.time(age));
  }
  return out;
}
bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

const jml::Estimate<double, 2> good{Vector2(1.5, 0.5), (Matrix2() << 0.3, 0.1, 0.1, 0.2).finished()};

template <bool varying>
auto make() {
  return jml::Filter{jml::FixedLag<L, 3>{}, Plant<varying>{}, jml::sensors<Gauge<varying>, Both>, good, 3.0};
}
template <bool varying>
using Window = decltype(make<varying>());

template <bool varying>
Status good_step(Window<varying>& filter, int k) {
  return filter.step(Gauge<varying>{}, 0.7 * std::sin(0.3 + 0.1 * k), k % 2 == 0 ? 0.1 : 0.07).status;
}

/// A window after `steps` good steps, a late measurement at its oldest node and one of the other sensor.
template <bool varying>
Window<varying> after(int steps) {
  auto filter = make<varying>();
  for (int k = 0; k < steps; ++k) EXPECT_TRUE(usable(good_step<varying>(filter, k)));
  EXPECT_TRUE(usable(filter.update(Gauge<varying>{}, 0.2, jml::age(filter.depth())).status));
  EXPECT_TRUE(usable(filter.update(Both{}, Vector2(0.5, 0.2)).status));
  return filter;
}

/// Before the first step, before the window is full, when it has just become full, when it has slid often.
constexpr int histories[] = {0, 2, L, 3 * L};

/// `act` must answer `wanted` and change nothing, now and later.
template <bool varying, typename Act>
void refused(Status wanted, const Act& act) {
  SCOPED_TRACE(jml::describe(wanted));
  for (const int steps : histories) {
    SCOPED_TRACE(steps);
    auto filter = after<varying>(steps), undisturbed = filter;
    const auto before = snapshot(filter);
    const Status status = act(filter);
    EXPECT_EQ(status, wanted) << jml::describe(status);
    filter.gate = undisturbed.gate;
    filter.method().options = undisturbed.method().options;  // its loss is part of covariance()
    EXPECT_TRUE(same_bits(before, snapshot(filter)));
    for (int k = 0; k < 2; ++k) {
      EXPECT_TRUE(usable(good_step<varying>(filter, k)));
      EXPECT_TRUE(usable(good_step<varying>(undisturbed, k)));
      EXPECT_TRUE(same_bits(snapshot(filter), snapshot(undisturbed)));
    }
  }
}

/// By step() and update(), with a gate and without, and by late().
template <bool varying, typename S, typename Y>
void refused_measurement(Status wanted, const S& sensor, const Y& y) {
  for (const double probability : {1.0, 0.999}) {
    SCOPED_TRACE(probability);
    refused<varying>(wanted, [&](auto& filter) {
      filter.gate = {probability};
      return filter.step(sensor, y, 0.1).status;
    });
    refused<varying>(wanted, [&](auto& filter) {
      filter.gate = {probability};
      return filter.update(sensor, y).status;
    });
  }
  refused<varying>(wanted, [&](auto& filter) { return filter.update(sensor, y, jml::age(filter.depth() / 2)).status; });
}

/// By step() and predict().
template <bool varying>
void refused_motion(Status wanted, double dt, double control) {
  SCOPED_TRACE(control);
  refused<varying>(
      wanted, [&](auto& filter) { return filter.step(Gauge<varying>{}, 0.5, dt, Vector1(control)).status; });
  refused<varying>(wanted, [&](auto& filter) { return filter.predict(dt, Vector1(control)); });
}

template <bool varying>
void bad_measurements() {
  using Sensor = Gauge<varying>;
  for (const double bad : {nan, inf, -inf}) {
    refused_measurement<varying>(Status::invalid_measurement, Sensor{}, bad);
    refused_measurement<varying>(Status::invalid_measurement, Both{}, Vector2(0.1, bad));
  }
  for (const double r : {0.0, -1.0, -1e-3, nan, inf})
    refused_measurement<varying>(Status::invalid_noise_covariance, Sensor{.r = r}, 0.5);
  for (const Matrix2& R : {(Matrix2() << 1, 2, 2, 1).finished(), (Matrix2() << 1, 0.1, 0.2, 1).finished(),
                           (Matrix2() << 4, 2, 2, 1).finished(), (Matrix2() << 1, 0, 0, -1e-9).finished()})
    refused_measurement<varying>(Status::invalid_noise_covariance, Both{R}, Vector2(0.5, 0.2));
  refused_measurement<varying>(Status::sensor_not_finite, Sensor{.m_nan = true}, 0.5);
  refused_measurement<varying>(Status::sensor_not_finite, Sensor{.m_x_nan = true}, 0.5);
}
TEST(FixedLagRefusals, MeasurementsAndSensors) { bad_measurements<false>(); }
TEST(FixedLagRefusals, MeasurementsAndSensorsWhereNoiseVaries) { bad_measurements<true>(); }

template <bool varying>
void bad_motion() {
  for (const double dt : {-1e-9, -1.0, nan, inf}) refused_motion<varying>(Status::invalid_time_step, dt, 0);
  for (const double bad : {nan, inf}) refused_motion<varying>(Status::invalid_control, 0.1, bad);
  for (const Fault fault : {f_nan, f_inf, f_x_nan})
    refused_motion<varying>(Status::dynamics_not_finite, 0.1, fault);
}
TEST(FixedLagRefusals, MotionAndDynamics) { bad_motion<false>(); }
TEST(FixedLagRefusals, MotionAndDynamicsWhereNoiseVaries) {
  bad_motion<true>();
  for (const Fault fault : {Q_negative, Q_nan, G_nan})
    refused_motion<true>(Status::invalid_disturbance_covariance, 0.1, fault);
}

TEST(FixedLagRefusals, Options) {
  const auto with = [](const auto& change) {
    refused<false>(Status::invalid_option, [&](auto& filter) {
      change(filter);
      return filter.step(Gauge<false>{}, 0.5, 0.1).status;
    });
    refused<false>(Status::invalid_option, [&](auto& filter) {
      change(filter);
      return filter.update(Gauge<false>{}, 0.5).status;
    });
  };
  for (const double bad : {0.0, -1.0, 1.5, nan}) with([bad](auto& filter) { filter.gate.probability = bad; });
  for (const int bad : {0, -1}) with([bad](auto& filter) { filter.method().options.sweeps = bad; });
  for (const double bad : {-1.0, 1.0, nan}) with([bad](auto& filter) { filter.method().options.tolerance = bad; });
  for (const double bad : {0.0, -1.0, nan, inf})
    with([bad](auto& filter) { filter.method().options.loss = jml::Loss::huber(bad); });
}

// The sweeps meet the trouble after a first one has lowered J: at the new trajectory m is sound and m_x is
// not. With one sweep that is not seen; with more the step is refused, though states have moved by then.
TEST(FixedLagRefusals, NotLinearisableOnTheWay) {
  int not_taken = 0;
  for (const int steps : histories) {
    for (const int sweeps : {2, 3, 20}) {
      SCOPED_TRACE(steps);
      SCOPED_TRACE(sweeps);
      auto filter = after<true>(steps);
      filter.method().options.sweeps = sweeps;
      auto undisturbed = filter, ahead = filter;
      ASSERT_EQ(ahead.predict(0.1), Status::ok);
      // Sound at the prediction, not where the measurement pulls it.
      const double x = ahead.x()(0);
      const Gauge<true> ends{.r = 1e-4, .m_x_ends = x - 0.05};
      const double y = ends.measurement(Vector2(x - 0.4, 0))(0);
      const auto before = snapshot(filter);
      const Status status = filter.step(ends, y, 0.1).status;
      if (usable(status)) continue;
      ++not_taken;
      EXPECT_TRUE(same_bits(before, snapshot(filter))) << jml::describe(status);
      EXPECT_TRUE(usable(good_step<true>(filter, 0)));
      EXPECT_TRUE(usable(good_step<true>(undisturbed, 0)));
      EXPECT_TRUE(same_bits(snapshot(filter), snapshot(undisturbed)));
      const double here = filter.x()(0);
      const Gauge<true> ends_here{.r = 1e-4, .m_x_ends = here - 0.02};
      const auto now = snapshot(filter);
      const Status again = filter.update(ends_here, ends.measurement(Vector2(here - 0.4, 0))(0)).status;
      EXPECT_TRUE(usable(again) || same_bits(now, snapshot(filter))) << jml::describe(again);
    }
  }
  EXPECT_GT(not_taken, 0);
}

TEST(FixedLagRefusals, BadStart) {
  const auto start = [](double x, double p00, double p01, double p10, double time = 0) {
    const jml::Estimate<double, 2> estimate{Vector2(x, 1), (Matrix2() << p00, p01, p10, 1).finished()};
    return jml::Filter{jml::FixedLag<L>{}, Plant<false>{}, jml::sensors<Both>, estimate, time};
  };
  EXPECT_EQ(start(1, 1, 0, 0).status(), Status::ok);
  EXPECT_EQ(start(1, 1, 0, 0, nan).status(), Status::invalid_time_step);
  EXPECT_EQ(start(nan, 1, 0, 0).status(), Status::invalid_state);
  EXPECT_EQ(start(1, nan, 0, 0).status(), Status::invalid_covariance);
  EXPECT_EQ(start(1, -1e-9, 0, 0).status(), Status::invalid_covariance);
  EXPECT_EQ(start(1, 1, 2, 2).status(), Status::invalid_covariance);  // eigenvalue -1
  EXPECT_EQ(start(1, 1, 0.3, 0.2).status(), Status::invalid_covariance);
  auto filter = start(1, 1, 2, 2);
  EXPECT_EQ(filter.step(Both{}, Vector2(1, 1), 0.1).status, Status::invalid_covariance);
  EXPECT_EQ(filter.update(Both{}, Vector2(1, 1)).status, Status::invalid_covariance);
  EXPECT_EQ(filter.update(Both{}, Vector2(1, 1), jml::age(0)).status, Status::invalid_covariance);
  EXPECT_EQ(filter.predict(0.1), Status::invalid_covariance);
  EXPECT_EQ(filter.depth(), 0);
  EXPECT_EQ(filter.reset(good, 1.0), Status::ok);
  EXPECT_TRUE(usable(filter.step(Both{}, Vector2(1, 1), 0.1).status));
  EXPECT_DOUBLE_EQ(filter.time(), 1.1);

  const jml::Filter noiseless{jml::FixedLag<L>{}, models::VanDerPol{.q_c = -1}, jml::sensors<Both>, good};
  EXPECT_EQ(noiseless.status(), Status::invalid_disturbance_covariance);
}

// Twice the same, and a used filter after reset() is a new one.
TEST(FixedLagRefusals, SameInputSameBits) {
  auto once = make<true>(), twice = make<true>(), used = after<true>(2 * L);
  ASSERT_EQ(used.predict(0.3), Status::ok);
  ASSERT_EQ(used.reset(good, 3.0), Status::ok);
  for (int k = 0; k < 4 * L; ++k) {
    for (auto* filter : {&once, &twice, &used}) {
      ASSERT_TRUE(usable(good_step<true>(*filter, k)));
      if (k % 3 != 0) continue;
      ASSERT_TRUE(usable(filter->update(Both{}, Vector2(0.5, 0.1), jml::age(filter->depth())).status));
    }
    ASSERT_TRUE(same_bits(snapshot(once), snapshot(twice)));
    ASSERT_TRUE(same_bits(snapshot(once), snapshot(used)));
  }
}

// An outlier: rejected, reported, and what is left is the prediction.
TEST(FixedLagGate, RejectsToThePrediction) {
  for (const int steps : histories) {
    SCOPED_TRACE(steps);
    auto filter = after<true>(steps), predicted = filter;
    filter.gate = {0.999};
    const auto report = filter.step(Both{}, Vector2(30, -40), 0.1);
    EXPECT_EQ(report.status, Status::ok);
    EXPECT_EQ(report.gate, jml::Verdict::rejected);
    EXPECT_GT(report.nis(), 13.816);  // χ² with 2 degrees of freedom at 99.9 %
    ASSERT_EQ(predicted.predict(0.1), Status::ok);
    EXPECT_TRUE(same_bits(snapshot(filter), snapshot(predicted)));
    EXPECT_EQ(report.innovation, Vector2(Vector2(30, -40) - predicted.x()));
    const auto again = filter.update(Both{}, Vector2(30, -40));
    EXPECT_EQ(again.status, Status::ok);
    EXPECT_EQ(again.gate, jml::Verdict::rejected);
    EXPECT_TRUE(same_bits(snapshot(filter), snapshot(predicted)));
    const auto accepted = filter.update(Both{}, Vector2(predicted.x() + Vector2(0.01, 0.01)));
    EXPECT_TRUE(usable(accepted.status));
    EXPECT_EQ(accepted.gate, jml::Verdict::accepted);
    EXPECT_FALSE(same_bits(snapshot(filter), snapshot(predicted)));
  }
}

// On a linear system innovation, NIS and verdict are the Kalman filter's, through missing and rejected
// measurements.
TEST(FixedLagGate, NisOfTheKalmanFilter) {
  jml::Noise noise(31);
  const auto dynamics = models::random_linear_dynamics<3, 2>(noise);
  const auto first = models::random_linear_sensor<3, 1>(noise);
  const auto second = models::random_linear_sensor<3, 2>(noise);
  const jml::Estimate<double, 3> start{{1, -0.5, 0.3}, models::random_covariance<3>(noise, 0.2)};
  jml::Filter lagged{jml::FixedLag<3>{}, dynamics,
                       jml::sensors<models::LinearSensor<3, 1>, models::LinearSensor<3, 2>>, start};
  jml::Filter kalman{jml::Kalman{}, dynamics, start};
  lagged.gate = kalman.gate = {0.6};
  int rejected = 0, accepted = 0;
  const auto compare = [&](const auto& got, const auto& wanted) {
    EXPECT_TRUE(usable(got.status));
    EXPECT_EQ(got.gate, wanted.gate);
    EXPECT_NEAR(got.nis(), wanted.nis(), 1e-12 * wanted.nis());
    EXPECT_LT((got.innovation - wanted.innovation).norm(), 1e-12);  // of the size of 1
    ++(got.gate == jml::Verdict::rejected ? rejected : accepted);
  };
  for (int k = 0; k < 100; ++k) {
    const Vector1 y = noise.normal_vector<1>();
    const Vector2 z = noise.normal_vector<2>();
    compare(lagged.step(first, y), kalman.step(first, y));
    if (k % 2 == 0) compare(lagged.update(second, z), kalman.update(second, z));
    if (k % 5 == 0) {
      ASSERT_EQ(lagged.predict(), Status::ok);
      ASSERT_EQ(kalman.predict(), Status::ok);
    }
    EXPECT_LT((lagged.x() - kalman.x()).norm(), 1e-12);
  }
  EXPECT_GT(rejected, 20);
  EXPECT_GT(accepted, 20);
}

struct Rest {
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> disturbance_input() const { return jml::Matrix<double, 1, 1>(1); }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(1e-4); }
};
struct Waves {
  static constexpr int measurements = 1;
  double r = 0.01;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    using std::sin;
    return jml::Vector<T, 1>(x(0) + sin(3.0 * x(0)));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};
// However few the sweeps, J is never above that of the prediction, ½ (y - m)²/R.
TEST(FixedLagRefusals, NoSweepRaisesJ) {
  jml::Noise noise(91);
  int lowered = 0;
  constexpr int runs = 2000;
  for (int k = 0; k < runs; ++k) {
    const double x = noise.normal(), y = x + noise.normal(), miss = y - x - std::sin(3 * x);
    jml::Filter filter{jml::FixedLag<2>{{.sweeps = 1 + k % 3, .newton = k % 2 == 0}}, Rest{},
                       jml::sensors<Waves>, jml::Estimate<double, 1>{x, 1.0}};
    const auto report = filter.step(Waves{}, y);
    ASSERT_TRUE(jml::usable(report.status));
    const double before = miss * miss / 0.02;
    EXPECT_LE(report.cost, before * (1 + 1e-5) + 1e-5) << k;
    lowered += report.cost < before;
  }
  EXPECT_GT(lowered, runs / 2);
}

}  // namespace
