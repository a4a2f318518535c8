// SPDX-License-Identifier: BSD-3-Clause
// One sweep of (9) from (x̂_i, f(x̂_i)), with the matrices of that same sweep, is the one-pass rule (14); more
// sweeps are (9) as printed, written here once more with explicit inverses.
#include <gtest/gtest.h>

#include <jml/jml.hpp>

#include "models/linear.hpp"
#include "models/pendulum.hpp"
#include "models/polynomial.hpp"
#include "riccati/oracle.hpp"

namespace {

using namespace jml::operators;

constexpr int steps = 200;
constexpr double tolerance = 1e-12;
constexpr jml::IterationOptions one_sweep{
    .method = jml::Iteration::picard, .max_iterations = 1, .accept_at_limit = true};

/// Both filters, each with its own estimate, over the same noisy samples.
template <typename OnePass, typename Swept, typename D, typename S, int n>
void expect_same(const OnePass& one_pass, const Swept& swept, const D& dynamics, const S& sensor,
                 const jml::Estimate<double, n>& start, double noise_share) {
  jml::Filter a{one_pass, dynamics, start};
  jml::Filter b{swept, dynamics, start};
  jml::Noise noise(61);
  jml::Vector<double, n> truth = start.x;
  double worst_x = 0, worst_P = 0, worst_innovation = 0, asymmetry = 0;
  for (int i = 0; i < steps; ++i) {
    truth = dynamics.dynamics(truth);
    const jml::Vector<double, S::measurements> y =
        sensor.measurement(truth) + noise_share * noise.normal_vector(sensor.noise_covariance());
    const auto first = a.step(sensor, y);
    const auto second = b.step(sensor, y);
    ASSERT_EQ(first.status, jml::Status::ok) << i;
    ASSERT_EQ(second.status, jml::Status::accepted_at_limit) << i;
    ASSERT_EQ(second.iterations, 1);
    worst_innovation = std::max(worst_innovation, (second.innovation - first.innovation).norm());
    worst_x = std::max(worst_x, (a.x() - b.x()).norm() / a.x().norm());
    worst_P = std::max(worst_P, (a.P() - b.P()).norm() / a.P().norm());
    asymmetry = std::max(asymmetry, (a.P() - a.P().transpose()).norm() / a.P().norm());
  }
  EXPECT_LT(worst_x, tolerance);
  EXPECT_LT(worst_P, tolerance);
  EXPECT_LT(worst_innovation, tolerance);
  EXPECT_GT(asymmetry, OnePass::about_estimate ? 0 : 1e-6) << "a symmetric P would not tell the slots apart";
}

jml::Estimate<double, 2> pendulum_start() {
  return {jml::Vector<double, 2>(1.5, -0.5),
          (jml::Matrix<double, 2, 2>() << 0.1, 0.02, 0.02, 0.2).finished()};
}

TEST(OneSweep, IsTheOnePassJmlOnAPendulum) {
  const jml::Estimate<double, 2> start = pendulum_start();
  expect_same(jml::Jml{}, jml::IteratedJml{one_sweep}, models::Pendulum{}, models::SineSensor{}, start, 1);
  expect_same(jml::Jml{}, jml::IteratedJml{one_sweep}, models::Pendulum{.damping = 0}, models::AngleSensor{},
              start, 1);
}

TEST(OneSweep, IsTheOnePassJmlAboutAPoint) {
  const jml::Estimate<double, 2> start = pendulum_start();
  const jml::AboutPoint point{jml::Vector<double, 2>(0.3, 0.2)};
  expect_same(jml::Jml{point}, jml::IteratedJml{point, one_sweep}, models::Pendulum{}, models::SineSensor{},
              start, 1);
}

TEST(OneSweep, IsTheOnePassJmlOnADensePolynomial) {
  jml::Noise noise(62);
  const jml::Estimate<double, 4> start{0.3 * models::random_matrix<4, 1>(noise),
                                       0.01 * models::random_covariance<4>(noise, 0.1)};
  const models::Polynomial<4> dynamics{.constant = 0.02, .bend = 0.01, .cubic = -0.01};
  expect_same(jml::Jml{}, jml::IteratedJml{one_sweep}, dynamics,
              models::PolynomialSensor<4, 2>{.constant = 0.5}, start, 0.3);
}

/// (9) swept as printed, for f(0) = 0 and m(0) = 0: F(x_s) x̂ and M(x_1) x̄ stand where f and m would in an
/// EKF.
struct Printed {
  oracle::Big x_s, x_1, P;
};
Printed sweep(const models::Polynomial<4>& d, const models::PolynomialSensor<4, 2>& s,
              const jml::Estimate<double, 4>& prior, const jml::Vector<double, 2>& y, int sweeps) {
  using oracle::Big, oracle::big;
  const Big G = big(d.disturbance_input()), noise = G * big(d.disturbance_covariance()) * G.transpose();
  const Big x = big(prior.x), R = big(s.noise_covariance());
  Printed out{x, big(jml::Vector<double, 4>(d.dynamics(prior.x))), {}};
  for (int i = 0; i < sweeps; ++i) {
    const jml::Vector<double, 4> at_s = out.x_s.cast<double>(), at_1 = out.x_1.cast<double>();
    const Big F = big(d.dynamics_sdc(at_s)), f_x = big(d.dynamics_jacobian(at_s));
    const Big m_x = big(s.measurement_jacobian(at_1)), M = big(s.measurement_sdc(at_1));
    const Big misfit = big(y) - big(jml::Vector<double, 2>(s.measurement(at_1)));
    const Big bar = F * x;
    const auto posterior =
        oracle::push_through({F, f_x, m_x, M, noise, R}, bar, big(prior.P), big(y) - M * bar);
    out.x_s = x + big(prior.P) * f_x.transpose() * m_x.transpose() * oracle::inverse(R) * misfit;
    out.x_1 = posterior.x;
    out.P = posterior.P;
  }
  return out;
}

TEST(ManySweeps, AreEquationNineAsPrinted) {
  jml::Noise noise(63);
  const models::Polynomial<4> dynamics;
  const models::PolynomialSensor<4, 2> sensor;
  jml::Estimate<double, 4> prior{models::random_matrix<4, 1>(noise),
                                 0.05 * models::random_covariance<4>(noise, 0.2)};
  prior.P += 0.01 * models::random_matrix<4, 4>(noise);  // nonsymmetric, as after a JML step
  const jml::Vector<double, 2> y =
      sensor.measurement(dynamics.dynamics(prior.x)) + 0.2 * models::random_matrix<2, 1>(noise);
  for (int sweeps = 1; sweeps <= 4; ++sweeps) {
    const jml::IteratedJml rule{jml::IterationOptions{
        .method = jml::Iteration::picard, .max_iterations = sweeps, .accept_at_limit = true}};
    const auto got = jml::step(rule, dynamics, sensor, prior, y);
    ASSERT_EQ(got.report.status, jml::Status::accepted_at_limit);
    const Printed wanted = sweep(dynamics, sensor, prior, y, sweeps);
    EXPECT_LT(oracle::distance(got.estimate.x, wanted.x_1), 1e-13) << sweeps;
    EXPECT_LT(oracle::distance(got.report.smoothed, wanted.x_s), 1e-13) << sweeps;
    EXPECT_LT(oracle::distance(got.estimate.P, wanted.P), 1e-13) << sweeps;
  }
}

}  // namespace
