// SPDX-License-Identifier: BSD-3-Clause
// The answer of Batch on nonlinear models: ∇J = 0 by dual numbers through the whole run from (x_0, w), and
// the Laplace covariance by the dense Gauss-Newton Hessian. tests/batch/roll_out.hpp is the oracle of both.
#include <gtest/gtest.h>

#include <jml/filter/filter.hpp>

#include "interval/roll_out.hpp"
#include "jml/interval/criterion.hpp"
#include "jml/campaign/noise.hpp"
#include "models/pendulum.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using batch_tests::RollOut, batch_tests::Matrix, batch_tests::Vector;

/// Measurements of every node for which `every` divides its number, of a run from `truth`.
template <typename Problem>
void simulate(Problem& problem, Vector<double, Problem::n> truth, int every, unsigned seed) {
  jml::Noise noise(seed);
  const auto& d = problem.dynamics;
  for (std::size_t k = 0; k < problem.y.size(); ++k) {
    if (k > 0) {
      const auto w = noise.normal_vector(d.disturbance_covariance());
      truth = (d.dynamics(truth) + d.disturbance_input() * w).eval();
    }
    const auto v = noise.normal_vector(problem.sensor.noise_covariance());
    if (static_cast<int>(k) % every == 0) problem.y[k] = problem.sensor.measurement(truth) + v;
  }
}

/// |∇J| where a filter ends: the states of an EKF, and the disturbances that lead from each to the next as
/// nearly as the model can.
template <typename Problem>
double gradient_of_the_filter(const Problem& problem) {
  jml::Filter filter{jml::Ekf{}, problem.dynamics, problem.prior};
  std::array<Vector<double, Problem::n>, Problem::unknowns> x;
  for (std::size_t k = 0; k < problem.y.size(); ++k) {
    if (k > 0 && filter.predict() != jml::Status::ok) ADD_FAILURE();
    if (problem.y[k] && filter.update(problem.sensor, *problem.y[k]).status != jml::Status::ok) ADD_FAILURE();
    x[k] = filter.x();
  }
  const batch_tests::Dense<double> G = problem.dynamics.disturbance_input();
  const auto GTG = batch_tests::transposed_times(G, G);
  const auto state = [&](int k) { return x[static_cast<std::size_t>(k)]; };
  const auto disturbance = [&](int k) {
    const Vector<double, Problem::n> jump = state(k + 1) - problem.dynamics.dynamics(state(k));
    // G has orthogonal columns of one length in all models here.
    return Vector<double, Problem::q>(G.transpose().lazyProduct(jump) / GTG(0, 0));
  };
  return problem.gradient(problem.unknowns_of(state, disturbance)).norm();
}

template <typename Problem, typename Batch>
void expect_a_trajectory(const Problem& problem, const Batch& batch, double cost) {
  constexpr int n = Problem::n;
  jml::Criterion J{problem.dynamics, problem.prior};
  (void)J.start(batch.x(0));
  for (int k = 0; k < batch.steps(); ++k) {
    const auto& measured = problem.y[static_cast<std::size_t>(k)];
    if (measured) (void)J.measure(problem.sensor, *measured);
    (void)J.disturb(batch.w(k));
  }
  if (problem.y.back()) (void)J.measure(problem.sensor, *problem.y.back());
  EXPECT_EQ(J.status(), jml::Status::ok);
  EXPECT_NEAR(J.value(), cost, 1e-11 * cost);
  const auto z = problem.unknowns_of(batch);
  EXPECT_NEAR(problem.cost(z), cost, 1e-11 * cost);
  problem.template run<double>(z, [&](int k, const Vector<double, n>& x) {
    EXPECT_LE((batch.x(k) - x).norm(), 1e-11 * x.norm()) << "node " << k;
  });
}

/// Largest difference of two answers, in posterior standard deviations.
template <typename Batch>
double distance(Batch& a, const Batch& b) {
  double largest = 0;
  EXPECT_TRUE(a.covariances([&](int k, const auto& P) {
    for (int i = 0; i < Batch::states; ++i) {
      const double sd = std::sqrt(P(i, i)), off = std::abs(a.x(k)(i) - b.x(k)(i));
      if (off > 0) largest = std::max(largest, off / sd);
    }
  }));
  return largest;
}

