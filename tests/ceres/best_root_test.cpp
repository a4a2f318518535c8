// SPDX-License-Identifier: BSD-3-Clause
// Is the root that the filter chose the best one? Ceres minimises (11) from five starts; for symmetric P the filter's
// one-step cost must be the lowest of them in 99 of 100 steps.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdio>
#include <jml/solve/ceres.hpp>

#include "figure.hpp"
#include "filter/random_steps.hpp"

namespace {

using namespace jml::operators;

using Eigen::MatrixXd, Eigen::VectorXd;  // of a size known at run time: compiled once for all models

/// (11) in whitened unknowns, written for this test: P = L Lᵀ, Q and R by Cholesky.
template <typename Task>
struct Whitened {
  static constexpr int n = Task::n, p = Task::p, q = jml::DynamicsTraits<decltype(Task::dynamics)>::disturbances;
  static constexpr int size = n + q, residuals = n + q + p;
  const Task& task;
  MatrixXd L, G, V;  // G: of the whitened disturbance, G W with Q = W Wᵀ

  static MatrixXd root(const MatrixXd& a) { return a.llt().matrixL(); }
  explicit Whitened(const Task& t)
      : task(t),
        L(root(t.prior.P)),
        G(MatrixXd(t.dynamics.disturbance_input()) * root(t.dynamics.disturbance_covariance())),
        V(root(t.sensor.noise_covariance())) {}

  jml::Vector<double, n> smoothed(const VectorXd& u) const { return task.prior.x + jml::Vector<double, n>(L * u.head(n)); }
  jml::Vector<double, n> next(const VectorXd& u) const {
    return jml::Vector<double, n>(task.dynamics.dynamics(smoothed(u))) + jml::Vector<double, n>(G * u.tail(q));
  }
  bool evaluate(const jml::Vector<double, size>& given, jml::Vector<double, residuals>& r, jml::Matrix<double, residuals, size>* J) const {
    const VectorXd u = given;
    const jml::Vector<double, n> x_1 = next(u);
    const VectorXd misfit = jml::measurement_residual(task.sensor, task.y, jml::Vector<double, p>(task.sensor.measurement(x_1)));
    VectorXd all(residuals);
    all << u, V.triangularView<Eigen::Lower>().solve(misfit);
    r = all;
    if (J != nullptr) {
      MatrixXd step(n, size), slopes = MatrixXd::Identity(residuals, size);
      step << MatrixXd(task.dynamics.dynamics_jacobian(smoothed(u))) * L, G;
      slopes.bottomRows(p) = -V.triangularView<Eigen::Lower>().solve(MatrixXd(task.sensor.measurement_jacobian(x_1)) * step);
      *J = slopes;
    }
    return jml::all_finite(r);
  }
};

template <typename Task>
void compare(const char* name, std::uint64_t seed, int steps, double share) {
  jml::Noise noise(seed);
  int best = 0, judged = 0, same_cost = 0, other_state = 0;
  for (int k = 0; k < steps; ++k) {
    Task task;
    random_steps::draw(task, noise, k % 2 == 1, true);
    const auto result = jml::step(jml::IteratedJml{}, task.dynamics, task.sensor, task.prior, task.y);
    if (!jml::usable(result.report.status)) continue;
    ++judged;
    using W = Whitened<Task>;
    const W whitened(task);
    double lowest = std::numeric_limits<double>::infinity();
    jml::Vector<double, Task::n> lowest_x = jml::Vector<double, Task::n>::Zero();
    for (int start = 0; start < 5; ++start) {
      jml::Vector<double, W::size> u = jml::Vector<double, W::size>::Zero();
      if (start > 0) u = noise.normal_vector<W::size>();
      if (!jml::Ceres{}.minimize(whitened, u).converged) continue;
      jml::Vector<double, W::residuals> r;
      if (!whitened.evaluate(u, r, nullptr)) continue;
      if (r.squaredNorm() / 2 < lowest) {
        lowest = r.squaredNorm() / 2;
        lowest_x = whitened.next(u);
      }
    }
    const double cost = random_steps::judge(task, result.report.smoothed, result.estimate.x).cost;
    EXPECT_NEAR(cost, result.report.cost, 1e-7 * (1 + cost));
    if (cost <= lowest * (1 + 1e-10) + 1e-13) ++best;
    else std::printf("  %s step %d: cost %.12g, Ceres %.12g\n", name, k, cost, lowest);
    if (std::abs(cost - lowest) <= 1e-10 * lowest + 1e-13) {
      ++same_cost;
      // The largest error in units of the prior's standard deviation or of the state, whichever is larger.
      const jml::Vector<double, Task::n> unit = task.prior.P.diagonal().cwiseSqrt() + result.estimate.x.cwiseAbs();
      other_state += (result.estimate.x - lowest_x).cwiseQuotient(unit).cwiseAbs().maxCoeff() > 1e-7;
    }
  }
  std::printf("%-12s %d steps: lowest cost of 5 starts reached in %d (%.2f %%); states differ at equal cost in %d\n", name, judged, best,
              100.0 * best / judged, other_state);
  figure::print(std::string(name) + "/best", 100.0 * best / judged, "%");
  EXPECT_GE(best, share * judged);
  EXPECT_EQ(other_state, 0);
}

TEST(BestRoot, VanDerPol) { compare<random_steps::VanDerPol>("van_der_pol", 11, 1500, 0.99); }
TEST(BestRoot, Pendulum) { compare<random_steps::Pendulum>("pendulum", 12, 1500, 0.99); }
TEST(BestRoot, Radar) { compare<random_steps::Radar>("radar", 13, 1000, 0.99); }
TEST(BestRoot, Polynomial) { compare<random_steps::Polynomial>("polynomial", 14, 1500, 0.99); }

}  // namespace
