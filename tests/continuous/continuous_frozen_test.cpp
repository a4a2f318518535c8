// SPDX-License-Identifier: BSD-3-Clause
// Davison-Maki on coefficients that stand still, where it must be exact in one step of any length, and every
// fixed-step integrator on random nonsymmetric Riccati equations, harmless and escaping.
#include "continuous/continuous_frozen.hpp"

#include <gtest/gtest.h>

#include <jml/continuous/continuous.hpp>
#include <jml/riccati/davison_maki.hpp>

namespace {

using jml::DavisonMaki;
using jml::Status;
using namespace continuous_frozen;

template <int n, int p, typename Integrator>
auto run(const Problem<n, p>& problem, double dt, const Integrator& integrator) {
  jml::Filter filter{jml::Continuous{jml::Rnls{}, integrator}, problem.dynamics, problem.start};
  const jml::Line line{problem.y, jml::Vector<double, p>(problem.y + dt * problem.climb)};
  const Status status = problem.climb.norm() > 0 ? filter.step(problem.sensor, line, dt).status
                                                 : filter.step(problem.sensor, problem.y, dt).status;
  return std::pair{status, filter.estimate()};
}

template <int n, int p>
void exact(double twist, double dt, int count, double climb = 0) {
  jml::Noise noise(17);
  for (int k = 0; k < count; ++k) {
    auto problem = random_problem<n, p>(noise, twist);
    for (int i = 0; i < p; ++i) problem.climb(i) = climb * (1 + i);
    const auto wanted = solve(problem, dt);
    if (wanted.escaped || wanted.largest > 100) continue;
    const auto [status, got] = run(problem, dt, DavisonMaki{});
    EXPECT_EQ(status, Status::ok) << k << ": " << jml::describe(status);
    EXPECT_LT(distance(got, wanted), 1e-12) << k;  // measured: 8e-14
  }
}

TEST(DavisonMaki, ExactWithinOneExponential) {  // ‖H‖ dt ≤ 1
  exact<2, 1>(0, 0.05, 50);
  exact<2, 1>(0.5, 0.05, 50);
  exact<2, 2>(0.5, 0.05, 50);
  exact<3, 2>(0.5, 0.05, 30);
}
TEST(DavisonMaki, ExactOverManyPieces) {
  exact<2, 1>(0.2, 3, 30);
  exact<2, 2>(0.2, 2, 30);
  exact<3, 2>(0.2, 1, 20);
}

// A measurement that moves in a straight line is as exact as one that stands, in one piece and over many.
TEST(DavisonMaki, ExactAlongALine) {
  exact<2, 1>(0.5, 0.05, 50, 30);
  exact<2, 2>(0.5, 0.05, 50, -20);
  exact<2, 1>(0.2, 3, 30, 2);
  exact<3, 2>(0.2, 1, 20, -3);
}

// One step of 1 s against 64 of 1/64 s is the same, whatever the number of pieces in it.
TEST(DavisonMaki, SubstepsChangeNothing) {
  jml::Noise noise(3);
  for (int k = 0; k < 50; ++k) {
    const auto problem = random_problem<3, 2>(noise, 0.2);
    const auto [status, one] = run(problem, 1.0, DavisonMaki{1});
    const auto [other, many] = run(problem, 1.0, DavisonMaki{64});
    ASSERT_EQ(status, Status::ok);
    ASSERT_EQ(other, Status::ok);
    EXPECT_LT((one.x - many.x).norm(), 1e-12 * std::max(1.0, many.x.norm()));
    EXPECT_LT((one.P - many.P).norm(), 1e-12 * many.P.norm());
  }
}

// Ṗ = -P + q + P²/R: the quadratic term feeds P, so no piece is sure by its sign, and X grows by e over each:
// all are cut. Closed form by partial fractions, with the roots a < b of P² - R P + q R = 0, both positive.
TEST(DavisonMaki, PiecesThatAreCutOneAfterTheOther) {
  Problem<1, 1> problem;
  problem.dynamics.A.setConstant(0);
  problem.dynamics.B.setConstant(-1);
  problem.dynamics.Q.setConstant(0.1);
  problem.dynamics.a.setConstant(0);
  problem.sensor.E.setConstant(1);
  problem.sensor.D.setConstant(-1);
  problem.sensor.R.setConstant(100);
  problem.sensor.e.setConstant(0);
  problem.start.P.setConstant(0.5);
  problem.y.setConstant(0);
  const double b = (100 + std::sqrt(1e4 - 40)) / 2, a = 10 / b;
  for (const double dt : {0.5, 1.0, 2.0, 3.0, 5.0, 10.0}) {
    const double ratio = (0.5 - a) / (0.5 - b) * std::exp((a - b) * dt / 100);
    const double wanted = (a - b * ratio) / (1 - ratio);
    const auto [status, got] = run(problem, dt, DavisonMaki{});
    EXPECT_EQ(status, Status::ok);
    EXPECT_NEAR(got.P(0, 0), wanted, 1e-12) << dt;
  }
}

// The same with a y that moves: a piece that is cut is driven by the y of its own time.
TEST(DavisonMaki, PiecesThatAreCutAlongALine) {
  Problem<1, 1> problem;
  problem.dynamics.A.setConstant(0);
  problem.dynamics.B.setConstant(-1);
  problem.dynamics.Q.setConstant(0.1);
  problem.dynamics.a.setConstant(0.2);
  problem.sensor.E.setConstant(1);
  problem.sensor.D.setConstant(-1);
  problem.sensor.R.setConstant(100);
  problem.sensor.e.setConstant(0);
  problem.start.x.setConstant(1);
  problem.start.P.setConstant(0.5);
  problem.y.setConstant(3);
  problem.climb.setConstant(20);
  for (const double dt : {0.5, 2.0, 3.0, 5.0, 10.0}) {
    const auto [status, got] = run(problem, dt, DavisonMaki{});
    EXPECT_EQ(status, Status::ok);
    EXPECT_LT(distance(got, solve(problem, dt)), 1e-12) << dt;
  }
}

// x with a bias of the sensor and a drift, n = 1: P at its equilibrium, so the gain is constant and
// x(t) = c + (x(0) - c) e^{-(K - A) t}, c = (a + K (y - e)) / (K - A).
TEST(DavisonMaki, EstimateWithConstantGain) {
  Problem<1, 1> problem;
  problem.dynamics.A.setConstant(-0.5);
  problem.dynamics.B.setConstant(-0.5);
  problem.dynamics.Q.setConstant(2);
  problem.dynamics.a.setConstant(0.7);
  problem.sensor.E.setConstant(1);
  problem.sensor.D.setConstant(1);
  problem.sensor.R.setConstant(0.25);
  problem.sensor.e.setConstant(0.3);
  const double P = 0.25 * (-0.5 + std::sqrt(0.25 + 2 / 0.25)), K = P / 0.25;
  problem.start.P.setConstant(P);
  problem.start.x.setConstant(2);
  problem.y.setConstant(-1);
  const double c = (0.7 + K * -1.3) / (K + 0.5);
  for (const double dt : {1e-3, 0.1, 1.0, 10.0}) {
    const auto [status, got] = run(problem, dt, DavisonMaki{});
    EXPECT_EQ(status, Status::ok);
    EXPECT_NEAR(got.x(0), c + (2 - c) * std::exp(-(K + 0.5) * dt), 1e-13);
    EXPECT_NEAR(got.P(0, 0), P, 1e-13);
  }
}

/// Which of `count` random problems are refused, against the oracle. An escape may be named early ("faster
/// than this step can follow") where P grows a hundredfold, never where it stays moderate; and is never
/// missed.
template <int n, int p, typename Integrator>
void judge(const Integrator& integrator, double twist, double dt, int count, int least_escapes) {
  jml::Noise noise(29);
  int escapes = 0, harmless = 0;
  for (int k = 0; k < count; ++k) {
    const auto problem = random_problem<n, p>(noise, twist);
    const auto wanted = solve(problem, dt);
    const auto [status, got] = run(problem, dt, integrator);
    if (wanted.escaped) {
      ++escapes;
      EXPECT_EQ(status, Status::riccati_escape) << k << ": " << jml::describe(status);
    } else if (wanted.largest < 30) {
      ++harmless;
      EXPECT_EQ(status, Status::ok) << k << ": " << jml::describe(status);
      EXPECT_LT(distance(got, wanted), 1e-6) << k;
    }
    if (status != Status::ok) {
      EXPECT_EQ(got.x, problem.start.x);
      EXPECT_EQ(got.P, problem.start.P);
    }
  }
  EXPECT_GE(escapes, least_escapes);
  EXPECT_GE(harmless, count / 2);
}

TEST(RandomEscapes, HarmlessOnesRaiseNoAlarm) {
  judge<2, 1>(DavisonMaki{}, 0.3, 0.5, 500, 0);
  judge<2, 2>(DavisonMaki{}, 0.3, 0.5, 300, 0);
  judge<3, 2>(DavisonMaki{}, 0.3, 0.5, 200, 0);
  judge<2, 1>(jml::RungeKutta4{200}, 0.3, 0.5, 500, 0);
  judge<2, 2>(jml::RungeKutta4{200}, 0.3, 0.5, 300, 0);
  judge<3, 2>(jml::RungeKutta4{200}, 0.3, 0.5, 200, 0);
}
TEST(RandomEscapes, EscapesAreNotMissed) {
  judge<2, 1>(DavisonMaki{}, 2, 2, 100, 15);
  judge<2, 2>(DavisonMaki{}, 2, 1, 100, 10);
  judge<2, 1>(DavisonMaki{16}, 2, 2, 100, 15);
}

// Ṗ = -2 P + P² falls from 1 as 2/(1 + e^{2t}); of its quadratic term alone the pole is 1 s ahead, and a
// fixed step of more than half of that is not taken.
template <int n>
void expect_pole_ahead() {
  Problem<n, n> problem;
  problem.dynamics.A = problem.dynamics.B = -jml::Matrix<double, n, n>::Identity();
  problem.dynamics.Q.setZero();
  problem.dynamics.a.setZero();
  problem.sensor.E.setIdentity();
  problem.sensor.D = -jml::Matrix<double, n, n>::Identity();
  problem.sensor.R.setIdentity();
  problem.sensor.e.setZero();
  problem.start.x.setZero();
  problem.start.P.setIdentity();
  problem.y.setZero();
  EXPECT_EQ(run(problem, 0.6, jml::RungeKutta4{}).first, Status::riccati_escape);
  const auto [status, got] = run(problem, 0.6, jml::RungeKutta4{20});
  EXPECT_EQ(status, Status::ok);
  for (int i = 0; i < n; ++i) EXPECT_NEAR(got.P(i, i), 2 / (1 + std::exp(1.2)), 1e-7);
}
TEST(RungeKutta4, TakesNoStepTowardsAPoleOfTheQuadraticTerm) {
  expect_pole_ahead<1>();
  expect_pole_ahead<2>();
}

}  // namespace
