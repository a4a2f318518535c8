// SPDX-License-Identifier: BSD-3-Clause
// Bounds of states and disturbances on linear systems: against a dense quadratic programme that shares no
// line with the library.
#include <gtest/gtest.h>

#include <jml/interval/bounded_batch.hpp>
#include <string>
#include <vector>

#include "figure.hpp"
#include "interval/dense_quadratic_programme.hpp"
#include "models/linear.hpp"

namespace {

using namespace jml::operators;
using bounds_tests::big, bounds_tests::Big, bounds_tests::QuadraticProgramme;

constexpr int n = 3, q = 2, p = 1, steps = 10;
using Dynamics = models::LinearDynamics<n, q>;
using Sensor = models::LinearSensor<n, p>;
using Box = jml::Bounds<n, q>;
using X = jml::Vector<double, n>;
using W = jml::Vector<double, q>;

/// A system, a flight of it, measurements with three times the noise that the filter is told, and bounds that
/// the flight keeps, with little to spare; some of them infinite.
struct Problem {
  Dynamics dynamics;
  Sensor sensor;
  jml::Estimate<double, n> prior;
  std::vector<jml::Vector<double, p>> y;
  Box bounds;

  explicit Problem(unsigned seed) {
    jml::Noise noise(seed);
    dynamics = models::random_linear_dynamics<n, q>(noise);
    sensor = models::random_linear_sensor<n, p>(noise);
    prior.P = models::random_covariance<n>(noise, 0.1);
    prior.x = models::random_matrix<n, 1>(noise);
    X x = prior.x + models::random_matrix<n, 1>(noise) * 0.5, low = x, high = x;
    W w_low = W::Constant(10), w_high = -w_low;
    for (int k = 0; k < steps; ++k) {
      const W w = models::random_matrix<q, 1>(noise) * 0.5;
      x = dynamics.F * x + dynamics.G * w;
      for (int i = 0; i < n; ++i) {
        low(i) = std::min(low(i), x(i));
        high(i) = std::max(high(i), x(i));
      }
      for (int i = 0; i < q; ++i) {
        w_low(i) = std::min(w_low(i), w(i));
        w_high(i) = std::max(w_high(i), w(i));
      }
      const jml::Vector<double, p> v = models::random_matrix<p, 1>(noise);
      y.push_back(sensor.M * x + v * (3 * std::sqrt(sensor.R(0, 0))));
    }
    for (int i = 0; i < n; ++i) {
      if (noise.uniform(0, 1) < 0.7) bounds.lower(i) = low(i) - noise.uniform(0, 0.2);
      if (noise.uniform(0, 1) < 0.7) bounds.upper(i) = high(i) + noise.uniform(0, 0.2);
    }
    for (int i = 0; i < q && seed % 2 == 0; ++i) {
      if (noise.uniform(0, 1) < 0.7) bounds.w_lower(i) = w_low(i) - noise.uniform(0, 0.1);
      if (noise.uniform(0, 1) < 0.7) bounds.w_upper(i) = w_high(i) + noise.uniform(0, 0.1);
    }
  }
  /// The first `count` steps; nodes and steps from `from` on are bounded: bound 0 is of node `from`. `gaps`:
  /// without the measurements of every fourth node.
  [[nodiscard]] QuadraticProgramme dense(int count, int from, bool gaps = false) const {
    QuadraticProgramme of(big(prior.x), big(prior.P), big(dynamics.F), big(dynamics.G), big(dynamics.Q),
                          count);
    for (int k = 0; k < count; ++k) {
      if (!gaps || !is_gap(k + 1))
        of.measure(k + 1, big(sensor.M), big(sensor.R), big(y[static_cast<std::size_t>(k)]));
    }
    for (int k = from; k <= count; ++k) of.bound(k, big(bounds.lower), big(bounds.upper));
    for (int k = from; k < count; ++k) of.bound_w(k, big(bounds.w_lower), big(bounds.w_upper));
    return of;
  }
  static bool is_gap(int node) { return node % 4 == 2; }
  [[nodiscard]] bool holds(const X& x) const {
    return (x.array() >= bounds.lower.array()).all() && (x.array() <= bounds.upper.array()).all();
  }
};

int sign(double value) { return (value > 0) - (value < 0); }

/// What is asked of an answer: x(node) of every node within the bounds to the bit, the states of the
/// quadratic programme, and the same bounds acting. `first`: the first bounded node; its bound is number 0 of
/// `dense`.
template <typename States, typename MultipliersOf>
void expect_answer(const Problem& problem, const QuadraticProgramme& dense, int first, int last,
                   const States& x, const MultipliersOf& multiplier, double tolerance, int& acting) {
  for (int k = first; k <= last; ++k) {
    ASSERT_TRUE(problem.holds(x(k))) << k;
    ASSERT_LT((x(k) - dense.x(k)).cwiseAbs().maxCoeff(), tolerance) << k;
    for (int i = 0; i < n; ++i) {
      const double expected = dense.multiplier(k - first, i), found = multiplier(k)(i);
      ASSERT_EQ(sign(found), sign(expected)) << k << ' ' << i << ' ' << expected;
      ASSERT_NEAR(found, expected, 10 * tolerance * (1 + std::abs(expected))) << k << ' ' << i;
      acting += sign(found) != 0;
      ASSERT_TRUE(found <= 0 || x(k)(i) == problem.bounds.upper(i)) << k;
      ASSERT_TRUE(found >= 0 || x(k)(i) == problem.bounds.lower(i)) << k;
    }
  }
}

TEST(Bounds, BatchIsTheQuadraticProgramme) {
  int acting = 0, acting_w = 0, passes = 0, most = 0;
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    SCOPED_TRACE(seed);
    const Problem problem(seed);
    jml::BoundedBatch batch{
        problem.dynamics, jml::sensors<Sensor>, problem.prior, {.steps = steps}, problem.bounds};
    for (const auto& y : problem.y) ASSERT_EQ(batch.step(problem.sensor, y).status, jml::Status::ok);
    const auto report = batch.solve();
    ASSERT_TRUE(jml::usable(report.status)) << jml::describe(report.status);
    passes += report.iterations;
    most = std::max(most, report.iterations);
    auto dense = problem.dense(steps, 0);
    dense.solve();
    ASSERT_NEAR(report.cost, dense.cost(), 1e-8 * (1 + dense.cost()));
    ASSERT_LT(report.gradient, 1e-5);
    expect_answer(
        problem, dense, 0, steps, [&](int k) { return batch.x(k); },
        [&](int k) -> const X& { return batch.multiplier(k); }, 1e-7, acting);
    if (testing::Test::HasFatalFailure()) return;
    for (int k = 0; k < steps; ++k) {
      ASSERT_LT((batch.w(k) - dense.w(k)).cwiseAbs().maxCoeff(), 1e-7) << k;
      for (int i = 0; i < q; ++i) {
        ASSERT_GE(batch.w(k)(i), problem.bounds.w_lower(i));
        ASSERT_LE(batch.w(k)(i), problem.bounds.w_upper(i));
        ASSERT_EQ(sign(batch.w_multiplier(k)(i)), sign(dense.multiplier(steps + 1 + k, i))) << k << ' ' << i;
        acting_w += sign(batch.w_multiplier(k)(i)) != 0;
      }
    }
  }
  figure::print("batch_passes", passes / 1000.0);
  figure::print("batch_most_passes", most);
  EXPECT_GT(acting, 3000);
  EXPECT_GT(acting_w, 1000);
  EXPECT_LT(passes, 15 * 1000);
  EXPECT_LT(most, 80);
}

