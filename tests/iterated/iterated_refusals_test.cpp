// SPDX-License-Identifier: BSD-3-Clause
// What the iterated filters refuse, by name, and that a refusal touches nothing.
#include <gtest/gtest.h>

#include <cstring>
#include <jml/jml.hpp>

#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
const jml::Estimate<double, 2> good{{1.5, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};

/// Van der Pol that reads dt from the StepContext, and can be told to misbehave.
struct Dynamics {
  static constexpr int states = 2, disturbances = 1;
  double variance = 20, poison = 0;
  bool undefined_on_the_left = false;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const jml::StepContext<double>& at) const {
    jml::Vector<T, 2> f = models::VanDerPol{.dt = at.dt}.dynamics(x);
    f(1) += T(poison);
    if (undefined_on_the_left && x(0) < 1.4) f(0) = T(nan);
    return f;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 0.05}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(variance); }
};

struct Sensor {
  static constexpr int measurements = 1;
  double variance = 0.02;
  bool nan_everywhere = false, log_of_position = false;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::log;
    if (nan_everywhere) return jml::Vector<T, 1>(T(nan));
    if (log_of_position) return jml::Vector<T, 1>(log(x(0)));
    return models::SaturatingPosition{}.measurement(x);
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(variance); }
};

template <typename Rule>
void expect_refused(const Rule& rule, const Dynamics& d, const Sensor& s, const jml::Estimate<double, 2>& prior, double y, double dt,
                    jml::Status expected) {
  jml::Filter filter{rule, d, prior, 3.0};
  const jml::Estimate<double, 2> before = filter.estimate();
  const auto report = filter.step(s, y, dt);
  EXPECT_EQ(report.status, expected) << jml::describe(report.status);
  EXPECT_EQ(std::memcmp(before.x.data(), filter.x().data(), sizeof(double) * 2), 0);
  EXPECT_EQ(std::memcmp(before.P.data(), filter.P().data(), sizeof(double) * 4), 0);
  EXPECT_EQ(filter.time(), 3.0);
}

template <typename Rule>
void every_refusal(const Rule& rule) {
  using jml::Status;
  expect_refused(rule, {}, {}, good, nan, 0.05, Status::invalid_measurement);
  expect_refused(rule, {}, {}, good, infinity, 0.05, Status::invalid_measurement);
  expect_refused(rule, {}, {}, good, 0.5, -0.05, Status::invalid_time_step);
  expect_refused(rule, {}, {}, good, 0.5, nan, Status::invalid_time_step);
  expect_refused(rule, {}, {.variance = 0}, good, 0.5, 0.05, Status::invalid_noise_covariance);
  expect_refused(rule, {}, {.variance = -1}, good, 0.5, 0.05, Status::invalid_noise_covariance);
  expect_refused(rule, {}, {.variance = nan}, good, 0.5, 0.05, Status::invalid_noise_covariance);
  expect_refused(rule, {.variance = -1}, {}, good, 0.5, 0.05, Status::invalid_disturbance_covariance);
  expect_refused(rule, {.variance = nan}, {}, good, 0.5, 0.05, Status::invalid_disturbance_covariance);
  expect_refused(rule, {.poison = nan}, {}, good, 0.5, 0.05, Status::dynamics_not_finite);
  expect_refused(rule, {}, {.nan_everywhere = true}, good, 0.5, 0.05, Status::sensor_not_finite);
  jml::Estimate<double, 2> bad = good;
  bad.x(1) = nan;
  expect_refused(rule, {}, {}, bad, 0.5, 0.05, Status::invalid_state);
  bad = good;
  bad.P(0, 1) = nan;
  expect_refused(rule, {}, {}, bad, 0.5, 0.05, Status::invalid_covariance);
  bad = good;
  bad.P(0, 0) = -1;
  expect_refused(rule, {}, {}, bad, 0.5, 0.05, Status::invalid_covariance);
  bad = good;
  bad.P(0, 1) = bad.P(1, 0) = 0.31;  // indefinite though its diagonal is positive
  expect_refused(rule, {}, {}, bad, 0.5, 0.05, Status::invalid_covariance);
}

TEST(IteratedRefusals, IteratedJml) { every_refusal(jml::IteratedJml{}); }
TEST(IteratedRefusals, Iekf) { every_refusal(jml::Iekf{}); }
TEST(IteratedRefusals, OnePassJml) { every_refusal(jml::Jml{}); }

