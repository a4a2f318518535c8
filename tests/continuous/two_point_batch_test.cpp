// SPDX-License-Identifier: BSD-3-Clause
// The batch of samples every dt tends to the continuous smoother: of order 1 with a sample at the end of each
// step and R/dt; of order 2 with a sample at both ends of the flight too, of twice that variance, as in the
// trapezoidal rule. Its steps are of Runge-Kutta, with a disturbance held inside.
#include <gtest/gtest.h>

#include <jml/continuous/swept.hpp>
#include <jml/model/discretize.hpp>

#include "models/continuous.hpp"

namespace {

using namespace jml::operators;

constexpr double duration = 3, density = 1e-2;
const models::Oscillator oscillator{1, 0.1, 1, 1};
const jml::Estimate<double, 2> prior{{1.2, 0.3}, jml::Matrix<double, 2, 2>{{0.04, 0}, {0, 0.09}}};

jml::Vector<double, 1> y(double t) {
  return jml::Vector<double, 1>(0.8 * std::cos(0.9 * t) + 0.05 * std::sin(3 * t));
}

struct Sample {
  static constexpr int measurements = 1;
  double r;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return models::SaturatingPosition{}.measurement(x);
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};

struct Answer {
  jml::Vector<double, 2> first, last;
  double cost;
};
Answer batch(int steps, bool both_ends) {
  const double dt = duration / steps, r = density / dt;
  jml::Batch of{jml::DiscretizedInSpace<models::Oscillator, jml::RungeKutta4>(oscillator),
                jml::sensors<Sample>,
                prior,
                {.steps = steps}};
  if (both_ends) {
    EXPECT_EQ(of.update(Sample{2 * r}, y(0)).status, jml::Status::ok);
  }
  for (int k = 1; k <= steps; ++k)
    EXPECT_EQ(of.step(Sample{both_ends && k == steps ? 2 * r : r}, y(k * dt), dt).status, jml::Status::ok);
  const auto report = of.solve();
  EXPECT_TRUE(usable(report.status));
  return {of.x(0), of.x(steps), report.cost};
}

TEST(TwoPointBatch, TendsToIt) {
  jml::TwoPoint smoother{oscillator, models::SaturatingSignal{density}, prior, {.steps = 120}};
  for (int k = 0; k < 120; ++k) ASSERT_EQ(smoother.step(y, duration / 120), jml::Status::ok);
  const auto exact = smoother.solve();
  ASSERT_EQ(exact.status, jml::Status::ok);
  for (const bool both_ends : {false, true}) {
    const Answer coarse = batch(75, both_ends), fine = batch(150, both_ends);
    const auto expect_slope = [&](double a, double b, const char* what) {
      const double slope = std::log2(std::abs(a / b));
      EXPECT_NEAR(slope, both_ends ? 2 : 1, 0.1) << what << ' ' << a << ' ' << b;
    };
    expect_slope(coarse.first(0) - smoother.x(0)(0), fine.first(0) - smoother.x(0)(0), "x(0)");
    expect_slope(coarse.last(0) - smoother.x()(0), fine.last(0) - smoother.x()(0), "x(T)");
    expect_slope(coarse.last(1) - smoother.x()(1), fine.last(1) - smoother.x()(1), "x'(T)");
    expect_slope(coarse.cost - exact.cost, fine.cost - exact.cost, "J");
  }
}

// Six states, three measurements: the ends of (12), and two ways to it that share no linear algebra.
TEST(TwoPointBatch, SixStates) {
  using Six = jml::Vector<double, 6>;
  Six start;
  start << 1, 0.5, -0.5, 0, 0, 0;
  jml::TwoPoint smoother{
      models::OscillatorChain{},
      models::SaturatingSignals{1e-3},
      jml::Estimate<double, 6>{start, jml::Matrix<double, 6, 6>(0.1 * jml::Matrix<double, 6, 6>::Identity())},
      {.steps = 60}};
  const auto signal = [](double t) {
    return jml::Vector<double, 3>(0.6 * std::cos(t), 0.4 * std::sin(1.3 * t) + 0.3, -0.4 * std::cos(0.7 * t));
  };
  for (int k = 0; k < 60; ++k) ASSERT_EQ(smoother.step(signal, 0.05), jml::Status::ok);
  const auto report = smoother.solve();
  ASSERT_EQ(report.status, jml::Status::ok);
  const Six first = smoother.x(0), last = smoother.x(), costate = smoother.costate(0);
  EXPECT_LT((first - start - 0.1 * costate).norm(), 1e-10);
  EXPECT_EQ(smoother.costate(60).norm(), 0);
  const auto swept = jml::sweep(smoother, jml::Rnls{});
  ASSERT_EQ(swept.status, jml::Status::ok);
  EXPECT_NEAR(swept.cost, report.cost, 1e-9);
  EXPECT_LT((smoother.x(0) - first).norm(), 1e-8);
  EXPECT_LT((smoother.x() - last).norm(), 1e-8);
  EXPECT_LT((smoother.costate(0) - costate).norm(), 1e-6);
}

}  // namespace
