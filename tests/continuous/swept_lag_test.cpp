// SPDX-License-Identifier: BSD-3-Clause
// The swept filter with a fixed lag: over all of a flight it is the continuous smoother, over a second of it
// nearer to that than the filters (17)-(19) are; what it refuses leaves it as it was.
#include <gtest/gtest.h>

#include <jml/continuous/continuous.hpp>
#include <jml/continuous/swept_lag.hpp>

#include "continuous/two_point_flight.hpp"
#include "figure.hpp"
#include "heap_trap.hpp"
#include "models/escaping.hpp"

namespace {

using namespace jml::operators;
using namespace two_point_flight;

using jml::Status;
using Lag = jml::SweptLag<jml::Rnls<>, models::Oscillator, models::SaturatingSignal>;

Lag lag_of(int lag, int sweeps, const Case& of = gentle()) {
  return {jml::Rnls{}, of.oscillator, of.sensor, of.start, {.lag = lag, .sweeps = sweeps}};
}

constexpr double dt = 0.03;

TEST(SweptLag, OverTheWholeFlightIsExact) {
  const auto y = flight(60, dt, 1, gentle());
  Smoother smoother = smoother_of(y, dt, gentle());
  ASSERT_EQ(smoother.solve().status, Status::ok);
  Lag whole = lag_of(60, 30);
  jml::SweptLagReport<double> report;
  for (std::size_t k = 0; k < 60; ++k) {
    report = whole.step(jml::Line{y[k], y[k + 1]}, dt);
    ASSERT_EQ(report.status, Status::ok);
  }
  EXPECT_LT(report.step, 1e-9);
  EXPECT_EQ(whole.steps(), 60);
  EXPECT_NEAR(whole.time(), 1.8, 1e-12);
  for (int k = 0; k <= 60; ++k) ASSERT_LT((whole.x(60 - k) - smoother.x(k)).norm(), 1e-8) << k;
}

TEST(SweptLag, ASecondIsNearTheOptimum) {
  double lagged = 0, filtered = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Case of = gentle();
    const auto y = flight(120, dt, seed, of);
    Smoother smoother = smoother_of(y, dt, of);
    ASSERT_EQ(smoother.solve().status, Status::ok);
    Lag lag = lag_of(50, 4);
    jml::Filter rnls{jml::Continuous{jml::Rnls{}}, of.oscillator, of.start};
    for (std::size_t k = 0; k < 120; ++k) {
      ASSERT_EQ(lag.step(jml::Line{y[k], y[k + 1]}, dt).status, Status::ok);
      ASSERT_EQ(rnls.step(of.sensor, jml::Line{y[k], y[k + 1]}, dt).status, Status::ok);
    }
    EXPECT_EQ(lag.steps(), 50);
    EXPECT_NEAR(lag.time(), 3.6, 1e-9);
    lagged += (lag.x() - smoother.x()).norm();
    filtered += (rnls.x() - smoother.x()).norm();
  }
  figure::print("lag_to_filter", lagged / filtered);
  EXPECT_LT(lagged, filtered / 5) << lagged << ' ' << filtered;
}

// Linear: any window is the Kalman-Bucy filter, which the window slides along by (19).
struct Line2 {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1), -x(0)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(0.5); }
};
struct Position {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(0.01); }
};
TEST(SweptLag, LinearIsTheFilter) {
  const jml::Estimate<double, 2> start{X(0.3, 1), Square{{0.5, 0.1}, {0.1, 0.4}}};
  jml::SweptLag lag{jml::Rnls{}, Line2{}, Position{}, start, {.lag = 3, .sweeps = 1}};
  jml::Filter filter{jml::Continuous{jml::Kalman{}, jml::RungeKutta4{100}}, Line2{}, start};
  const auto y = [](double t) { return std::sin(1.3 * t) + 0.1 * std::cos(5 * t); };
  for (int k = 0; k < 40; ++k) {
    if (k % 7 == 3) {
      ASSERT_EQ(lag.predict(0.05).status, Status::ok);
      ASSERT_EQ(filter.predict(0.05), Status::ok);
    } else {
      ASSERT_EQ(lag.step(y, 0.05).status, Status::ok);
      ASSERT_EQ(filter.step(Position{}, y, 0.05).status, Status::ok);
    }
    EXPECT_LT((lag.x() - filter.x()).norm(), 1e-8) << k;
    EXPECT_LT((lag.P() - filter.P()).norm(), 1e-8) << k;
  }
}

