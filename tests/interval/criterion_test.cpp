// SPDX-License-Identifier: BSD-3-Clause
// The criterion J of eq. (5), by hand on a scalar system, and its one-step form against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <jml/jml.hpp>

#include "models/linear.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

/// x⁺ = x + w̄ + w, y = x² + v.
struct Scalar {
  static constexpr int states = 1, disturbances = 1;
  double q = 4, mean = 0.5;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> disturbance_input() const { return jml::Matrix<double, 1, 1>(1.0); }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(q); }
  jml::Vector<double, 1> disturbance_mean() const { return jml::Vector<double, 1>(mean); }
};
struct Square {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.25); }
};

using V = jml::Vector<double, 1>;
const jml::Estimate<double, 1> prior{V(1.0), jml::Matrix<double, 1, 1>(2.0)};

// x_0 = 2: ½ 1²/2; w = 1 (x = 3.5): ½ 1/4; y = 12: ½ (12 - 12.25)²/0.25; w = -2 (x = 2): ½ 4/4; y = 5: ½
// 1/0.25.
TEST(Criterion, ByHand) {
  const double expected = 0.25 + 0.125 + 0.125 + 0.5 + 2.0;
  jml::Criterion by_disturbance{Scalar{}, prior};
  EXPECT_EQ(by_disturbance.start(V(2.0)), jml::Status::ok);
  EXPECT_EQ(by_disturbance.disturb(V(1.0)), jml::Status::ok);
  EXPECT_EQ(by_disturbance.measure(Square{}, V(12.0)), jml::Status::ok);
  EXPECT_EQ(by_disturbance.disturb(V(-2.0)), jml::Status::ok);
  EXPECT_EQ(by_disturbance.measure(Square{}, V(5.0)), jml::Status::ok);
  EXPECT_DOUBLE_EQ(by_disturbance.x()(0), 2.0);
  EXPECT_DOUBLE_EQ(by_disturbance.value(), expected);

  jml::Criterion by_states{Scalar{}, prior};
  (void)by_states.start(V(2.0));
  EXPECT_EQ(by_states.advance_to(V(3.5)), jml::Status::ok);
  (void)by_states.measure(Square{}, V(12.0));
  EXPECT_EQ(by_states.advance_to(V(2.0)), jml::Status::ok);
  (void)by_states.measure(Square{}, V(5.0));
  EXPECT_DOUBLE_EQ(by_states.value(), expected);
}

// A filter's output is no trajectory: where G Q Gᵀ is singular the model cannot follow it, and J says so.
TEST(Criterion, RefusesWhatIsNoTrajectory) {
  const models::VanDerPol d;
  const jml::Estimate<double, 2> known{{1, 0}, jml::Matrix<double, 2, 2>::Zero()};
  jml::Criterion J{d, known};
  EXPECT_EQ(J.start({1, 0}), jml::Status::ok);
  jml::Vector<double, 2> next = d.dynamics(jml::Vector<double, 2>(1, 0));
  next(1) += 0.3;  // the disturbance drives the velocity: this is possible
  EXPECT_EQ(J.advance_to(next), jml::Status::ok);
  EXPECT_NEAR(J.value(), 0.5 * 0.3 * 0.3 / (d.dt * d.q_c), 1e-14);
  jml::Vector<double, 2> jump = d.dynamics(next);
  jump(0) += 1e-6;  // the position cannot jump
  EXPECT_EQ(J.advance_to(jump), jml::Status::not_a_trajectory);
  EXPECT_TRUE(std::isnan(J.value()));

  jml::Criterion elsewhere{d, known};
  EXPECT_EQ(elsewhere.start({1.1, 0}), jml::Status::not_a_trajectory);  // P_0 = 0: x_0 is known
}

TEST(Criterion, RefusesABadPriorOrNoise) {
  jml::Criterion J{Scalar{}, jml::Estimate<double, 1>{V(1.0), jml::Matrix<double, 1, 1>(-2.0)}};
  EXPECT_EQ(J.start(V(1.0)), jml::Status::invalid_covariance);
  EXPECT_TRUE(std::isnan(J.value()));
  jml::Criterion K{Scalar{.q = -1}, prior};
  (void)K.start(V(1.0));
  EXPECT_EQ(K.advance_to(V(2.0)), jml::Status::invalid_disturbance_covariance);
}

// Linear: the least one-step cost is ½ νᵀ S⁻¹ ν, for the one-pass and the iterated rules alike.
TEST(OneStepCost, OfALinearModelIsHalfTheNis) {
  jml::Noise noise(3);
  const auto dynamics = models::random_linear_dynamics<4, 2>(noise);
  const auto sensor = models::random_linear_sensor<4, 2>(noise);
  jml::Estimate<double, 4> start{jml::Vector<double, 4>(1, -1, 0.5, 2),
                                 jml::Matrix<double, 4, 4>::Identity()};
  start.P(0, 1) = start.P(1, 0) = 0.3;
  const jml::Vector<double, 2> y(0.7, -1.2);
  const auto check = [&](const auto& rule) {
    const auto result = jml::step(rule, dynamics, sensor, start, y);
    const auto cost = jml::one_step_cost(rule, dynamics, sensor, start, y, {}, result.report);
    EXPECT_EQ(cost.status, jml::Status::ok);
    EXPECT_NEAR(cost.value, result.report.nis() / 2, 1e-12 * cost.value);
  };
  check(jml::Ekf{});
  check(jml::Jml{});
  check(jml::IteratedJml{});
}

// The exact step has the least cost of all, on every step of a run.
TEST(OneStepCost, OfTheExactStepIsTheLeast) {
  const models::VanDerPol d;
  const models::SaturatingPosition s;
  jml::Filter filter{jml::Ekf{}, d,
                     jml::Estimate<double, 2>{{1.5, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()}};
  double excess = 0;
  for (int i = 0; i < 200; ++i) {
    const jml::Estimate<double, 2> before = filter.estimate();
    const jml::Vector<double, 1> y(0.6 * std::sin(0.3 * i) + 0.2 * std::cos(2.1 * i));
    const auto exact = jml::step(jml::IteratedJml{}, d, s, before, y);
    const auto report = filter.step(s, y);
    ASSERT_EQ(exact.report.status, jml::Status::ok);
    const double cost = jml::one_step_cost(jml::Ekf{}, d, s, before, y, {}, report).value;
    EXPECT_GE(cost, exact.report.cost * (1 - 1e-9));
    excess += cost - exact.report.cost;
  }
  EXPECT_GT(excess, 1e-3);
}

}  // namespace
