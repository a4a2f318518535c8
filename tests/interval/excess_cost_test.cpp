// SPDX-License-Identifier: BSD-3-Clause
// The excess cost of an estimate against closed forms.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <jml/jml.hpp>

#include "models/linear.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using State = jml::Vector<double, 2>;
using Square = jml::Matrix<double, 2, 2>;

// Linear: J restricted to x_N = z is a parabola over the Kalman filter's x and P.
TEST(ExcessCost, OfALinearModelIsHalfTheSquaredDistance) {
  jml::Noise noise(5);
  const auto d = models::random_linear_dynamics<4, 2>(noise);
  const auto s = models::random_linear_sensor<4, 2>(noise);
  const jml::Estimate<double, 4> prior{jml::Vector<double, 4>(1, -1, 0.5, 2),
                                       jml::Matrix<double, 4, 4>::Identity()};
  jml::Batch batch{d, jml::sensors<models::LinearSensor<4, 2>>, prior, {12}};
  jml::Filter filter{jml::Kalman{}, d, prior};
  for (int k = 0; k < 12; ++k) {
    const jml::Vector<double, 2> y(noise.normal(), noise.normal());
    ASSERT_EQ(batch.step(s, y), jml::Status::ok);
    ASSERT_EQ(filter.step(s, y).status, jml::Status::ok);
  }
  for (int i = 0; i < 4; ++i) {
    const jml::Vector<double, 4> off(noise.normal(), noise.normal(), noise.normal(), noise.normal());
    const double expected = 0.5 * off.dot(filter.P().inverse() * off);
    const auto excess = jml::excess_cost(batch, jml::Vector<double, 4>(filter.x() + off));
    EXPECT_EQ(excess.status, jml::Status::ok);
    EXPECT_NEAR(excess.value, expected, 1e-9 * expected);
  }
  EXPECT_NEAR(jml::excess_cost(batch, filter.x()).value, 0, 1e-12);
}

// x_0 known, two steps, one disturbance each: the position of x_2 fixes w_0 and its velocity w_1.
TEST(ExcessCost, OfTwoStepsIsThatOfTheOnlyTrajectory) {
  const models::VanDerPol d;
  const models::SaturatingPosition s;
  const State x0(1.2, 0.3), end(1.25, 0.9);
  const double y[2] = {0.75, 0.8};
  jml::Batch batch{
      d, jml::sensors<models::SaturatingPosition>, jml::Estimate{x0, Square(Square::Zero())}, {2}};
  for (const double value : y) ASSERT_EQ(batch.step(s, value), jml::Status::ok);

  const State f0 = d.dynamics(x0);
  const double w0 = ((end(0) - f0(0)) / d.dt - f0(1)) / d.dt;  // x_2 = x_1 + dt v_1, v_1 = f + dt w_0
  const State x1(f0(0), f0(1) + d.dt * w0);
  const State f1 = d.dynamics(x1);
  const double w1 = (end(1) - f1(1)) / d.dt;
  const auto misfit = [&](double value, const State& x) { return value - s.measurement(x)(0); };
  const double J = 0.5 * (w0 * w0 + w1 * w1) * d.dt / d.q_c +
                   0.5 * (std::pow(misfit(y[0], x1), 2) + std::pow(misfit(y[1], end), 2)) / s.r;
  EXPECT_NEAR(f1(0), end(0), 1e-12);

  const auto least = batch.solve();
  ASSERT_EQ(least.status, jml::Status::ok);
  const auto excess = jml::excess_cost(batch, end);
  EXPECT_EQ(excess.status, jml::Status::ok);
  EXPECT_GT(excess.value, 0.1);
  EXPECT_NEAR(excess.value, J - least.cost, 1e-8 * J);
}

TEST(ExcessCost, RefusesWhereNoTrajectoryLeads) {
  const models::VanDerPol d;
  const models::SaturatingPosition s;
  const State x0(1.2, 0.3);
  jml::Batch batch{
      d, jml::sensors<models::SaturatingPosition>, jml::Estimate{x0, Square(Square::Zero())}, {1}};
  ASSERT_EQ(batch.step(s, 0.7), jml::Status::ok);
  const State reachable(d.dynamics(x0)(0), 0.5), elsewhere(reachable(0) + 1e-3, 0.5);
  EXPECT_EQ(jml::excess_cost(batch, reachable).status, jml::Status::ok);
  const auto refused = jml::excess_cost(batch, elsewhere);  // one step moves the velocity only
  EXPECT_EQ(refused.status, jml::Status::not_a_trajectory);
  EXPECT_TRUE(std::isnan(refused.value));
  EXPECT_EQ(jml::excess_cost(batch, State(std::nan(""), 0)).status, jml::Status::invalid_state);
}

// The batch's own answer costs nothing more; a filter's does, and the caller's batch is left alone.
TEST(ExcessCost, OfAFilterIsPositive) {
  const models::VanDerPol d;
  const models::SaturatingPosition s;
  const jml::Estimate<double, 2> prior{State(1.5, 0.5), 0.1 * Square::Identity()};
  jml::Batch batch{d, jml::sensors<models::SaturatingPosition>, prior, {60}};
  jml::Filter ekf{jml::Ekf{}, d, prior};
  jml::Noise noise(2);
  State x(1, 0);
  for (int k = 0; k < 60; ++k) {
    x = d.dynamics(x) + d.disturbance_input() * noise.normal_vector(d.disturbance_covariance());
    const double y = s.measurement(x)(0) + std::sqrt(s.r) * noise.normal();
    ASSERT_EQ(batch.step(s, y), jml::Status::ok);
    ASSERT_EQ(ekf.step(s, y).status, jml::Status::ok);
  }
  const auto least = batch.solve();
  ASSERT_TRUE(jml::usable(least.status));
  const State answer = batch.x(60);
  const auto own = jml::excess_cost(batch, answer), excess = jml::excess_cost(batch, ekf.x());
  EXPECT_NEAR(own.value, 0, 1e-10);
  EXPECT_EQ(excess.status, jml::Status::ok);
  const State off = ekf.x() - answer;
  const double quadratic = 0.5 * off.dot(batch.P(60).inverse() * off);
  EXPECT_GT(excess.value, 0.5 * quadratic);
  EXPECT_LT(excess.value, 2 * quadratic);
  EXPECT_EQ(batch.x(60), answer);
}

}  // namespace
