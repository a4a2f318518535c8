// SPDX-License-Identifier: BSD-3-Clause
// Every step that the iterated JML filter calls converged is a root of the two ground-truth lines, whatever the SDC.
#include <gtest/gtest.h>

#include <cstdio>

#include "figure.hpp"
#include "filter/random_steps.hpp"

namespace {

using random_steps::judge;

struct Tally {
  int steps = 0, symmetric = 0, ok = 0, at_rounding = 0, refused = 0, refused_symmetric = 0, by_net = 0;
  double worst = 0, worst_at_rounding = 0;
  long iterations = 0;
};

template <typename Task>
Tally run(const char* name, std::uint64_t seed, int steps) {
  jml::Noise noise(seed);
  Tally tally;
  for (int k = 0; k < steps; ++k) {
    Task task;
    const bool strong = k % 4 >= 2, symmetric = k % 2 == 0;
    random_steps::draw(task, noise, strong, symmetric);
    const auto result = jml::step(jml::IteratedJml{}, task.dynamics, task.sensor, task.prior, task.y);
    const auto& report = result.report;
    ++tally.steps;
    tally.symmetric += symmetric;
    tally.iterations += report.iterations;
    tally.by_net += report.solver == jml::Solver::levenberg_marquardt;
    if (!jml::usable(report.status)) {
      ++tally.refused;
      tally.refused_symmetric += symmetric;
      std::printf("  %s step %d (%s, %s): %s\n", name, k, strong ? "strong" : "weak", symmetric ? "symmetric" : "nonsymmetric",
                  jml::describe(report.status));
      EXPECT_EQ(result.estimate.x, task.prior.x);
      EXPECT_EQ(result.estimate.P, task.prior.P);
      continue;
    }
    const double residual = judge(task, report.smoothed, result.estimate.x).residual;
    if (report.status == jml::Status::ok) {
      ++tally.ok;
      tally.worst = std::max(tally.worst, residual);
    } else {
      ++tally.at_rounding;
      tally.worst_at_rounding = std::max(tally.worst_at_rounding, residual);
    }
  }
  std::printf("%-12s %5d steps: %5d converged (worst residual %.2g), %d at rounding (%.2g), %d refused (%d symmetric), "
              "%.2f iterations a step, %d by the fallback solver\n",
              name, tally.steps, tally.ok, tally.worst, tally.at_rounding, tally.worst_at_rounding, tally.refused,
              tally.refused_symmetric, static_cast<double>(tally.iterations) / tally.steps, tally.by_net);
  const std::string key = name;
  figure::print(key + "/steps", tally.steps);
  figure::print(key + "/converged", tally.ok);
  figure::print(key + "/at_rounding", tally.at_rounding);
  figure::print(key + "/refused", tally.refused);
  figure::print(key + "/residual", tally.worst);
  figure::print(key + "/iterations", static_cast<double>(tally.iterations) / tally.steps);
  EXPECT_LE(tally.worst, 1e-12);
  EXPECT_LE(tally.worst_at_rounding, 1e-10);
  EXPECT_LE(tally.at_rounding, tally.steps / 100);
  EXPECT_LE(tally.refused_symmetric, tally.symmetric / 200);
  EXPECT_LE(tally.refused, tally.steps / 100);
  return tally;
}

TEST(IteratedRoots, VanDerPol) { run<random_steps::VanDerPol>("van_der_pol", 1, 3000); }
#ifdef JML_BY_NIGHT
TEST(IteratedRoots, Pendulum) { run<random_steps::Pendulum>("pendulum", 2, 3000); }
TEST(IteratedRoots, Radar) { run<random_steps::Radar>("radar", 3, 3000); }
#endif
TEST(IteratedRoots, Polynomial) { run<random_steps::Polynomial>("polynomial", 4, 3000); }

// theory: discrete Van der Pol, Euler dt = 0.05, c = 0.1, k = 1, G Q Gᵀ = diag(0, 0.05), R = 0.02; the root was found outside
// this library, and minimising the norm of the two lines ends at (1.3001, 0.4900), (2.0593, 0.4216), which is no root.
TEST(IteratedRoots, TheTrapOfResidualMinimisation) {
  const jml::Estimate<double, 2> prior{{1.5, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};
  const jml::Vector<double, 1> y(0.6 * std::sin(0.3) + 0.05 * std::cos(2.1));
  const models::VanDerPol dynamics{.dt = 0.05, .c = 0.1, .k = 1, .q_c = 1};
  const models::SaturatingPosition sensor{.r = 0.02};
  for (const auto method : {jml::Iteration::picard, jml::Iteration::anderson, jml::Iteration::newton, jml::Iteration::none}) {
    const auto result = jml::step(jml::IteratedJml{jml::IterationOptions{.method = method}}, dynamics, sensor, prior, y);
    ASSERT_EQ(result.report.status, jml::Status::ok);
    EXPECT_NEAR(result.report.smoothed(0), 0.23077728, 5e-9);
    EXPECT_NEAR(result.report.smoothed(1), 0.43653886, 5e-9);
    EXPECT_NEAR(result.estimate.x(0), 0.25260423, 5e-9);
    EXPECT_NEAR(result.estimate.x(1), 0.42913290, 5e-9);
  }
}

// The SDC enters the sweeps of (9) and P, never the root.
TEST(IteratedRoots, SameForEverySdcAndReference) {
  jml::Noise noise(5);
  int compared = 0, different_P = 0;
  for (int k = 0; k < 400; ++k) {
    random_steps::Polynomial task;
    random_steps::draw(task, noise, false, k % 2 == 0);
    const jml::IterationOptions printed{.method = jml::Iteration::picard, .max_iterations = 200, .use_fallback = false};
    const jml::Vector<double, 4> elsewhere(0.3, -0.2, 0.5, 0.1);
    const auto a = jml::step(jml::IteratedJml{printed}, task.dynamics, task.sensor, task.prior, task.y);
    const auto b = jml::step(jml::IteratedJml{jml::AboutPoint{elsewhere}, printed}, task.dynamics, task.sensor, task.prior, task.y);
    const auto c = jml::step(jml::IteratedJml{jml::AboutEstimate{}, printed}, task.dynamics, task.sensor, task.prior, task.y);
    if (a.report.status != jml::Status::ok || b.report.status != jml::Status::ok || c.report.status != jml::Status::ok) continue;
    ++compared;
    EXPECT_LT((a.estimate.x - b.estimate.x).norm(), 1e-9);
    EXPECT_LT((a.estimate.x - c.estimate.x).norm(), 1e-9);
    EXPECT_LT((a.report.smoothed - b.report.smoothed).norm(), 1e-9);
    different_P += (a.estimate.P - b.estimate.P).norm() > 1e-6 && (a.estimate.P - c.estimate.P).norm() > 1e-6;
  }
  std::printf("Picard with three references converged on %d of 400 steps; P differs on %d of them\n", compared, different_P);
  EXPECT_GT(compared, 300);
  EXPECT_GT(different_P, 300);
}

}  // namespace