// At rest P' = 2 P + 1 + P² from ½: P = 1 / (2/3 - t) - 1. Of two copies det X changes no sign at the pole.
template <int n>
void expect_escape() {
  using Vector = jml::Vector<double, n>;
  using Matrix = jml::Matrix<double, n, n>;
  const Vector one = Vector::Ones();
  jml::TwoPoint smoother{models::EscapingCopies<n>{},
                         models::EscapingCopiesSensor<n>{},
                         jml::Estimate<double, n>{one, Matrix(0.5 * Matrix::Identity())},
                         {.steps = 100}};
  for (int k = 0; k < 60; ++k) ASSERT_EQ(smoother.step(one, 0.01), Status::ok);
  smoother.start = jml::Start::prediction;
  auto report = jml::sweep(smoother, jml::Rnls{});
  ASSERT_EQ(report.status, Status::ok);
  EXPECT_NEAR(report.P(n - 1, n - 1), 14, 1e-7);
  EXPECT_NEAR(smoother.x()(0), 1, 1e-12);
  for (int k = 0; k < 20; ++k) ASSERT_EQ(smoother.step(one, 0.01), Status::ok);
  EXPECT_EQ(jml::sweep(smoother, jml::Rnls{}).status, Status::riccati_escape);
}
TEST(SweptLag, NamesAnEscape) {
  expect_escape<1>();
  expect_escape<2>();
}
TEST(SweptLag, NamesAnEscapeInsideOneStep) {  // from ½ through the pole to -8.5
  const jml::Vector<double, 1> one(1);
  jml::TwoPoint smoother{models::EscapingCopies<1>{},
                         models::EscapingCopiesSensor<1>{},
                         jml::Estimate<double, 1>{one, jml::Matrix<double, 1, 1>(0.5)},
                         {.steps = 1}};
  ASSERT_EQ(smoother.step(one, 0.8), Status::ok);
  smoother.start = jml::Start::prediction;
  EXPECT_EQ(jml::sweep(smoother, jml::Rnls{}).status, Status::riccati_escape);
}

TEST(SweptLag, ARefusalLeavesItAsItWas) {
  Lag lag = lag_of(4, 2), other = lag_of(4, 2);
  const auto y = flight(12, dt, 2, gentle());
  for (std::size_t k = 0; k < 12; ++k) {
    EXPECT_EQ(lag.step(std::nan(""), dt).status, Status::invalid_measurement);
    EXPECT_EQ(lag.step(0.5, -dt).status, Status::invalid_time_step);
    EXPECT_FALSE(usable(lag.step(1e200, dt).status));
    EXPECT_EQ(lag.step(jml::Line{y[k], y[k + 1]}, dt).status, Status::ok);
    EXPECT_EQ(other.step(jml::Line{y[k], y[k + 1]}, dt).status, Status::ok);
    ASSERT_EQ(lag.x(), other.x()) << k;
    ASSERT_EQ(lag.P(), other.P()) << k;
  }
  EXPECT_EQ(lag_of(0, 2).status(), Status::invalid_option);
  EXPECT_EQ(lag_of(4, 0).step(0.5, dt).status, Status::invalid_option);
}

TEST(SweptLag, TouchesTheHeapInItsConstructorOnly) {
  Lag lag = lag_of(4, 2);
  int good = 0;
  {
    heap_trap::Armed trap;
    for (int k = 0; k < 10; ++k) good += lag.step(0.8, dt).status == Status::ok;
    good += lag.step(1e200, dt).status == Status::ok;
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  EXPECT_EQ(good, 10);
}

}  // namespace
