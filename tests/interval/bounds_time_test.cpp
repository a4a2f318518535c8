// SPDX-License-Identifier: BSD-3-Clause
// Bounds where steps have a length: a measurement that comes late, between two nodes, finds the answer that
// it finds in the order of time; and a start of which nothing is known, which takes twice the digits.
#include <gtest/gtest.h>

#include <jml/interval/bounded_batch.hpp>

#include "interval/dense_quadratic_programme.hpp"
#include "models/linear.hpp"

namespace {

using namespace jml::operators;
using bounds_tests::big, bounds_tests::Big;
using models::ConstantVelocity;
using X = jml::Vector<double, 4>;
using Square = jml::Matrix<double, 4, 4>;
using Place = models::LinearSensor<4, 2>;
using Box = jml::Bounds<4, 4>;

const Place sensor = [] {
  Place of;
  of.M << 1, 0, 0, 0, 0, 0, 1, 0;
  of.R << 0.05, 0.01, 0.01, 0.05;
  return of;
}();
jml::Vector<double, 2> place(double t) { return {std::sin(2 * t), std::cos(3 * t) - 1}; }
/// Below what the flight reaches: of a place, a speed, and what a step may do to the other place and speed.
const Box box = [] {
  Box of;
  of.upper << 0.7, Box::infinite, Box::infinite, 0.9;
  of.lower(3) = -1.2;
  of.w_lower << -Box::infinite, -0.12, -0.005, -0.1;
  of.w_upper << 0.004, 0.15, 0.006, 0.12;
  return of;
}();
bool holds(const X& x) {
  return (x.array() >= box.lower.array()).all() && (x.array() <= box.upper.array()).all();
}

/// Every w of the window, to the tolerance.
template <typename Window>
bool disturbances_hold(const Window& window) {
  bool held = true;
  const auto now = static_cast<std::size_t>(window.now());
  for (int j = 1; j <= window.last(); ++j) {
    Square L = Square::Zero();
    held &= jml::detail::NoiseRoot<double, ConstantVelocity>::root_of_covariance(
        window.dynamics(), window.node(j - 1).x[now], window.node(j).at(), L);
    const X w = L * window.node(j).b[now];
    for (int i = 0; i < 4; ++i) held &= w(i) >= box.w_lower(i) - 1e-7 && w(i) <= box.w_upper(i) + 1e-7;
  }
  return held;
}

TEST(BoundsInTime, BetweenTwoNodesALateMeasurementIsWorthWhatItIsInOrder) {
  const jml::Estimate<double, 4> start{X::Zero(), Square::Identity()};
  const auto make = [&] {
    return jml::Filter{jml::Bounded{jml::FixedLag<16>{{.tolerance = 1e-10}}, box}, ConstantVelocity{},
                       jml::sensors<Place>, start};
  };
  int acting = 0;
  for (int late = 1; late < 12; ++late) {
    SCOPED_TRACE(late);
    auto lag = make(), ordered = make();
    for (int k = 1; k <= 12; ++k) {
      const double t = 0.125 * k, then = t - 0.0625;
      ASSERT_TRUE(usable(lag.step(sensor, place(t), 0.125).status));
      const bool split = k == late;
      ASSERT_TRUE(!split || usable(ordered.step(sensor, place(then), 0.0625).status));
      ASSERT_TRUE(usable(ordered.step(sensor, place(t), jml::at_time(t)).status));
    }
    const double then = 0.125 * late - 0.0625;
    ASSERT_TRUE(usable(lag.update(sensor, place(then), jml::at_time(then)).status));
    ASSERT_EQ(lag.depth(), 13);
    for (int age = 0; age <= 13; ++age) {
      EXPECT_EQ(lag.time(age), ordered.time(age));
      EXPECT_TRUE(holds(lag.x(age)));
      EXPECT_LT((lag.x(age) - ordered.x(age)).norm(), 1e-7);
      EXPECT_LT((lag.belief().multiplier(age) - ordered.belief().multiplier(age)).norm(), 1e-5);
      acting += !(lag.belief().multiplier(age).squaredNorm() <= 0);
    }
    for (int k = 13; k <= 20; ++k) {  // and goes on so, when these nodes leave
      const double t = 0.125 * k;
      ASSERT_TRUE(usable(lag.step(sensor, place(t), 0.125).status));
      ASSERT_TRUE(usable(ordered.step(sensor, place(t), 0.125).status));
      EXPECT_LT((lag.x() - ordered.x()).norm(), 1e-7);
      EXPECT_TRUE(disturbances_hold(lag.belief()));
    }
  }
  EXPECT_GT(acting, 30);
}

TEST(BoundsInTime, OfAStartOfWhichNothingIsKnown) {
  constexpr int steps = 12;
  constexpr double dt = 0.125;
  const ConstantVelocity dynamics;
  Square F = Square::Identity();
  F(0, 1) = F(2, 3) = dt;
  const Square Q = dynamics.disturbance_covariance(X(X::Zero()), jml::StepContext<double>{0, dt});
  int acting = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    jml::Noise noise(seed);
    const jml::Estimate<double, 4> start{X::Zero(), Square(X::Constant(Box::infinite).asDiagonal())};
    jml::BoundedBatch batch{dynamics, jml::sensors<Place>, start, {.steps = steps}, box};
    jml::Filter lag{jml::Bounded{jml::FixedLag<steps>{{.tolerance = 1e-10}}, box}, dynamics,
                    jml::sensors<Place>, start};
    bounds_tests::QuadraticProgramme dense(big(start.x), Big(0, 0), big(F), big(Square(Square::Identity())),
                                           big(Q), steps);
    for (int k = 1; k <= steps; ++k) {
      const jml::Vector<double, 2> y = place(dt * k) + 0.2 * noise.normal_vector<2>();
      ASSERT_EQ(batch.step(sensor, y, dt).status, jml::Status::ok);
      ASSERT_TRUE(usable(lag.step(sensor, y, dt).status));
      dense.measure(k, big(sensor.M), big(sensor.R), big(y));
    }
    const auto report = batch.solve();
    ASSERT_TRUE(usable(report.status)) << jml::describe(report.status);
    for (int k = 0; k <= steps; ++k) dense.bound(k, big(box.lower), big(box.upper));
    for (int k = 0; k < steps; ++k) dense.bound_w(k, big(box.w_lower), big(box.w_upper));
    dense.solve();
    for (int k = 0; k <= steps; ++k) {
      ASSERT_TRUE(holds(batch.x(k)) && holds(lag.x(steps - k)));
      ASSERT_LT((batch.x(k) - dense.x(k)).norm(), 1e-6) << k;
      ASSERT_LT((lag.x(steps - k) - dense.x(k)).norm(), 1e-6) << k;
      for (int i = 0; i < 4; ++i) {
        ASSERT_EQ(batch.multiplier(k)(i) > 0, dense.multiplier(k, i) > 0);
        ASSERT_EQ(batch.multiplier(k)(i) < 0, dense.multiplier(k, i) < 0);
        acting += !(std::abs(batch.multiplier(k)(i)) <= 0);
        if (k < steps) acting += !(std::abs(batch.w_multiplier(k)(i)) <= 0);
      }
    }
  }
  EXPECT_GT(acting, 80);
}

}  // namespace