template <typename Problem>
void expect_the_minimum(const Problem& problem) {
  const double before = gradient_of_the_filter(problem);
  ASSERT_GT(before, 1e-3);
  auto batch = problem.batch();
  const auto report = batch.solve();
  ASSERT_EQ(report.status, jml::Status::ok);
  EXPECT_LE(report.iterations, 8);  // measured 5 or 6: the steps are Newton's
  expect_a_trajectory(problem, batch, report.cost);
  EXPECT_LE(problem.gradient(problem.unknowns_of(batch)).norm(), 1e-8 * before);
  EXPECT_LE(report.gradient, 1e-8 * before);
  EXPECT_GT(problem.cost(problem.unknowns_of([&](int) { return problem.prior.x; },
                                             [](int) { return Vector<double, Problem::q>::Zero(); })),
            report.cost);

  // On the way the gradient is no rounding error, and the reported one is the same number.
  int compared = 0;
  for (int limit = 1; limit < report.iterations; ++limit) {
    auto early = problem.batch();
    early.options.max_iterations = limit;
    early.options.accept_at_limit = true;
    const auto half_way = early.solve();
    EXPECT_EQ(half_way.status, jml::Status::accepted_at_limit);
    expect_a_trajectory(problem, early, half_way.cost);
    const double expected = problem.gradient(problem.unknowns_of(early)).norm();
    EXPECT_NEAR(half_way.gradient, expected, 1e-9 * expected + 1e-9 * before);
    compared += expected > 1e-6 * before;
  }
  EXPECT_GE(compared, 1);

  // From elsewhere, and without second derivatives: the same answer.
  for (const auto start : {jml::Start::filter, jml::Start::prediction, jml::Start::given}) {
    for (const bool newton : {true, false}) {
      SCOPED_TRACE(testing::Message() << "start " << static_cast<int>(start) << ", newton " << newton);
      auto other = problem.batch();
      other.start = start;
      other.options.newton = newton;
      const auto again = other.solve();
      EXPECT_EQ(again.status, jml::Status::ok);
      EXPECT_NEAR(again.cost, report.cost, 1e-11 * report.cost);
      EXPECT_LE(distance(batch, other), 1e-7);
      if (!newton) {
        EXPECT_GT(again.iterations, report.iterations);
      }
    }
  }

  const auto covariances = problem.covariances(problem.unknowns_of(batch));
  EXPECT_TRUE(batch.covariances([&](int k, const auto& P) {
    const auto& expected = covariances[static_cast<std::size_t>(k)];
    for (int j = 0; j < Problem::n; ++j) {
      for (int i = 0; i < Problem::n; ++i)
        EXPECT_NEAR(P(i, j), expected(i, j), 1e-10 * std::sqrt(expected(i, i) * expected(j, j))) << k;
    }
  }));
}

// The paper's example: P_0 = 0 and noise of rank one.
TEST(BatchGradient, VanDerPol) {
  RollOut<models::VanDerPol, models::SaturatingPosition, 12> problem{
      {.dt = 0.2}, {.r = 1e-3 / 0.2}, {{1, 0}, Matrix<double, 2, 2>::Zero()}};
  simulate(problem, problem.prior.x, 1, 21);
  expect_the_minimum(problem);
}

TEST(BatchGradient, VanDerPolWithAPriorAndGaps) {
  RollOut<models::VanDerPol, models::SaturatingPosition, 12> problem{
      {.dt = 0.2, .c = 1}, {.r = 0.01}, {{1.5, 0.5}, 0.3 * Matrix<double, 2, 2>::Identity()}};
  problem.prior.P(0, 1) = problem.prior.P(1, 0) = 0.1;
  simulate(problem, {1.1, 0.9}, 3, 22);
  expect_the_minimum(problem);
}

TEST(BatchGradient, Pendulum) {
  RollOut<models::Pendulum, models::SineSensor, 10> problem{
      {.dt = 0.1, .variance = 2}, {}, {{1, 0.5}, Matrix<double, 2, 2>::Zero()}};
  problem.prior.P << 0.04, -0.1, -0.1, 0.25;  // of rank one
  simulate(problem, {1.2, 0}, 1, 23);
  expect_the_minimum(problem);
}

TEST(BatchGradient, Radar) {
  RollOut<models::BallisticTarget, models::Radar, 8> problem{
      {.dt = 2, .acceleration_variance = 1e-3}, {.angle_sd = 0.02}, {}};
  problem.prior.x << -20, 0.4, 3, -0.2, -0.1, 0.3;
  problem.prior.P = Matrix<double, 6, 6>::Identity();
  problem.prior.P.bottomRightCorner<3, 3>() *= 0.01;
  Vector<double, 6> truth;
  truth << -19.5, 0.8, 3.4, -0.25, -0.15, 0.28;
  simulate(problem, truth, 2, 24);  // across azimuth = π, where it wraps
  expect_the_minimum(problem);
}

}  // namespace
