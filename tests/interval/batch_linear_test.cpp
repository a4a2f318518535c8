// SPDX-License-Identifier: BSD-3-Clause
// Batch on linear systems is the Kalman smoother: against the joint Gaussian of (x_0, w), conditioned on all
// measurements by one dense solve in long double. P_0 and Q are inverted nowhere, so both may be singular.
#include <gtest/gtest.h>

#include <jml/interval/batch.hpp>
#include <vector>

#include "interval/dense_solve.hpp"
#include "models/linear.hpp"

namespace {

using namespace jml::operators;

using jml::Matrix, jml::Vector;
using Big = batch_tests::Dense<long double>;
using batch_tests::times, batch_tests::transposed_times;
template <typename Derived>
Big big(const Eigen::MatrixBase<Derived>& a) {
  Big out(a.rows(), a.cols());  // no expression: each would be a type of its own to compile
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    for (Eigen::Index i = 0; i < a.rows(); ++i) out(i, j) = static_cast<long double>(a(i, j));
  }
  return out;
}

/// ξ = (x_0 - x̂_0, w_0, w_1, …) is Gaussian with a block-diagonal covariance Σ, x_k = centre_k + map_k ξ and
/// y = h + H ξ + v.
class DenseSmoother {
 public:
  DenseSmoother(const Big& x0, const Big& P0, Eigen::Index disturbances, Eigen::Index steps)
      : n_(x0.rows()), q_(disturbances), unknowns_(n_ + steps * q_), H_(0, unknowns_) {
    covariance_ = Big::Zero(unknowns_, unknowns_);
    covariance_.topLeftCorner(n_, n_) = P0;
    maps_.push_back(Big::Identity(n_, unknowns_));
    centres_.push_back(x0);
  }

  /// x⁺ = F x + G (w̄ + w).
  void advance(const Big& F, const Big& G, const Big& Q, const Big& mean) {
    const Eigen::Index place = n_ + (static_cast<Eigen::Index>(maps_.size()) - 1) * q_;
    Big map = times(F, maps_.back());
    map.middleCols(place, q_) += G;
    maps_.push_back(map);
    centres_.push_back(times(F, centres_.back()) + times(G, mean));
    covariance_.block(place, place, q_, q_) = Q;
  }

  /// y = M x + v at the present node.
  void measure(const Big& M, const Big& R, const Big& y) {
    const Eigen::Index rows = H_.rows(), p = y.rows();
    H_.conservativeResize(rows + p, unknowns_);
    H_.bottomRows(p) = times(M, maps_.back());
    noise_.conservativeResize(rows + p, rows + p);
    noise_.rightCols(p).setZero();
    noise_.bottomRows(p).setZero();
    noise_.bottomRightCorner(p, p) = R;
    innovation_.conservativeResize(rows + p, 1);
    innovation_.bottomRows(p) = y - times(M, centres_.back());
  }

  void solve() {
    mean_ = Big::Zero(unknowns_, 1);
    if (H_.rows() == 0) return;
    const Big HS = times(H_, covariance_), S = times<long double>(HS, H_.transpose()) + noise_;
    const Big L = batch_tests::lower_root(S), half = batch_tests::forward_solve(L, HS);
    const Big white = batch_tests::forward_solve(L, innovation_);
    mean_ = transposed_times(half, white);
    cost_ = static_cast<double>(transposed_times(white, white)(0, 0)) / 2;
    covariance_ -= transposed_times(half, half);
  }

  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] Eigen::VectorXd x(int node) const {
    const auto k = static_cast<std::size_t>(node);
    return (centres_[k] + times(maps_[k], mean_)).cast<double>();
  }
  [[nodiscard]] Eigen::MatrixXd P(int node) const {
    const Big& map = maps_[static_cast<std::size_t>(node)];
    return times<long double>(times(map, covariance_), map.transpose()).cast<double>();
  }
  [[nodiscard]] Eigen::VectorXd w(int node) const {
    return mean_.middleRows(n_ + node * q_, q_).cast<double>();
  }

 private:
  Eigen::Index n_, q_, unknowns_;
  Big covariance_, H_, noise_, innovation_, mean_;
  std::vector<Big> maps_, centres_;
  double cost_ = 0;
};