TEST(IteratedRefusals, Options) {
  for (const jml::IterationOptions options : {jml::IterationOptions{.max_iterations = 0}, jml::IterationOptions{.tolerance = -1},
                                              jml::IterationOptions{.tolerance = nan}, jml::IterationOptions{.max_newton = -1}}) {
    expect_refused(jml::IteratedJml{options}, {}, {}, good, 0.5, 0.05, jml::Status::invalid_option);
  }
  jml::Filter filter{jml::IteratedJml{}, Dynamics{}, good};
  filter.gate = {0};
  EXPECT_EQ(filter.step(Sensor{}, 0.5, 0.05).status, jml::Status::invalid_option);
}

// Undefined at an iterate, not at the start: the root lies at the left of where the dynamics or the sensor end.
TEST(IteratedRefusals, UndefinedOnTheWay) {
  jml::Filter filter{jml::IteratedJml{}, Dynamics{.undefined_on_the_left = true}, good};
  const auto report = filter.step(Sensor{}, -0.5, 0.05);
  EXPECT_FALSE(jml::usable(report.status));
  EXPECT_EQ(filter.x(), good.x);
  EXPECT_EQ(filter.P(), good.P);

  jml::Filter logarithm{jml::IteratedJml{}, Dynamics{}, good};
  const auto answer = logarithm.step(Sensor{.variance = 1e-4, .log_of_position = true}, -5.0, 0.05);
  if (jml::usable(answer.status)) EXPECT_GT(logarithm.x()(0), 0);  // the whole line of iterates may pass x ≤ 0, the answer may not
  else EXPECT_EQ(logarithm.x(), good.x);
}

// One sweep, no fallback: what is not a root is refused, unless a fixed number of sweeps was asked for.
TEST(IteratedRefusals, LimitIsAStatus) {
  const jml::IterationOptions one{.method = jml::Iteration::picard, .max_iterations = 1, .use_fallback = false};
  expect_refused(jml::IteratedJml{one}, {}, {}, good, -0.5, 0.05, jml::Status::not_converged);
  jml::IterationOptions taken = one;
  taken.accept_at_limit = true;
  jml::Filter filter{jml::IteratedJml{taken}, Dynamics{}, good};
  EXPECT_EQ(filter.step(Sensor{}, -0.5, 0.05).status, jml::Status::accepted_at_limit);
}

TEST(IteratedRefusals, AfterARefusalTheFilterGoesOn) {
  jml::Filter filter{jml::IteratedJml{}, Dynamics{}, good}, undisturbed = filter;
  EXPECT_FALSE(jml::usable(filter.step(Sensor{}, nan, 0.05).status));
  EXPECT_TRUE(jml::usable(filter.step(Sensor{}, 0.6, 0.05).status));
  EXPECT_TRUE(jml::usable(undisturbed.step(Sensor{}, 0.6, 0.05).status));
  EXPECT_EQ(filter.x(), undisturbed.x());
  EXPECT_EQ(filter.P(), undisturbed.P());
}

TEST(IteratedRefusals, ResetHealsABadStart) {
  jml::Estimate<double, 2> bad = good;
  bad.P(0, 0) = -1;
  jml::Filter filter{jml::IteratedJml{}, Dynamics{}, bad};
  EXPECT_EQ(filter.status(), jml::Status::invalid_covariance);
  EXPECT_EQ(filter.predict(0.05), jml::Status::invalid_covariance);
  EXPECT_EQ(filter.reset(good, 1.0), jml::Status::ok);
  EXPECT_EQ(filter.predict(0.05), jml::Status::ok);
  EXPECT_DOUBLE_EQ(filter.time(), 1.05);
}

// A rejected measurement leaves the prediction of the rule, as predict() gives it.
TEST(IteratedRefusals, GateRejectsToThePrediction) {
  jml::Filter filter{jml::IteratedJml{}, Dynamics{}, good}, predicted = filter;
  filter.gate = {0.999};
  const jml::Estimate<double, 2> sharp{{1.5, 0.5}, 1e-4 * jml::Matrix<double, 2, 2>::Identity()};
  filter.reset(sharp, 0);
  predicted.reset(sharp, 0);
  const auto report = filter.step(Sensor{.variance = 1e-4}, -0.9, 0.05);
  EXPECT_EQ(report.status, jml::Status::ok);
  EXPECT_EQ(report.gate, jml::Verdict::rejected);
  EXPECT_GT(report.nis(), 10.8);
  EXPECT_EQ(predicted.predict(0.05), jml::Status::ok);
  EXPECT_EQ(filter.x(), predicted.x());
  EXPECT_EQ(filter.P(), predicted.P());
}

