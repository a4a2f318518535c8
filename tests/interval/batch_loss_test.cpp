// SPDX-License-Identifier: BSD-3-Clause
// Robust losses: the functions themselves, against their formulas on dual numbers, and Batch with outliers:
// stationary for the robust J, and on a linear system what reweighted dense least squares ends at.
#include <gtest/gtest.h>

#include "interval/roll_out.hpp"
#include "models/linear.hpp"
#include "models/van_der_pol.hpp"

namespace {

using jml::Loss, jml::Matrix, jml::Vector;

// ρ(s) as the header of Loss prints it, for any scalar.
struct Huber {
  double width = 2;
  template <typename T>
  T operator()(const T& s) const {
    using std::sqrt;
    if (s <= T(width * width)) return s;
    return T(2 * width) * sqrt(s) - T(width * width);
  }
};
struct Cauchy {
  double width = 2;
  template <typename T>
  T operator()(const T& s) const {
    using std::log1p;
    return T(width * width) * log1p(s / T(width * width));
  }
};

TEST(Loss, ByHand) {
  for (const double s : {0.0, 0.3, 4.0, 1e6}) EXPECT_EQ(Loss{}(s).rho, s);
  EXPECT_DOUBLE_EQ(Loss::huber(2)(3.9).rho, 3.9);
  EXPECT_DOUBLE_EQ(Loss::huber(2)(9.0).rho, 8);    // 2·2·3 - 2²
  EXPECT_DOUBLE_EQ(Loss::huber(3)(36.0).rho, 27);  // 2·3·6 - 3²
  EXPECT_DOUBLE_EQ(Loss::cauchy(2)(4.0).rho, 4 * std::log(2));
  EXPECT_DOUBLE_EQ(Loss::cauchy(1)(std::exp(2.0) - 1).rho, 2);
}

/// ρ, ρ', and the curvature ρ' + 2 s ρ'' along the residual, which `bend` takes away from ρ' or cuts to zero.
template <typename Rho>
void expect_derivatives(const Loss& loss, const Rho& rho) {
  using First = jml::Dual<double, 1>;
  using Second = jml::Dual<First, 1>;
  for (const double s : {1e-12, 0.01, 1.0, 3.0, 3.999, 4.001, 5.0, 30.0, 1e4, 1e12}) {
    Second at(First{s});
    at.value.partial[0] = 1;
    at.partial[0].value = 1;
    const Second value = rho(at);
    const double slope = value.partial[0].value, second = value.partial[0].partial[0];
    const auto got = loss(s);
    EXPECT_NEAR(got.rho, value.value.value, 1e-14 * s) << s;
    EXPECT_NEAR(got.slope, slope, 1e-14) << s;
    EXPECT_NEAR(got.slope - got.bend * s, std::max(0.0, slope + 2 * s * second), 1e-13 * slope) << s;
  }
}

TEST(Loss, SlopesAreDerivatives) {
  expect_derivatives(Loss{}, batch_tests::NoLoss{});
  expect_derivatives(Loss::huber(2), Huber{});
  expect_derivatives(Loss::cauchy(2), Cauchy{});
  expect_derivatives(Loss::huber(0.1), Huber{0.1});
  expect_derivatives(Loss::cauchy(50), Cauchy{50});
}

TEST(Loss, IsContinuousAtTheCorner) {
  for (const double width : {1e-3, 0.7, 2.0, 1e5}) {
    const double corner = width * width, step = 1e-9 * corner;
    const auto below = Loss::huber(width)(corner), above = Loss::huber(width)(corner + step);
    EXPECT_NEAR(above.rho - below.rho, step, 1e-15 * corner);
    EXPECT_NEAR(above.slope, below.slope, 1e-9);
    EXPECT_LE(above.slope, 1);
  }
}

TEST(Loss, AtItsEnds) {
  for (const Loss loss : {Loss{}, Loss::huber(1.5), Loss::cauchy(1.5)}) {
    const auto zero = loss(0.0), tiny = loss(1e-30), far = loss(1e300);
    EXPECT_EQ(zero.rho, 0);
    EXPECT_EQ(zero.slope, 1);
    EXPECT_TRUE(std::isfinite(zero.bend));
    EXPECT_DOUBLE_EQ(tiny.rho, 1e-30);  // log(1 + s) as written would be 0
    EXPECT_TRUE(std::isfinite(far.rho) && std::isfinite(far.bend));
    EXPECT_GE(far.slope, 0);
    EXPECT_TRUE(std::isnan(loss(std::nan("")).rho));
    const auto single = loss(100.0f);
    EXPECT_NEAR(single.rho, loss(100.0).rho, 1e-5 * loss(100.0).rho);
  }
}

/// The paper's example over 2.4 s, with three outliers.
template <typename Rho>
auto with_outliers(const Rho& rho) {
  batch_tests::RollOut<models::VanDerPol, models::SaturatingPosition, 12, Rho> problem{
      {.dt = 0.2}, {.r = 1e-3 / 0.2}, {{1, 0}, 0.1 * Matrix<double, 2, 2>::Identity()}, {}, rho};
  jml::Noise noise(41);
  Vector<double, 2> truth(1.2, 0.2);
  for (std::size_t k = 0; k < problem.y.size(); ++k) {
    if (k > 0) {
      truth = problem.dynamics.dynamics(Vector<double, 2>(truth));
      truth(1) += 0.3 * noise.normal();
    }
    const double v = std::sqrt(problem.sensor.r) * noise.normal();
    const double outlier = k == 3 ? 0.8 : k == 7 ? -1.2 : k == 8 ? 0.5 : 0;
    problem.y[k] = Vector<double, 1>(problem.sensor.measurement(truth)(0) + v + outlier);
  }
  return problem;
}

template <typename Rho>
void expect_stationary(const Loss& loss, const Rho& rho) {
  const auto problem = with_outliers(rho);
  const double before = problem.gradient(Eigen::VectorXd::Zero(problem.unknowns)).norm();
  for (const bool newton : {true, false}) {
    auto batch = problem.batch();
    batch.options.loss = loss;
    batch.options.newton = newton;
    batch.options.max_iterations = 300;
    const auto report = batch.solve();
    EXPECT_EQ(report.status, jml::Status::ok) << report.iterations;
    const auto z = problem.unknowns_of(batch);
    EXPECT_NEAR(report.cost, problem.cost(z), 1e-12 * report.cost);
    EXPECT_LE(problem.gradient(z).norm(), 1e-8 * before);
    EXPECT_LE(report.gradient, 1e-8 * before);
    auto early = problem.batch();
    early.options = batch.options;
    early.options.max_iterations = 2;
    early.options.accept_at_limit = true;
    const auto half_way = early.solve();
    const double expected = problem.gradient(problem.unknowns_of(early)).norm();
    EXPECT_GT(expected, 1e-6 * before);
    EXPECT_NEAR(half_way.gradient, expected, 1e-9 * expected);
  }
}

TEST(BatchLoss, HuberIsStationary) { expect_stationary(Loss::huber(2), Huber{}); }

TEST(BatchLoss, CauchyIsStationary) { expect_stationary(Loss::cauchy(2), Cauchy{}); }

// A loss that no residual is wide enough for is none.
TEST(BatchLoss, WideEnoughIsNone) {
  const auto problem = with_outliers(batch_tests::NoLoss{});
  auto plain = problem.batch(), wide = problem.batch();
  wide.options.loss = Loss::huber(1e3);
  const auto a = plain.solve(), b = wide.solve();
  EXPECT_EQ(a.status, jml::Status::ok);
  EXPECT_EQ(a.cost, b.cost);
  for (int k = 0; k <= 12; ++k) EXPECT_EQ(plain.x(k), wide.x(k));
  auto robust = problem.batch();
  robust.options.loss = Loss::huber(2);
  EXPECT_LT(robust.solve().cost, 0.5 * a.cost);
}

constexpr int steps = 15;
using LinearProblem =
    batch_tests::RollOut<models::LinearDynamics<4, 2>, models::LinearSensor<4, 2>, steps, Huber>;

LinearProblem linear_with_outliers() {
  jml::Noise noise(42);
  LinearProblem problem{models::random_linear_dynamics<4, 2>(noise),
                        models::random_linear_sensor<4, 2>(noise),
                        {},
                        {},
                        Huber{1.5}};
  problem.prior.x = models::random_matrix<4, 1>(noise);
  problem.prior.P = models::random_covariance<4>(noise, 0.1);
  for (std::size_t k = 1; k <= steps; ++k) {
    const auto y = models::random_matrix<2, 1>(noise);
    problem.y[k] = (k % 4 == 1 ? 12.0 : 2.0) * y;
  }
  return problem;
}

// Weight each measurement by ρ'(s), solve the dense normal equations, repeat until nothing moves.
TEST(BatchLoss, HuberOnALinearSystemIsReweightedLeastSquares) {
  const LinearProblem problem = linear_with_outliers();
  constexpr int unknowns = LinearProblem::unknowns;
  const auto residuals = [&](const Eigen::VectorXd& z) {
    Eigen::VectorXd r = Eigen::VectorXd::Zero(2 * (steps + 1));
    problem.run<double>(z, [&](int k, const Vector<double, 4>& x) {
      if (k > 0) r.segment<2>(2 * k) = problem.whitened_residual(k, x);
    });
    return r;
  };
  const Eigen::VectorXd start = residuals(Eigen::VectorXd::Zero(unknowns));
  batch_tests::Dense<double> A(start.size(), unknowns);  // r = start - A z
  for (int i = 0; i < unknowns; ++i) A.col(i) = start - residuals(Eigen::VectorXd::Unit(unknowns, i));
  Eigen::VectorXd z = Eigen::VectorXd::Zero(unknowns);
  double moved = 1;
  int outliers = 0;
  for (int sweep = 0; sweep < 3000 && moved > 1e-14; ++sweep) {
    const Eigen::VectorXd r = residuals(z);
    batch_tests::Dense<double> weighted = A;
    outliers = 0;
    for (int k = 1; k <= steps; ++k) {
      const double length = r.segment<2>(2 * k).norm(), weight = length > 1.5 ? 1.5 / length : 1;
      outliers += length > 1.5;
      weighted.middleRows(2 * k, 2) *= weight;
    }
    const batch_tests::Dense<double> normal =
        batch_tests::Dense<double>::Identity(unknowns, unknowns) + batch_tests::transposed_times(weighted, A);
    const auto L = batch_tests::lower_root(normal);
    // The normal equations L Lᵀ z = Aᵀ W start, by the rows of L⁻¹.
    const batch_tests::Dense<double> inverse =
        batch_tests::forward_solve<double>(L, batch_tests::Dense<double>::Identity(unknowns, unknowns));
    const Eigen::VectorXd right = weighted.transpose().lazyProduct(start);
    const Eigen::VectorXd half = inverse.lazyProduct(right);
    const Eigen::VectorXd next = inverse.transpose().lazyProduct(half);
    moved = (next - z).cwiseAbs().maxCoeff();
    z = next;
  }
  ASSERT_LE(moved, 1e-14);
  ASSERT_GE(outliers, 3);
  ASSERT_LE(outliers, steps - 3);

  auto batch = problem.batch();
  batch.options.loss = Loss::huber(1.5);
  const auto report = batch.solve();
  ASSERT_EQ(report.status, jml::Status::ok);
  EXPECT_NEAR(report.cost, problem.cost(z), 1e-12 * report.cost);
  EXPECT_LE((problem.unknowns_of(batch) - z).cwiseAbs().maxCoeff(), 1e-10);
}

// One number per measurement: beyond the corner the Huber loss is straight, so an outlier says nothing about
// the spread, and P is that of the smoother without it.
TEST(BatchLoss, AnOutlierLeavesNoInformation) {
  jml::Noise noise(43);
  const auto d = models::random_linear_dynamics<4, 2>(noise);
  const auto s = models::random_linear_sensor<4, 1>(noise);
  const jml::Estimate<double, 4> prior{Vector<double, 4>::Zero(), models::random_covariance<4>(noise, 0.1)};
  const auto sensors = jml::sensors<models::LinearSensor<4, 1>>;
  jml::Batch robust{d, sensors, prior, {steps}}, without{d, sensors, prior, {steps}};
  robust.options.loss = Loss::huber(2);
  for (int k = 1; k <= steps; ++k) {
    const bool outlier = k % 5 == 2;
    const double y = outlier ? 1e3 : 0.1 * noise.normal();
    ASSERT_EQ(robust.step(s, y), jml::Status::ok);
    ASSERT_EQ(outlier ? without.predict() : without.step(s, y), jml::Status::ok);
  }
  ASSERT_EQ(robust.solve().status, jml::Status::ok);
  ASSERT_EQ(without.solve().status, jml::Status::ok);
  for (int k = 0; k <= steps; ++k) {
    const Matrix<double, 4, 4> P = robust.P(k), expected = without.P(k);
    EXPECT_LE((P - expected).norm(), 1e-12 * expected.norm()) << k;
  }
}

}  // namespace
