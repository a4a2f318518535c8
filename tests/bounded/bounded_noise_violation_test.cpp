// SPDX-License-Identifier: BSD-3-Clause
// A violated bound is found and described, and the predicted box is kept bit by bit; one that is just
// honoured is no violation.
#include <gtest/gtest.h>

#include <cstring>
#include <jml/bounded/bounded_noise.hpp>

#include "models/bounded.hpp"

namespace {

using namespace jml::operators;

using jml::Box, jml::Filter, jml::Guaranteed, jml::Linearised, jml::Status, jml::usable;
using Vector1 = jml::Vector<double, 1>;
using Vector2 = jml::Vector<double, 2>;
using Plant = models::BoundedLinear<2, 1>;
using OneRow = models::BoundedLinearSensor<2, 1>;
using TwoRows = models::BoundedLinearSensor<2, 2>;

template <typename A, typename B>
bool same_bits(const A& a, const B& b) {
  return std::memcmp(a.box().lower.data(), b.box().lower.data(), sizeof a.box().lower) == 0 &&
         std::memcmp(a.box().upper.data(), b.box().upper.data(), sizeof a.box().upper) == 0 &&
         a.time() == b.time();
}

// Dyadic numbers: all bounds below are exact but for the outward rounding.
Plant plant() {
  return {(jml::Matrix<double, 2, 2>() << 1, 0.5, -0.25, 0.5).finished(), {0, -0.5}, Vector1(0.5)};
}
const Box<double, 2> start{Vector2(-1, 2), Vector2(1, 4)};
// Predicted: x₁ in 1.5 ± 1.5, x₂ in 1.5 ± 1.

template <typename Rule>
struct Violation : ::testing::Test {
  template <typename S>
  static void contradicts(const S& sensor,
                          const typename Filter<Rule, Plant>::template Measurement<S>& y,
                          const jml::Vector<double, jml::measurements_of<S>>& innovation, int row,
                          double excess) {
    Filter filter{Rule{}, plant(), start, 2.0}, predicted{Rule{}, plant(), start, 2.0};
    ASSERT_EQ(predicted.predict(0.5), Status::ok);
    const auto check = [&](const auto& report) {
      EXPECT_EQ(report.status, Status::accepted_without_measurement);
      EXPECT_TRUE(usable(report.status));
      EXPECT_EQ(report.violation.row, row);
      EXPECT_EQ(report.violation.state, -1);
      EXPECT_NEAR(report.violation.excess, excess, 1e-13);
      EXPECT_LT((report.innovation - innovation).cwiseAbs().maxCoeff(), 1e-14);
      EXPECT_TRUE(same_bits(filter, predicted));
    };
    check(filter.step(sensor, y, 0.5));
    check(filter.update(sensor, y));
    EXPECT_EQ(filter.time(), 2.5);
    // Later measurements are used again, as if the bad ones had never come.
    const OneRow good({1, 0}, Vector1(0.25));
    for (int k = 0; k < 5; ++k) {
      const double y_good = predicted.x()(0) + 0.25;
      const auto report = filter.update(good, y_good), wanted = predicted.update(good, y_good);
      ASSERT_EQ(report.status, Status::ok);
      ASSERT_EQ(wanted.status, Status::ok);
      EXPECT_EQ(report.violation.row, -1);
      EXPECT_EQ(report.violation.state, -1);
      EXPECT_EQ(report.violation.excess, 0);
      EXPECT_TRUE(same_bits(filter, predicted));
      EXPECT_LT(filter.box().width()(0), 0.51);
      ASSERT_EQ(filter.predict(0.5), Status::ok);
      ASSERT_EQ(predicted.predict(0.5), Status::ok);
    }
  }
};
using Rules = ::testing::Types<Linearised, Guaranteed<>, Guaranteed<0>>;
TYPED_TEST_SUITE(Violation, Rules);

TYPED_TEST(Violation, RowAndExcess) {
  const OneRow first({1, 0}, Vector1(0.25)), scaled({0, -2}, Vector1(0.25)), sum({1, 1}, Vector1(0.5));
  this->contradicts(first, Vector1(4.0), Vector1(2.5), 0, 0.75);    // [3.75, 4.25], reachable up to 3
  this->contradicts(first, Vector1(-0.5), Vector1(-2.0), 0, 0.25);  // [-0.75, -0.25], from 0
  this->contradicts(scaled, Vector1(1.0), Vector1(4.0), 0, 1.75);   // [0.75, 1.25] against [-5, -1]
  this->contradicts(scaled, Vector1(-9.0), Vector1(-6.0), 0, 3.75);
  this->contradicts(sum, Vector1(-0.5), Vector1(-3.5), 0, 0.5);  // [-1, 0] against [0.5, 5.5]
}

// x₁ + x₂ = 3 ± 0.5 is possible, x₁ - x₂ = 4 ± 1 against [-2.5, 2.5] not.
TYPED_TEST(Violation, SecondRow) {
  const TwoRows rows((jml::Matrix<double, 2, 2>() << 1, 1, 1, -1).finished(), Vector2(0.5, 1));
  this->contradicts(rows, Vector2(3, 4), Vector2(0, 4), 1, 0.5);
}
// Each row alone is possible: x₁ = 3 ± 0.25; then x₁ + x₂ is in [3.25, 5.5], not 2 ± 0.5.
TYPED_TEST(Violation, SecondRowAfterTheFirst) {
  const TwoRows rows((jml::Matrix<double, 2, 2>() << 1, 0, 1, 1).finished(), Vector2(0.25, 0.5));
  this->contradicts(rows, Vector2(3, 2), Vector2(1.5, -1), 1, 0.75);
}

// A measurement at the very edge of what is possible, on either side and off by no more than the rounding of
// y itself, is used: the box stays a box, inside the predicted one.
TYPED_TEST(Violation, NotAtTheEdge) {
  jml::Noise noise(12);
  int thin = 0;
  for (int run = 0; run < 4000; ++run) {
    const double scale = std::pow(10.0, noise.uniform(-6, 6));
    Box<double, 2> box;
    for (int i = 0; i < 2; ++i) {
      box.lower(i) = scale * noise.uniform(-2, 1);
      box.upper(i) = box.lower(i) + scale * std::pow(10.0, noise.uniform(-12, 1));
      if (run % 7 == i) box.upper(i) = box.lower(i);
    }
    const double b = run % 5 == 0 ? 0 : scale * noise.uniform();
    Vector2 h(noise.uniform(-1, 1), noise.uniform(-1, 1));
    if (run % 3 == 0) h = Vector2(1, 0);
    if (run % 3 == 1) h = Vector2(0, 1);
    const bool above = run % 2 == 0;
    const Vector2 corner(above == (h(0) >= 0) ? box.upper(0) : box.lower(0),
                         above == (h(1) >= 0) ? box.upper(1) : box.lower(1));
    const double y = h.dot(corner) + (above ? b : -b);
    Filter filter{TypeParam{}, plant(), box};
    const auto report = filter.update(OneRow(h.transpose(), Vector1(b)), y);
    ASSERT_EQ(report.status, Status::ok) << run << ' ' << report.violation.excess / scale;
    ASSERT_TRUE(filter.box().valid()) << run;
    ASSERT_GE((filter.box().lower - box.lower).minCoeff(), 0) << run;
    ASSERT_LE((filter.box().upper - box.upper).maxCoeff(), 0) << run;
    for (int i = 0; i < 2; ++i) {  // the corner itself is left, to rounding
      ASSERT_LE(filter.box().lower(i), corner(i) + 1e-15 * scale);
      ASSERT_GE(filter.box().upper(i), corner(i) - 1e-15 * scale);
    }
    thin += filter.box().width()(0) < 1e-6 * box.width()(0);
    // Two ulps of a number of this size further out is still rounding, a millionth is not.
    Filter outside{TypeParam{}, plant(), box};
    const double size = std::abs(y) + b + box.upper.norm() + box.lower.norm();
    const auto beyond = outside.update(OneRow(h.transpose(), Vector1(b)), y + (above ? 1e-6 : -1e-6) * size);
    ASSERT_EQ(beyond.status, Status::accepted_without_measurement) << run;
    ASSERT_NEAR(beyond.violation.excess, 1e-6 * size, 1e-13 * size);
  }
  EXPECT_GT(thin, 100);
}

/// x⁺ = (position + ½ rate, rate): no disturbance.
Plant drift() { return {(jml::Matrix<double, 2, 2>() << 1, 0.5, 0, 1).finished(), {0, 0}, Vector1(0.0)}; }
const Box<double, 2> still{Vector2(0, -1), Vector2(0, 1)};  // the position is known, the rate in ±1

// Each of both states is within its bounds, but not both together: only the way back sees it.
TEST(ViolationOfTheDynamics, FoundByLookingBack) {
  Filter filter{Guaranteed<0>{}, drift(), still};
  const TwoRows both(jml::Matrix<double, 2, 2>::Identity(), Vector2(0, 0));
  const auto report = filter.step(both, Vector2(0.5, -1));  // the position says rate 1
  EXPECT_EQ(report.status, Status::accepted_without_measurement);
  EXPECT_EQ(report.violation.row, -1);
  EXPECT_EQ(report.violation.state, 1);
  EXPECT_NEAR(report.violation.excess, 2, 1e-13);
  Filter predicted{Guaranteed<0>{}, drift(), still};
  ASSERT_EQ(predicted.predict(), Status::ok);
  EXPECT_TRUE(same_bits(filter, predicted));
  const auto good = filter.update(both, Vector2(0.25, 0.5));
  EXPECT_EQ(good.status, Status::ok);
  EXPECT_LT(filter.box().width().maxCoeff(), 1e-14);
  // Linearised cannot know.
  Filter linearised{Linearised{}, drift(), still};
  EXPECT_EQ(linearised.step(both, Vector2(0.5, -1)).status, Status::ok);
}
TEST(ViolationOfTheDynamics, FoundByTheZonotope) {
  Filter filter{Guaranteed{}, drift(), still};
  const TwoRows both(jml::Matrix<double, 2, 2>::Identity(), Vector2(0, 0));
  const OneRow vague({1, 0}, Vector1(10.0));
  ASSERT_EQ(filter.update(vague, 0.0).status, Status::ok);
  const auto report = filter.step(both, Vector2(0.5, -1));
  EXPECT_EQ(report.status, Status::accepted_without_measurement);
  EXPECT_TRUE(report.violation.row == 1 || report.violation.state == 1);
  EXPECT_NEAR(report.violation.excess, 2, 1e-12);
  EXPECT_LT((filter.box().upper - Vector2(0.5, 1)).norm(), 1e-14);
  EXPECT_LT((filter.box().lower - Vector2(-0.5, -1)).norm(), 1e-14);
  EXPECT_EQ(filter.update(both, Vector2(0.25, 0.5)).status, Status::ok);
}

// A disturbance far beyond its bound, a kick of 0.5 rad/s, puts the truth outside the reachable box: this is
// found within 5 steps, though only the angle is measured; and never where all bounds are honoured.
TEST(ViolationOfTheDynamics, DisturbanceBeyondItsBound) {
  const models::BoundedPendulum pendulum{{.variance = 0.003}};
  const models::BoundedAngleSensor sensor{{.r = 1e-5}};
  const double push = pendulum.disturbance_bound()(0), b = sensor.noise_bound()(0);
  int found_within = 0, runs = 0;
  for (int seed = 0; seed < 10; ++seed) {
    jml::Noise noise(20 + seed);
    Vector2 truth(0.5 + 0.1 * seed, 0);
    Filter filter{Guaranteed{}, pendulum, Box{truth - Vector2(0.1, 0.5), truth + Vector2(0.2, 0.3)}};
    const auto advance = [&](double w) {
      truth = pendulum.dynamics(truth) + pendulum.disturbance_input() * w;
      return filter.step(sensor, truth(0) + noise.uniform(-b, b));
    };
    for (int k = 0; k < 100; ++k) {
      ASSERT_EQ(advance(noise.uniform(-push, push)).status, Status::ok) << k;
      ASSERT_TRUE(filter.box().contains(truth)) << k;
    }
    ++runs;
    const double kick = seed % 2 == 0 ? 100 * push : -100 * push;
    for (int k = 0; k < 5; ++k) {
      const auto report = advance(k == 0 ? kick : noise.uniform(-push, push));
      if (report.status != Status::accepted_without_measurement) continue;
      EXPECT_TRUE((report.violation.row == 0) != (report.violation.state >= 0));
      EXPECT_LT(report.violation.state, 2);
      EXPECT_GT(report.violation.excess, 0);
      EXPECT_FALSE(filter.box().contains(truth));
      ++found_within;
      break;
    }
  }
  EXPECT_EQ(found_within, runs);
}

}  // namespace
