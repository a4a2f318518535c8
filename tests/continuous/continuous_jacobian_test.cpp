// SPDX-License-Identifier: BSD-3-Clause
// The Jacobian of the coupled equations (17), (19) that BDF uses, against central differences of their
// right-hand side.
#include <gtest/gtest.h>

#include <jml/riccati/differential_jacobian.hpp>

#include "models/continuous.hpp"
#include "models/linear.hpp"
#include "models/time_varying.hpp"

namespace {

using namespace jml::operators;

template <typename Rule, typename D, typename S>
void expect_jacobian(const D& d, const S& s, bool by_duals, double tolerance) {
  constexpr int n = D::states, p = S::measurements, size = n + n * n;
  jml::Noise noise(12);
  const Rule rule{};
  const jml::ProcessNoise<double, D> process_noise(d);
  const jml::Vector<double, p> y = models::random_matrix<p, 1>(noise);
  const auto signal = [&](double) { return y; };
  const jml::Vector<double, jml::DynamicsTraits<D>::controls> u =
      jml::Vector<double, jml::DynamicsTraits<D>::controls>::Constant(0.3);
  using F = jml::Flow<Rule, D, S, double, decltype(signal)>;
  F flow(rule, d, process_noise, s, signal, u);
  EXPECT_EQ(jml::differentiable<F>(), by_duals);
  const double time = 0.8;
  const jml::Vector<double, n> x = models::random_matrix<n, 1>(noise);
  jml::Matrix<double, n, n> P = models::random_covariance<n>(noise, 0.2);
  P += 0.1 * models::random_matrix<n, n>(noise);  // nonsymmetric
  ASSERT_EQ(flow.prepare(time, x), jml::Status::ok);
  jml::Matrix<double, size, size> J;
  ASSERT_TRUE(jml::flow_jacobian(flow, time, x, P, J));
  const auto rate = [&](const jml::Vector<double, size>& z) {
    typename F::X at_x = z.template head<n>(), dx = F::X::Zero();
    typename F::Square at_P = Eigen::Map<const typename F::Square>(z.data() + n), dP = F::Square::Zero();
    EXPECT_EQ(flow.derivative(time, at_x, at_P, dx, dP), jml::Status::ok);
    jml::Vector<double, size> out;
    out << dx, Eigen::Map<const jml::Vector<double, n * n>>(dP.data());
    return out;
  };
  jml::Vector<double, size> z;
  z << x, Eigen::Map<const jml::Vector<double, n * n>>(P.data());
  double worst = 0;
  for (int k = 0; k < size; ++k) {
    jml::Vector<double, size> up = z, down = z;
    up(k) += 1e-5;
    down(k) -= 1e-5;
    const jml::Vector<double, size> column = (rate(up) - rate(down)) / 2e-5;
    worst = std::max(worst, (column - J.col(k)).cwiseAbs().maxCoeff() / J.cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst, tolerance);
}

// Central differences at 1e-5 are good to 1e-9 here, relative to the largest entry. The EKF's right-hand side
// knows P to be symmetric and uses half of it only: there the columns along P(i, j) and P(j, i) are not those
// of the matrix equation, so only the nonsymmetric rule is compared entry by entry.
TEST(FlowJacobian, Chain) {
  expect_jacobian<jml::Rnls<>>(models::OscillatorChain{}, models::SaturatingSignals{0.5}, true, 1e-8);
}
TEST(FlowJacobian, TimeVarying) {
  expect_jacobian<jml::Rnls<>>(models::TimeVaryingPlant{}, models::TimeVaryingSensor{}, true, 1e-8);
}

/// The chain's formulas for double alone.
struct DoubleOnlyChain {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  jml::Vector<double, 2> dynamics(const jml::Vector<double, 2>& x) const {
    return models::Oscillator{}.dynamics(x);
  }
  jml::Matrix<double, 2, 2> dynamics_jacobian(const jml::Vector<double, 2>& x) const {
    return models::Oscillator{}.dynamics_jacobian(x);
  }
  jml::Matrix<double, 2, 2> dynamics_sdc(const jml::Vector<double, 2>& x) const {
    return models::Oscillator{}.dynamics_sdc(x);
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(1); }
};
TEST(FlowJacobian, DoubleAloneIsDoneByDifferences) {
  expect_jacobian<jml::Rnls<>>(DoubleOnlyChain{}, models::SaturatingSignal{0.5}, false,
                               1e-6);  // one-sided, √ε
}

// EKF on a symmetric P and along symmetric changes of it.
TEST(FlowJacobian, EkfAlongSymmetricChanges) {
  using D = models::TimeVaryingPlant;
  using S = models::TimeVaryingSensor;
  constexpr int n = 3, size = 12;
  const D d;
  const S s;
  const jml::Ekf<> rule;
  const jml::ProcessNoise<double, D> process_noise(d);
  const auto signal = [](double) { return jml::Vector<double, 2>(0.3, -0.2); };
  const jml::Vector<double, 1> u(0.3);
  using F = jml::Flow<jml::Ekf<>, D, S, double, decltype(signal)>;
  F flow(rule, d, process_noise, s, signal, u);
  jml::Noise noise(2);
  const jml::Vector<double, n> x = models::random_matrix<n, 1>(noise);
  const jml::Matrix<double, n, n> P = models::random_covariance<n>(noise, 0.2);
  ASSERT_EQ(flow.prepare(0.5, x), jml::Status::ok);
  jml::Matrix<double, size, size> J;
  ASSERT_TRUE(jml::flow_jacobian(flow, 0.5, x, P, J));
  for (int k = 0; k < 10; ++k) {
    const jml::Vector<double, n> v = models::random_matrix<n, 1>(noise);
    jml::Matrix<double, n, n> V = models::random_matrix<n, n>(noise);
    V = (V + V.transpose()).eval();
    typename F::X up = F::X::Zero(), down = up;
    typename F::Square up_P = F::Square::Zero(), down_P = up_P;
    const double h = 1e-5;
    ASSERT_EQ(flow.derivative(0.5, x + h * v, P + h * V, up, up_P), jml::Status::ok);
    ASSERT_EQ(flow.derivative(0.5, x - h * v, P - h * V, down, down_P), jml::Status::ok);
    jml::Vector<double, size> z;
    z << v, Eigen::Map<const jml::Vector<double, n * n>>(V.data());
    const jml::Vector<double, size> wanted = J * z;
    const double scale = wanted.cwiseAbs().maxCoeff();
    EXPECT_LT(((up - down) / (2 * h) - wanted.head<n>()).cwiseAbs().maxCoeff(), 1e-8 * scale);
    const jml::Matrix<double, n, n> slope = (up_P - down_P) / (2 * h);
    EXPECT_LT((slope - Eigen::Map<const jml::Matrix<double, n, n>>(wanted.data() + n)).cwiseAbs().maxCoeff(),
              1e-8 * scale);
  }
}

}  // namespace
