// SPDX-License-Identifier: BSD-3-Clause
// The continuous smoother on the chapter's oscillator: it solves (12) and leaves no lower J; the swept RNLS
// filter ends at the same trajectory.
#include <gtest/gtest.h>

#include "continuous/two_point_flight.hpp"
#include "heap_trap.hpp"

namespace {

using namespace jml::operators;
using namespace two_point_flight;

using jml::Status;

// J of (8) along the flow of (12) from every node: ½ λ(0)ᵀ P_0 λ(0) + ∫ ½ (w² / Q + (y - m)² / R), Simpson's
// rule on pieces of the Runge-Kutta flow.
double criterion(const Smoother& smoother, const std::vector<double>& y, double dt) {
  constexpr int pieces = 16;
  double J = 0.0005 * jml::kernel::squared_norm(smoother.costate(0));
  for (int k = 0; k < smoother.steps(); ++k) {
    const double y0 = y[std::size_t(k)], change = y[std::size_t(k) + 1] - y0;
    const auto rate = [&](const Z& z, double share) {
      const double e = y0 + share * change - output(z[0]);
      return (z[3] * z[3] + e * e / 1e-5) / 2;
    };
    Z z{smoother.x(k)(0), smoother.x(k)(1), smoother.costate(k)(0), smoother.costate(k)(1)};
    for (int i = 0; i < pieces; ++i) {
      const double from = i / double(pieces), half = 0.5 / pieces;
      const Z middle = two_point_flow(z, y0 + from * change, y0 + (from + half) * change, half * dt, 2);
      const Z end =
          two_point_flow(middle, y0 + (from + half) * change, y0 + (from + 2 * half) * change, half * dt, 2);
      J += dt / pieces / 6 * (rate(z, from) + 4 * rate(middle, from + half) + rate(end, from + 2 * half));
      z = end;
    }
  }
  return J;
}

TEST(TwoPoint, SolvesEquation12) {
  for (const auto& [steps, dt, seed] : {std::tuple{2000, 1e-3, 1}, {2000, 1e-3, 0}, {400, 5e-3, 2}}) {
    const auto y = flight(steps, dt, std::uint64_t(seed));
    Smoother smoother = smoother_of(y, dt);
    const auto report = smoother.solve();
    ASSERT_EQ(report.status, Status::ok);
    EXPECT_LT(report.gradient, 1e-10 * std::sqrt(3.0 * steps + 2));  // the tolerance, over all unknowns
    EXPECT_LT(residual(smoother, y, dt, 64), 1e-9) << dt;
    EXPECT_NEAR(criterion(smoother, y, dt), report.cost, 1e-9 * report.cost) << dt;
    EXPECT_NEAR(smoother.time(), steps * dt, 1e-9);
    EXPECT_NEAR(smoother.w(3)(0), smoother.costate(3)(1), 1e-15 * std::abs(smoother.costate(3)(1)));
  }
}

// y(t) a function of time: what is left of an answer to dt/2 falls by 2⁶.
TEST(TwoPoint, OrderSix) {
  const auto y = [](double t) { return 0.8 * std::cos(0.9 * t) + 0.05 * std::sin(3 * t); };
  const auto solved = [&](int steps) {
    Smoother smoother{
        models::Oscillator{1, 0.1, 1, 1}, models::SaturatingSignal{1e-2}, chapters_start(), {.steps = steps}};
    for (int k = 0; k < steps; ++k) EXPECT_EQ(smoother.step(y, 3.0 / steps), Status::ok);
    const auto report = smoother.solve();
    EXPECT_EQ(report.status, Status::ok);
    return std::array{smoother.x(0)(0), smoother.x()(0), smoother.x()(1), smoother.costate(0)(0),
                      report.cost};
  };
  const auto a = solved(16), b = solved(32), c = solved(64);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double ratio = (a[i] - b[i]) / (b[i] - c[i]);
    EXPECT_GT(ratio, 40) << i;
    EXPECT_LT(ratio, 110) << i;
  }
}