/// Which measurements a node has: two sensor types, and two measurements of one type in one node.
enum class Pattern { every_step, gaps_and_pairs, none_at_all };

using Pair = models::LinearSensor<4, 2>;
using Single = models::LinearSensor<4, 1>;

/// Runs Batch and the dense smoother side by side. parts(k): what a step is made of, {F, G, Q, w̄, dt}.
template <typename D, typename Parts>
void expect_the_smoother(const D& dynamics, const jml::Estimate<double, 4>& prior, Pattern pattern,
                         const Parts& parts, unsigned seed) {
  constexpr int n = 4, q = D::disturbances, steps = 20;
  jml::Noise noise(seed);
  const Pair pair = models::random_linear_sensor<4, 2>(noise);
  const Single single = models::random_linear_sensor<4, 1>(noise);
  jml::Batch batch{dynamics, jml::sensors<Pair, Single>, prior, {.steps = steps, .measurements = 2 * steps}};
  DenseSmoother dense(big(prior.x), big(prior.P), q, steps);
  const auto measure = [&](const auto& sensor) {
    const auto y = models::random_matrix<std::remove_reference_t<decltype(sensor)>::measurements, 1>(noise);
    ASSERT_EQ(batch.update(sensor, y), jml::Status::ok);
    dense.measure(big(sensor.M), big(sensor.R), big(y));
  };
  if (pattern == Pattern::gaps_and_pairs) measure(single);  // of x_0
  for (int k = 0; k < steps; ++k) {
    const auto step = parts(k);
    ASSERT_EQ(batch.predict(step.dt), jml::Status::ok);
    dense.advance(big(step.F), big(step.G), big(step.Q), big(step.mean));
    if (pattern == Pattern::every_step) measure(pair);
    if (pattern == Pattern::gaps_and_pairs && k % 3 != 1) {
      if (k % 4 == 2) measure(single);
      measure(pair);
      if (k % 5 == 3) measure(pair);
      if (k % 7 == 0) measure(single);
    }
  }
  dense.solve();
  const auto report = batch.solve();
  ASSERT_EQ(report.status, jml::Status::ok);
  EXPECT_LE(report.iterations, 2);
  EXPECT_NEAR(report.cost, dense.cost(), 1e-12 * (1 + dense.cost()));

  // Each quantity in its own unit: the largest of it along the interval, by component.
  Vector<double, n> x_size = Vector<double, n>::Zero(), P_size = x_size;
  Vector<double, q> w_size = Vector<double, q>::Zero();
  for (int k = 0; k <= steps; ++k) {
    x_size = x_size.cwiseMax(dense.x(k).cwiseAbs()).eval();
    P_size = P_size.cwiseMax(dense.P(k).diagonal()).eval();
    if (k < steps) w_size = w_size.cwiseMax(dense.w(k).cwiseAbs()).eval();
  }
  constexpr double bound = 1e-12;
  int visited = 0, lost = 0;
  const auto check = [&](int k, const Matrix<double, n, n>& P) {
    const Matrix<double, n, n> expected = dense.P(k), transposed = P.transpose();
    EXPECT_EQ(k, visited++);
    if (!jml::all_finite(P)) {  // without noise P may have correlations that no matrix of doubles can hold
      const Big root = batch_tests::lower_root(big(expected));
      long double least = 1;
      for (int i = 0; i < n; ++i) least = std::min<long double>(least, root(i, i) * root(i, i) / big(expected)(i, i));
      EXPECT_LT(least, 1e-10L) << "P of node " << k;
      ++lost;
      return;
    }
    EXPECT_EQ(P, transposed);
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i)
        EXPECT_NEAR(P(i, j), expected(i, j), bound * std::sqrt(P_size(i) * P_size(j))) << "P of node " << k;
    }
  };
  const bool all = batch.covariances(check);
  EXPECT_EQ(all, lost == 0);
  EXPECT_EQ(visited, steps + 1);
  for (const int k : {0, 7, steps}) {
    visited = k;
    check(k, batch.P(k));
  }
  for (int k = 0; k <= steps; ++k) {
    const Vector<double, n> x = dense.x(k);
    for (int i = 0; i < n; ++i) EXPECT_NEAR(batch.x(k)(i), x(i), bound * x_size(i)) << "x of node " << k;
    if (k == steps) break;
    const Vector<double, q> w = dense.w(k);
    for (int i = 0; i < q; ++i) EXPECT_NEAR(batch.w(k)(i), w(i), bound * w_size(i)) << "w of node " << k;
  }
}

