// SPDX-License-Identifier: BSD-3-Clause
// On linear systems every rule is the Kalman-Bucy filter; its P tends to the solution of the algebraic
// equation.
#include <gtest/gtest.h>

#include <jml/continuous/continuous.hpp>
#include <jml/riccati/davison_maki.hpp>

#include "continuous/continuous_frozen.hpp"

namespace {

using namespace jml::operators;

using jml::DavisonMaki;
using jml::RungeKutta4;
using jml::Status;

/// ẋ = A x + G w; no derivative is given.
template <int n, int q>
struct Plant {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = n, disturbances = q;
  static constexpr bool linear = true;
  jml::Matrix<double, n, n> A;
  jml::Matrix<double, n, q> G;
  jml::Matrix<double, q, q> Q;
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    return A.template cast<T>() * x;
  }
  jml::Matrix<double, n, q> disturbance_input() const { return G; }
  jml::Matrix<double, q, q> disturbance_spectral_density() const { return Q; }
};
template <int n, int p>
struct Signal {
  static constexpr int measurements = p;
  static constexpr bool linear = true;
  jml::Matrix<double, p, n> M;
  jml::Matrix<double, p, p> R;
  template <typename T>
  jml::Vector<T, p> measurement(const jml::Vector<T, n>& x) const {
    return M.template cast<T>() * x;
  }
  jml::Matrix<double, p, p> noise_spectral_density() const { return R; }
};

/// Calls check(rule, integrator) for every rule, with both integrators.
template <typename Check>
void every_rule(int substeps, const Check& check) {
  check(jml::Kalman{}, RungeKutta4{substeps});
  check(jml::Ekf{}, RungeKutta4{substeps});
  check(jml::Sddre{}, RungeKutta4{substeps});
  check(jml::Rnls{}, RungeKutta4{substeps});
  check(jml::Kalman{}, DavisonMaki{});
  check(jml::Ekf{}, DavisonMaki{});
  check(jml::Sddre{}, DavisonMaki{});
  check(jml::Rnls{}, DavisonMaki{});
}

// ξ'' = w, y = ξ + v: with s = ⁴√(q/r), P = r [√2 s, s²; s², √2 s³] makes the closed loop λ² + √2 s λ + s²
// and solves the algebraic equation.
TEST(ContinuousLinear, DoubleIntegratorSettles) {
  const double q = 3, r = 0.02, s = std::pow(q / r, 0.25);
  Plant<2, 1> plant;
  plant.A << 0, 1, 0, 0;
  plant.G << 0, 1;
  plant.Q << q;
  Signal<2, 1> signal;
  signal.M << 1, 0;
  signal.R << r;
  jml::Matrix<double, 2, 2> wanted;
  wanted << std::sqrt(2) * s, s * s, s * s, std::sqrt(2) * s * s * s;
  wanted *= r;
  every_rule(1000, [&](const auto& rule, const auto& integrator) {
    jml::Filter filter{jml::Continuous{rule, integrator}, plant, jml::Estimate{jml::Vector<double, 2>(1, 2), jml::Matrix<double, 2, 2>::Identity()}};
    for (int i = 0; i < 20; ++i) ASSERT_EQ(filter.step(signal, 0.5, 0.5).status, Status::ok);
    EXPECT_LT((filter.P() - wanted).norm(), 1e-10 * wanted.norm());
    EXPECT_LT((filter.x() - jml::Vector<double, 2>(0.5, 0)).norm(), 1e-10);
  });
}

// P by scipy.linalg.solve_continuous_are(A.T, M.T, G @ Q @ G.T, R), refined in 40 digits by Newton's method.
TEST(ContinuousLinear, ThreeStatesSettle) {
  Plant<3, 2> plant;
  plant.A << 0, 1, 0, -1, -0.2, 0.5, 0.3, 0, -0.7;
  plant.G << 0, 0.2, 1, 0, 0.3, 0.8;
  plant.Q << 0.5, 0.1, 0.1, 0.4;
  Signal<3, 2> signal;
  signal.M << 1, 0, 0.2, 0, 0.5, 1;
  signal.R << 0.04, 0.01, 0.01, 0.09;
  jml::Matrix<double, 3, 3> wanted;
  wanted << 0.0683054318969499429, 0.0623075788180468324, 0.0181762744079882024,  //
      0.0623075788180468324, 0.224839148970283569, 0.0377238010531793294,         //
      0.0181762744079882024, 0.0377238010531793294, 0.110957864170531403;
  const jml::Vector<double, 2> y(0.3, -0.2);
  every_rule(500, [&](const auto& rule, const auto& integrator) {
    jml::Filter filter{jml::Continuous{rule, integrator}, plant, jml::Estimate{jml::Vector<double, 3>(1, 2, 3), jml::Matrix<double, 3, 3>::Identity()}};
    for (int i = 0; i < 40; ++i) ASSERT_EQ(filter.step(signal, y, 0.5).status, Status::ok);
    EXPECT_LT((filter.P() - wanted).norm(), 1e-10 * wanted.norm());
  });
}

// The transient of x and P against the Taylor series of the same equations.
TEST(ContinuousLinear, TransientIsKalmanAndBucys) {
  jml::Noise noise(41);
  for (int k = 0; k < 5; ++k) {
    auto problem = continuous_frozen::random_problem<3, 2>(noise, 0);
    problem.dynamics.a.setZero();
    problem.sensor.e.setZero();
    const Plant<3, 3> plant{problem.dynamics.A, jml::Matrix<double, 3, 3>::Identity(), problem.dynamics.Q};
    const Signal<3, 2> signal{problem.sensor.E, problem.sensor.R};
    const auto wanted = continuous_frozen::solve(problem, 1.5);
    every_rule(5000, [&](const auto& rule, const auto& integrator) {
      jml::Filter filter{jml::Continuous{rule, integrator}, plant, problem.start};
      ASSERT_EQ(filter.step(signal, problem.y, 1.5).status, Status::ok);
      EXPECT_LT(continuous_frozen::distance(filter.estimate(), wanted), 1e-11);
    });
  }
}

// A prediction alone keeps P of a symmetric rule symmetric, to the last bit.
TEST(ContinuousLinear, PredictionIsSymmetricToTheLastBit) {
  jml::Noise noise(42);
  for (int k = 0; k < 20; ++k) {
    const auto problem = continuous_frozen::random_problem<3, 2>(noise, 0);
    const Plant<3, 3> plant{problem.dynamics.A, jml::Matrix<double, 3, 3>::Identity(), problem.dynamics.Q};
    jml::Estimate<double, 3> start = problem.start;
    start.P = (start.P + start.P.transpose()).eval() / 2;
    jml::Filter filter{jml::Continuous{jml::Ekf{}, jml::RungeKutta4{}}, plant, start};
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(filter.predict(0.1), Status::ok);
      const jml::Matrix<double, 3, 3> transposed = filter.P().transpose();
      EXPECT_EQ(filter.P(), transposed);
    }
  }
}

}  // namespace