// Rows (F, f_x, m_x, M) and (f_x, f_x, m_x, m_x) end where the minimisation does, though their P differ.
TEST(TwoPoint, SweptFiltersEndThere) {
  const auto y = flight(400, 2.5e-3, 3);
  Smoother smoother = smoother_of(y, 2.5e-3);
  const auto least = smoother.solve();
  ASSERT_EQ(least.status, Status::ok);
  const auto expect_there = [&](const auto& rule, double asymmetry) {
    Smoother swept = smoother;
    const auto report = jml::sweep(swept, rule);
    ASSERT_EQ(report.status, Status::ok);
    EXPECT_NEAR(report.cost, least.cost, 1e-8 * least.cost);
    for (int k = 0; k <= swept.steps(); ++k) {
      ASSERT_LT(jml::kernel::norm(swept.x(k) - smoother.x(k)), 5e-9) << k;
      ASSERT_LT(jml::kernel::norm(swept.costate(k) - smoother.costate(k)), 1e-6) << k;
    }
    EXPECT_GE(std::abs(report.P(0, 1) - report.P(1, 0)), asymmetry);
  };
  expect_there(jml::Rnls{}, 1e-7);
  expect_there(jml::Ekf{}, 0);
}

TEST(TwoPoint, SweptFiltersEndThereOnEveryFlight) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Case of = gentle();
    Smoother smoother = smoother_of(flight(100, 0.03, seed, of), 0.03, of);
    ASSERT_EQ(smoother.solve().status, Status::ok) << seed;
    const auto expect_there = [&](const auto& rule) {
      Smoother swept = smoother;
      ASSERT_EQ(jml::sweep(swept, rule).status, Status::ok) << seed;
      EXPECT_LT(distance(swept, smoother), 1e-8) << seed;
    };
    expect_there(jml::Rnls{});
    expect_there(jml::Ekf{});
  }
}

TEST(TwoPoint, SweepsBegunAtTheAnswerStay) {
  const auto y = flight(200, 5e-3, 4);
  Smoother smoother = smoother_of(y, 5e-3);
  ASSERT_EQ(smoother.solve().status, Status::ok);
  const X end = smoother.x();
  smoother.start = jml::Start::given;
  const auto report = jml::sweep(smoother, jml::Ekf{}, {.max_sweeps = 1});
  EXPECT_EQ(report.status, Status::not_converged);
  EXPECT_LT(jml::kernel::norm(smoother.x() - end), 1e-3);  // the stages began on straight lines
}

// The excess of a state beside the optimum is ½ δᵀ P⁻¹ δ to first order, and none at it.
TEST(TwoPoint, ExcessIsOfTheContinuousCriterion) {
  const auto y = flight(200, 5e-3, 5);
  Smoother smoother = smoother_of(y, 5e-3);
  ASSERT_EQ(smoother.solve().status, Status::ok);
  const Square P = smoother.P(200);
  const X off(0.02 * std::sqrt(P(0, 0)), 0);
  const auto at = jml::excess_cost(smoother, smoother.x()),
             beside = jml::excess_cost(smoother, X(smoother.x() + off));
  ASSERT_EQ(at.status, Status::ok);
  ASSERT_EQ(beside.status, Status::ok);
  EXPECT_NEAR(at.value, 0, 1e-9);
  const double determinant = P(0, 0) * P(1, 1) - P(0, 1) * P(1, 0);
  const double expected = off(0) * off(0) * P(1, 1) / determinant / 2;
  EXPECT_NEAR(beside.value, expected, 0.15 * expected);
}

