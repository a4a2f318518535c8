// SPDX-License-Identifier: BSD-3-Clause
// A usable status of an exact step stands over a minimum of the criterion (11): of a root that is a saddle or a maximum
// the step goes on downhill, on both sides, to the lower minimum.
#include <gtest/gtest.h>

#include <cmath>
#include <jml/campaign/noise.hpp>
#include <jml/iterated/iterated.hpp>

namespace {

using jml::Status;
template <int n>
using Vec = jml::Vector<double, n>;
template <int rows, int cols>
using Mat = jml::Matrix<double, rows, cols>;

template <int n>
struct Rest {
  static constexpr int states = n, disturbances = n;
  static constexpr bool linear = true;
  double q = 0;
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    return x;
  }
  Mat<n, n> disturbance_input() const { return Mat<n, n>::Identity(); }
  Mat<n, n> disturbance_covariance() const { return q * Mat<n, n>::Identity(); }
};

struct Square {
  static constexpr int measurements = 1;
  double r = 0.01;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0));
  }
  Mat<1, 1> noise_covariance() const { return Mat<1, 1>(r); }
};

/// Ranges to two beacons at (±10, 0).
struct Beacons {
  static constexpr int measurements = 2;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    const T a = x(0) - T(10), b = x(0) + T(10), h = x(1) * x(1);
    return jml::Vector<T, 2>(sqrt(a * a + h), sqrt(b * b + h));
  }
  Mat<2, 2> noise_covariance() const { return 0.01 * Mat<2, 2>::Identity(); }
};

// At x = 0 the derivative of x² vanishes: the prior is a root, a maximum of J = 50 between two minima.
template <typename Rule>
void expect_square_root(const Rule& rule, double P) {
  jml::Filter filter{rule, Rest<1>{1e-6}, jml::Estimate<double, 1>{0.0, 4.0}};
  const auto report = filter.step(Square{}, 1.0);
  ASSERT_EQ(report.status, Status::ok);
  EXPECT_NEAR(std::abs(filter.x()(0)), 0.999375, 1e-6);
  EXPECT_NEAR(report.cost, 0.1249, 1e-4);
  EXPECT_NEAR(filter.P()(0, 0), P, 0.01 * P);
}
TEST(Minima, S6StationaryPrior) {
  expect_square_root(jml::IteratedJml{}, 0.005);  // R over M m_x = x · 2 x, the SDC matrix beside the Jacobian
  expect_square_root(jml::Iekf{}, 0.0025);
}

template <typename Rule>
void expect_above_or_below(const Rule& rule) {
  jml::Filter filter{rule, Rest<2>{}, jml::Estimate<double, 2>{Vec<2>(0, 1e-6), 100 * Mat<2, 2>::Identity()}};
  const auto report = filter.update(Beacons{}, Vec<2>(14.142, 14.142));
  ASSERT_TRUE(jml::usable(report.status)) << jml::describe(report.status);
  EXPECT_NEAR(filter.x()(0), 0, 1e-6);
  EXPECT_NEAR(std::abs(filter.x()(1)), 9.9992, 1e-3);
  EXPECT_NEAR(report.cost, 0.50, 5e-3);
}
TEST(Minima, S7BetweenTheBeacons) {
  expect_above_or_below(jml::IteratedJml{});
  expect_above_or_below(jml::Iekf{});
}

// Without a solver to go down by, the root is named for what it is.
TEST(Minima, NamedWithoutFallback) {
  jml::Filter filter{jml::IteratedJml{jml::IterationOptions{.use_fallback = false}}, Rest<1>{1e-6},
                     jml::Estimate<double, 1>{0.0, 4.0}};
  EXPECT_EQ(filter.step(Square{}, 1.0).status, Status::no_minimum);
  EXPECT_EQ(filter.x()(0), 0);
  EXPECT_EQ(filter.P()(0, 0), 4);
}

/// The least J of ½ (x - x̂)²/P + ½ (y - x²)²/R, of all real roots of its derivative by bisection between the turning
/// points of that cubic.
double least_cost(double prior, double P, double R, double y) {
  const auto J = [&](double x) { return ((x - prior) * (x - prior) / P + (y - x * x) * (y - x * x) / R) / 2; };
  const auto slope = [&](double x) { return (x - prior) / P - 2 * x * (y - x * x) / R; };
  const double bend = (2 * y / R - 1 / P) * R / 6, turn = bend > 0 ? std::sqrt(bend) : 0;
  const double far = 10 + std::abs(prior) + std::abs(y) + turn;
  double least = std::numeric_limits<double>::infinity();
  const double edges[] = {-far, -turn, turn, far};
  for (int k = 0; k < 3; ++k) {
    double low = edges[k], high = edges[k + 1];
    if (!(slope(low) <= 0 && slope(high) >= 0)) continue;  // a minimum lies between
    for (int i = 0; i < 200; ++i) (slope((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
    least = std::min(least, J((low + high) / 2));
  }
  return least;
}
TEST(Minima, LeastCostOfASquare) {
  jml::Noise noise(41);
  int best = 0, usable = 0;
  constexpr int runs = 20'000;
  for (int k = 0; k < runs; ++k) {
    const double prior = 1.5 * noise.normal(), P = std::exp(1.5 * noise.normal()), R = std::exp(2 * noise.normal() - 3);
    const double truth = prior + std::sqrt(P) * noise.normal(), y = truth * truth + std::sqrt(R) * noise.normal();
    jml::Filter filter{jml::IteratedJml{}, Rest<1>{}, jml::Estimate<double, 1>{prior, P}};
    const auto report = filter.update(Square{R}, y);
    usable += jml::usable(report.status);
    const double least = least_cost(prior, P, R, y);
    const bool is_best = jml::usable(report.status) && report.cost <= least + 1e-7 * (1 + least);
    best += is_best;
    if (!is_best && k - best < 12)
      std::printf("x %g P %g R %g y %g: %s, x %g J %g, least %g, %d iterations by %d\n", prior, P, R, y,
                  jml::describe(report.status), filter.x()(0), report.cost, least, report.iterations, int(report.solver));
  }
  std::printf("%d of %d usable, %d at the least cost\n", usable, runs, best);
  EXPECT_EQ(best, runs);
}

}  // namespace