template <int q>
struct Step {
  Matrix<double, 4, 4> F;
  Matrix<double, 4, q> G;
  Matrix<double, q, q> Q;
  Vector<double, q> mean = Vector<double, q>::Zero();
  double dt = 0;
};

/// x̂_0, and P_0 of the given rank.
jml::Estimate<double, 4> prior_of_rank(int rank, unsigned seed) {
  jml::Noise noise(seed);
  jml::Estimate<double, 4> prior;
  prior.x = models::random_matrix<4, 1>(noise);
  const Matrix<double, 4, 4> root = models::random_matrix<4, 4>(noise);
  for (int k = 0; k < rank; ++k) {
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 4; ++i) prior.P(i, j) += root(i, k) * root(j, k);
    }
  }
  return prior;
}

template <int q>
models::LinearDynamics<4, q> random_dynamics(unsigned seed) {
  jml::Noise noise(seed);
  auto d = models::random_linear_dynamics<4, q>(noise);
  d.F += 0.3 * Matrix<double, 4, 4>::Identity();
  return d;
}

template <int q>
void every_prior_and_pattern(const models::LinearDynamics<4, q>& d, unsigned seed) {
  const auto parts = [&](int) { return Step<q>{d.F, d.G, d.Q}; };
  for (const int rank : {4, 2, 0}) {
    for (const Pattern pattern : {Pattern::every_step, Pattern::gaps_and_pairs}) {
      SCOPED_TRACE(testing::Message() << "rank of P_0 " << rank << ", pattern " << static_cast<int>(pattern));
      expect_the_smoother(d, prior_of_rank(rank, seed), pattern, parts, seed + 1);
    }
  }
}

TEST(BatchLinear, RankOneNoise) { every_prior_and_pattern(random_dynamics<1>(11), 110); }

TEST(BatchLinear, TwoDisturbances) { every_prior_and_pattern(random_dynamics<2>(12), 120); }

TEST(BatchLinear, AsManyDisturbancesAsStates) { every_prior_and_pattern(random_dynamics<4>(13), 130); }

// Q = c cᵀ: two disturbances that are one.
TEST(BatchLinear, SingularQ) {
  auto d = random_dynamics<2>(14);
  d.Q << 0.36, -0.24, -0.24, 0.16;
  every_prior_and_pattern(d, 140);
  d.Q << 0, 0, 0, 0.16;
  every_prior_and_pattern(d, 150);
  d.Q.setZero();
  every_prior_and_pattern(d, 160);
}

/// Not centred: w has a mean.
struct Pushed : models::LinearDynamics<4, 2> {
  Vector<double, 2> mean{0.7, -1.3};
  Vector<double, 2> disturbance_mean() const { return mean; }
};

