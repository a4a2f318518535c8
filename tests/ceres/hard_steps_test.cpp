// SPDX-License-Identifier: BSD-3-Clause
// A family of hard steps with a known root: who solves how many. Half have a nonsymmetric P.
//
// Van der Pol, dt 0.05 to 0.5, c 0.1 or 1, R 1e-4 to 1. The root is planted: x_s and x_1 are drawn, y and then x̂ follow from
// the two ground-truth lines, so a root exists whatever P is.
#include <gtest/gtest.h>

#include <cstdio>
#include <jml/jml.hpp>
#include <jml/campaign/noise.hpp>
#include <jml/solve/ceres.hpp>

#include "figure.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

struct Task {
  models::VanDerPol dynamics;
  models::SaturatingPosition sensor;
  jml::Estimate<double, 2> prior;
  jml::Vector<double, 1> y;
};

/// C m_xᵀ = 0 here (the noise drives the velocity, the sensor sees the position), so x_1 = f(x_s); then x̂ = x_s - P f_xᵀ m_xᵀ ν.
Task planted(jml::Noise& noise, bool symmetric) {
  Task t;
  t.dynamics.dt = noise.uniform(0.05, 0.5);
  t.dynamics.c = noise.uniform() < 0.5 ? 0.1 : 1;
  t.sensor.r = std::pow(10.0, noise.uniform(-4, 0));
  jml::Matrix<double, 2, 2> L;
  for (int i = 0; i < 4; ++i) L.data()[i] = 0.5 * noise.normal();
  t.prior.P = L * L.transpose();
  t.prior.P(0, 1) = t.prior.P(1, 0);
  if (!symmetric) {
    const double twist = 0.3 * noise.normal() * std::sqrt(t.prior.P(0, 0) * t.prior.P(1, 1));
    t.prior.P(0, 1) += twist;
    t.prior.P(1, 0) -= twist;
  }
  const jml::Vector<double, 2> x_s = 1.5 * noise.normal_vector<2>();
  // The innovation that the filter would call ordinary: √S, S = m_x N m_xᵀ + R; what is left of it at the root is R S⁻¹.
  jml::Vector<double, 2> x_1 = t.dynamics.dynamics(x_s);
  const jml::Matrix<double, 1, 2> m_x = t.sensor.measurement_jacobian(x_1);
  const jml::Matrix<double, 2, 2> f_x = t.dynamics.dynamics_jacobian(x_s);
  const double S = (m_x * f_x * t.prior.P * f_x.transpose() * m_x.transpose())(0) + t.sensor.r;
  const double misfit = noise.normal() * t.sensor.r / std::sqrt(std::abs(S));
  const double nu = misfit / t.sensor.r;
  t.y = t.sensor.measurement(x_1) + jml::Vector<double, 1>(misfit);
  t.prior.x = x_s - t.prior.P * f_x.transpose() * m_x.transpose() * nu;
  return t;
}

/// The two lines at (x_s, x_1), independently of the library; over the state scale.
double residual(const Task& t, const jml::Vector<double, 2>& x_s, const jml::Vector<double, 2>& x_1) {
  const jml::Vector<double, 2> e = t.sensor.measurement_jacobian(x_1).transpose() * ((t.y - t.sensor.measurement(x_1)) / t.sensor.r);
  const jml::Vector<double, 2> first = t.prior.x + t.prior.P * t.dynamics.dynamics_jacobian(x_s).transpose() * e - x_s;
  const jml::Vector<double, 2> C(0, t.dynamics.dt * t.dynamics.q_c);
  const jml::Vector<double, 2> second = t.dynamics.dynamics(x_s) + C.cwiseProduct(e) - x_1;
  const jml::Vector<double, 2> start = t.dynamics.dynamics(t.prior.x);
  double worst = 0;
  for (int i = 0; i < 2; ++i) {
    const double scale = std::abs(t.prior.x(i)) + std::abs(start(i)) + std::sqrt(std::abs(t.prior.P(i, i)) + C(i));
    worst = std::max({worst, std::abs(first(i)) / scale, std::abs(second(i)) / scale});
  }
  return worst;
}