// x' = w, y = x² + v: x = 0 is stationary for ever, a saddle; the minima are on both sides.
struct Drift {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x * T(0);
  }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(0.01); }
};
struct Squared {
  static constexpr int measurements = 1;
  double r = 0.1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x * x(0);
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(r); }
};
template <typename Scalar>
void expect_to_leave() {
  using Here = jml::Vector<Scalar, 1>;
  jml::TwoPoint smoother{Drift{}, Squared{}, jml::Estimate<Scalar, 1>{Here(0), Here(1)}, {.steps = 20}};
  for (int k = 0; k < 20; ++k) ASSERT_EQ(smoother.step(Scalar(1), Scalar(0.1)), Status::ok);
  const auto report = smoother.solve();
  ASSERT_TRUE(usable(report.status));
  EXPECT_GT(std::abs(smoother.x()(0)), 0.9);
  EXPECT_LT(report.cost, 1);  // x = 0: ½ · 2 s · 1 / 0.1 = 10
  const Here end = smoother.x();
  smoother.start = jml::Start::given;
  ASSERT_EQ(jml::sweep(smoother, jml::Ekf{}).status, Status::ok);
  EXPECT_NEAR(smoother.x()(0), end(0), 1e-3);
}
TEST(TwoPoint, LeavesASaddle) { expect_to_leave<double>(); }
TEST(TwoPoint, LeavesASaddleInFloat) { expect_to_leave<float>(); }

TEST(TwoPoint, RefusesByName) {
  const auto status = [](const models::Oscillator& oscillator, double r,
                         const jml::Estimate<double, 2>& prior, int steps, double time) {
    return Smoother{oscillator, models::SaturatingSignal{r}, prior, {.steps = steps}, time}.solve().status;
  };
  const double nan = std::nan("");
  EXPECT_EQ(status({}, 1e-5, chapters_start(), 3, nan), Status::invalid_time_step);
  EXPECT_EQ(status({}, 1e-5, chapters_start(), -1, 0), Status::invalid_option);
  EXPECT_EQ(status({}, 0, chapters_start(), 3, 0), Status::invalid_noise_covariance);
  EXPECT_EQ(status({1, 0.01, 0.1, -1}, 1e-5, chapters_start(), 3, 0), Status::invalid_disturbance_covariance);
  EXPECT_EQ(status({}, 1e-5, {{nan, 0}, Square::Identity()}, 3, 0), Status::invalid_state);
  EXPECT_EQ(status({}, 1e-5, {{0, 0}, -Square::Identity()}, 3, 0), Status::invalid_covariance);
  Smoother smoother{models::Oscillator{}, models::SaturatingSignal{}, chapters_start(), {.steps = 2}};
  EXPECT_EQ(smoother.step(0.5, 0), Status::invalid_time_step);
  EXPECT_EQ(smoother.step(nan, 0.1), Status::invalid_measurement);
  EXPECT_EQ(smoother.step([&](double) { return nan; }, 0.1), Status::invalid_measurement);
  EXPECT_EQ(smoother.steps(), 0);
  EXPECT_EQ(smoother.step(0.5, 0.1), Status::ok);
  EXPECT_EQ(smoother.predict(0.1), Status::ok);
  EXPECT_EQ(smoother.predict(0.1), Status::memory_full);
  smoother.options.loss = jml::Loss::huber(1);
  EXPECT_EQ(smoother.solve().status, Status::invalid_option);
  smoother.options.loss = {};
  EXPECT_EQ(smoother.solve().status, Status::ok);
  EXPECT_EQ(jml::sweep(smoother, jml::Rnls{}, {.max_sweeps = 0}).status, Status::invalid_option);
}

TEST(TwoPoint, TouchesTheHeapInItsConstructorOnly) {
  const auto y = flight(50, 5e-3, 6);
  Smoother smoother{models::Oscillator{}, models::SaturatingSignal{}, chapters_start(), {.steps = 50}};
  Status solved, swept;
  bool finite;
  {
    heap_trap::Armed trap;
    for (std::size_t k = 0; k < 50; ++k) (void)smoother.step(jml::Line{y[k], y[k + 1]}, 5e-3);
    solved = smoother.solve().status;
    finite = jml::all_finite(smoother.P(50));
    swept = jml::sweep(smoother, jml::Rnls{}).status;
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  EXPECT_EQ(solved, Status::ok);
  EXPECT_EQ(swept, Status::ok);
  EXPECT_TRUE(finite);
}

}  // namespace