// float: the same step to single precision.
struct FloatDynamics {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    const T a = -x(0) - 0.2F * (x(0) * x(0) - 1.0F) * x(1);
    return {x(0) + 0.05F * x(1), x(1) + 0.05F * a};
  }
  jml::Matrix<float, 2, 1> disturbance_input() const { return {0.0F, 0.05F}; }
  jml::Matrix<float, 1, 1> disturbance_covariance() const { return jml::Matrix<float, 1, 1>(20.0F); }
};

struct FloatSensor {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0F + x(0) * x(0)));
  }
  jml::Matrix<float, 1, 1> noise_covariance() const { return jml::Matrix<float, 1, 1>(0.02F); }
};

TEST(IteratedFloat, AgreesWithDouble) {
  jml::Filter filter{jml::IteratedJml{}, Dynamics{}, good};
  const jml::Estimate<float, 2> start{good.x.cast<float>(), good.P.cast<float>()};
  jml::Filter single{jml::IteratedJml{}, FloatDynamics{}, start};
  for (int i = 0; i < 100; ++i) {
    const double y = 0.6 * std::sin(0.05 * i);
    ASSERT_TRUE(jml::usable(filter.step(Sensor{}, y, 0.05).status));
    const auto report = single.step(FloatSensor{}, static_cast<float>(y));
    ASSERT_TRUE(jml::usable(report.status)) << jml::describe(report.status);
    ASSERT_LT((single.x().cast<double>() - filter.x()).norm(), 1e-4);  // 100 steps, each to 1e-5 of the scale
    ASSERT_LT((single.P().cast<double>() - filter.P()).norm(), 1e-4);
  }
}

/// x⁺ = x + w, of w a mean; y = x.
template <int n>
struct Drift {
  static constexpr int states = n, disturbances = n;
  static constexpr bool linear = true;
  double q = 0, mean = 0;
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    return x;
  }
  jml::Matrix<double, n, n> disturbance_input() const { return jml::Matrix<double, n, n>::Identity(); }
  jml::Matrix<double, n, n> disturbance_covariance() const {
    return q * jml::Matrix<double, n, n>::Identity();
  }
  jml::Vector<double, n> disturbance_mean() const { return jml::Vector<double, n>::Constant(mean); }
};
struct Direct {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double r = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};
// The mean of w moves x; and of a linear model one sweep is the answer.
TEST(IteratedRefusals, LinearWithADisturbanceMeanInOneSweep) {
  jml::Filter filter{jml::IteratedJml{}, Drift<1>{.q = 0.5, .mean = 0.7}, jml::Estimate<double, 1>{2.0, 1.0}};
  const auto report = filter.step(Direct{}, 4.0);
  ASSERT_EQ(report.status, jml::Status::ok);
  EXPECT_NEAR(filter.x()(0), 2.7 + 0.6 * 1.3, 1e-14);  // N = 1.5, K = 1.5/2.5
  EXPECT_NEAR(filter.P()(0, 0), 0.6, 1e-14);
  EXPECT_NEAR(report.smoothed(0), 2 + 1.3 / 2.5, 1e-14);
  EXPECT_EQ(report.iterations, 1);
}
// P⁺ = N - K E N of a nonsymmetric rule has no digit left where R/N is 1e-18: it is made in twice as many. Where
// R/N is 1e-40 those go too.
TEST(IteratedRefusals, AnUnsoundPIsMadeAgainOrRefused) {
  jml::Filter filter{jml::IteratedJml{}, Drift<1>{}, jml::Estimate<double, 1>{0.0, 1e12}};
  const auto report = filter.step(Direct{1e-6}, 10.0);
  ASSERT_TRUE(jml::usable(report.status));
  EXPECT_TRUE(report.redone);
  EXPECT_NEAR(filter.P()(0, 0), 1e-6, 1e-12);
  EXPECT_NEAR(filter.x()(0), 10, 1e-9);

  jml::Filter lost{jml::IteratedJml{}, Drift<1>{}, jml::Estimate<double, 1>{0.0, 1e20}};
  EXPECT_FALSE(jml::usable(lost.step(Direct{1e-20}, 10.0).status));
  EXPECT_EQ(lost.x()(0), 0);
  EXPECT_EQ(lost.P()(0, 0), 1e20);
}

}  // namespace