struct Count {
  int solved = 0, refused = 0;
  double worst = 0;
};

template <typename Rule>
void attempt(const Rule& rule, const Task& t, Count& count) {
  const auto result = jml::step(rule, t.dynamics, t.sensor, t.prior, t.y);
  if (!jml::usable(result.report.status)) {
    ++count.refused;
    EXPECT_EQ(result.estimate.x, t.prior.x);  // a refusal leaves the prior
    EXPECT_EQ(result.estimate.P, t.prior.P);
    return;
  }
  ++count.solved;
  count.worst = std::max(count.worst, residual(t, result.report.smoothed, result.estimate.x));
}

TEST(HardSteps, WhoSolvesThem) {
  jml::Noise noise(21);
  const jml::IterationOptions picard{.method = jml::Iteration::picard, .max_iterations = 50, .use_fallback = false};
  const jml::IterationOptions anderson{.method = jml::Iteration::anderson, .use_fallback = false};
  const jml::IterationOptions newton{.method = jml::Iteration::newton, .use_fallback = false};
  const jml::IterationOptions net{.method = jml::Iteration::none};
  Count by_anderson, by_newton, by_net, by_ceres, by_filter;
  int hard = 0, hard_nonsymmetric = 0, drawn = 0;
  while (hard < 1500 && drawn < 400000) {
    const bool symmetric = hard_nonsymmetric >= 750 || (drawn % 2 == 0 && hard - hard_nonsymmetric < 750);
    const Task t = planted(noise, symmetric);
    ++drawn;
    const auto printed = jml::step(jml::IteratedJml{picard}, t.dynamics, t.sensor, t.prior, t.y);
    if (jml::usable(printed.report.status)) continue;
    ++hard;
    hard_nonsymmetric += !symmetric;
    attempt(jml::IteratedJml{anderson}, t, by_anderson);
    attempt(jml::IteratedJml{newton}, t, by_newton);
    attempt(jml::IteratedJml{net}, t, by_net);
    attempt(jml::IteratedJml<jml::AboutOrigin, jml::Ceres>{net}, t, by_ceres);
    attempt(jml::IteratedJml{}, t, by_filter);
  }
  std::printf("%d steps on which Picard (50 sweeps) fails, %d of them with nonsymmetric P, out of %d drawn\n", hard, hard_nonsymmetric, drawn);
  figure::print("steps", hard);
  const auto print = [hard](const char* name, const char* key, const Count& c) {
    figure::print(std::string(key) + "_solves", 100.0 * c.solved / hard, "%");
    std::printf("  %-32s solves %5d (%6.2f %%), refuses %d, worst residual %.2g\n", name, c.solved, 100.0 * c.solved / hard, c.refused, c.worst);
  };
  print("Anderson alone", "anderson", by_anderson);
  print("damped Newton alone", "newton", by_newton);
  print("the core's fallback solver alone", "fallback", by_net);
  print("the fallback solver with Ceres alone", "ceres", by_ceres);
  print("the filter (Anderson, then the fallback solver)", "filter", by_filter);
  ASSERT_GE(hard, 1000);
  EXPECT_GE(hard_nonsymmetric, hard / 2 - 1);
  EXPECT_GE(by_net.solved, 0.995 * hard);
  EXPECT_GE(by_ceres.solved, 0.995 * hard);
  EXPECT_GE(by_filter.solved, 0.999 * hard);
  for (const Count& c : {by_anderson, by_newton, by_net, by_ceres, by_filter}) {
    EXPECT_EQ(c.solved + c.refused, hard);
    EXPECT_LE(c.worst, 1e-11);  // evaluated in double here: 1e-12 and the rounding of misfit / R at R = 1e-4
  }
}

}  // namespace