TEST(BatchLinear, DisturbanceWithAMean) {
  const Pushed d{random_dynamics<2>(17)};
  const auto parts = [&](int) { return Step<2>{d.F, d.G, d.Q, d.mean}; };
  expect_the_smoother(d, prior_of_rank(4, 170), Pattern::every_step, parts, 171);
  expect_the_smoother(d, prior_of_rank(0, 172), Pattern::gaps_and_pairs, parts, 173);
  expect_the_smoother(d, prior_of_rank(2, 174), Pattern::none_at_all, parts, 175);
}

// dt from 0 to 3 s; F and Q are those of each step.
TEST(BatchLinear, IrregularSteps) {
  const models::ConstantVelocity d;
  const auto parts = [&](int k) {
    const double dt = k % 6 == 4 ? 0 : 0.05 + 0.4 * (k % 5) + (k == 9 ? 1.35 : 0);
    Step<4> step{Matrix<double, 4, 4>::Identity(), Matrix<double, 4, 4>::Identity(), {}, {}, dt};
    step.F(0, 1) = step.F(2, 3) = dt;
    step.Q.setZero();
    for (int i = 0; i < 4; i += 2) {
      step.Q(i, i) = d.q_c * dt * dt * dt / 3;
      step.Q(i, i + 1) = step.Q(i + 1, i) = d.q_c * dt * dt / 2;
      step.Q(i + 1, i + 1) = d.q_c * dt;
    }
    step.mean.setZero();
    return step;
  };
  for (const int rank : {4, 1, 0}) {
    expect_the_smoother(d, prior_of_rank(rank, 180), Pattern::every_step, parts, 181);
    expect_the_smoother(d, prior_of_rank(rank, 182), Pattern::gaps_and_pairs, parts, 183);
  }
}

// The same recursion in single precision, 24 bits; the interval may cost six of them.
TEST(BatchLinear, InFloat) {
  constexpr int steps = 20;
  const auto d = random_dynamics<2>(19);
  const auto prior = prior_of_rank(4, 190);
  jml::Noise noise(191);
  const Pair sensor = models::random_linear_sensor<4, 2>(noise);
  const jml::Estimate<float, 4> prior_in_float{prior.x.cast<float>(), prior.P.cast<float>()};
  jml::Batch batch{d, jml::sensors<Pair>, prior_in_float, {steps}};
  DenseSmoother dense(big(prior.x), big(prior.P), 2, steps);
  for (int k = 0; k < steps; ++k) {
    const auto y = models::random_matrix<2, 1>(noise);
    ASSERT_EQ(batch.step(sensor, y.cast<float>()), jml::Status::ok);
    dense.advance(big(d.F), big(d.G), big(d.Q), Big::Zero(2, 1));
    dense.measure(big(sensor.M), big(sensor.R), big(y));
  }
  dense.solve();
  const jml::BatchReport<float> report = batch.solve();
  EXPECT_EQ(report.status, jml::Status::ok);
  EXPECT_LE(report.iterations, 2);
  EXPECT_NEAR(static_cast<double>(report.cost), dense.cost(), 1e-6 * dense.cost());
  double x_error = 0, w_error = 0, P_error = 0, x_size = 0, w_size = 0, P_size = 0;
  const auto compare = [](const Eigen::VectorXd& got, const Eigen::VectorXd& expected, double& error,
                          double& size) {
    error = std::max(error, (got - expected).cwiseAbs().maxCoeff());
    size = std::max(size, expected.cwiseAbs().maxCoeff());
  };
  EXPECT_TRUE(batch.covariances([&](int k, const Matrix<float, 4, 4>& P) {
    compare(P.cast<double>().reshaped(), dense.P(k).reshaped(), P_error, P_size);
    compare(batch.x(k).cast<double>(), dense.x(k), x_error, x_size);
    if (k < steps) compare(batch.w(k).cast<double>(), dense.w(k), w_error, w_size);
  }));
  EXPECT_LE(x_error, 4e-6 * x_size);
  EXPECT_LE(w_error, 4e-6 * w_size);
  EXPECT_LE(P_error, 4e-6 * P_size);
}

}  // namespace