// A window that has not slid is the whole problem; then bounds that left it go on as multipliers, and the
// answer is that of the quadratic programme of all data in which they do. Some nodes are predicted alone, and
// what was measured there comes two steps later.
template <int length>
void expect_the_lag(unsigned seeds, int& acting, int& left) {
  int passes = 0, measured = 0, most = 0;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE(seed);
    const Problem problem(seed);
    jml::Filter lag{jml::Bounded{jml::FixedLag<length>{{.sweeps = 2, .tolerance = 1e-10}}, problem.bounds},
                    problem.dynamics, jml::sensors<Sensor>, problem.prior};
    std::vector<X> pulls;
    std::vector<W> pulls_w;
    std::vector<int> late;
    const auto expect = [&](int k) {
      const int first = k - lag.depth();
      auto dense = problem.dense(k, first, true);
      for (const int j : late)
        dense.measure(j, big(problem.sensor.M), big(problem.sensor.R),
                      big(problem.y[static_cast<std::size_t>(j - 1)]));
      for (int j = 0; j < first; ++j) {
        dense.pull(j, big(pulls[static_cast<std::size_t>(j)]));
        dense.pull_w(j, big(pulls_w[static_cast<std::size_t>(j)]));
      }
      dense.solve();
      expect_answer(
          problem, dense, first, k, [&](int j) { return lag.x(k - j); },
          [&](int j) -> const X& { return lag.belief().multiplier(k - j); }, 1e-6, acting);
      return dense;
    };
    for (int k = 1; k <= steps; ++k) {
      SCOPED_TRACE(k);
      const auto& y = problem.y[static_cast<std::size_t>(k - 1)];
      if (Problem::is_gap(k)) {
        ASSERT_TRUE(jml::usable(lag.predict()));
      } else {
        const auto report = lag.step(problem.sensor, y);
        ASSERT_TRUE(jml::usable(report.status)) << jml::describe(report.status);
        passes += report.sweeps;
        most = std::max(most, report.sweeps);
        ++measured;
      }
      auto dense = expect(k);
      if (k > 2 && Problem::is_gap(k - 2)) {
        const auto& then = problem.y[static_cast<std::size_t>(k - 3)];
        ASSERT_TRUE(jml::usable(lag.update(problem.sensor, then, jml::age(2)).status));
        late.push_back(k - 2);
        dense = expect(k);
      }
      if (testing::Test::HasFatalFailure()) return;
      if (lag.depth() == length) {  // the oldest node and the step after it leave next
        X pull;
        W pull_w;
        for (int i = 0; i < n; ++i) pull(i) = dense.multiplier(0, i);
        for (int i = 0; i < q; ++i) pull_w(i) = dense.multiplier(length + 1, i);
        left += pull.norm() > 0 || pull_w.norm() > 0;
        pulls.push_back(pull);
        pulls_w.push_back(pull_w);
      }
    }
  }
  const std::string key = "lag" + std::to_string(length);
  figure::print(key + "_passes", static_cast<double>(passes) / measured);
  figure::print(key + "_most_passes", most);
}
TEST(Bounds, ALagThatCoversAllIsTheQuadraticProgramme) {
  int acting = 0, left = 0;
  expect_the_lag<steps>(200, acting, left);
  EXPECT_GT(acting, 3000);
}
TEST(Bounds, BoundsThatLeftTheWindowActByTheirMultipliers) {
  int acting = 0, left = 0;
  expect_the_lag<3>(200, acting, left);
  EXPECT_GT(acting, 1500);
  EXPECT_GT(left, 400);
}

}  // namespace
