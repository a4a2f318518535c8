// SPDX-License-Identifier: BSD-3-Clause
// The factored form in continuous time: against solutions in many digits, closed forms, and where the plain
// form has no digit.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <jml/continuous/factored_continuous.hpp>

#include "continuous/continuous_check.hpp"

namespace {

using namespace jml::operators;
using continuous_check::OscillatorCase;
using continuous_check::TimeVaryingCase;
using jml::Status;
using Square = jml::Matrix<double, 2, 2>;
using X = jml::Vector<double, 2>;

template <typename Rule>
auto factored(const Rule& rule, int substeps = 1) {
  return jml::Factored{jml::Continuous{rule, jml::RungeKutta4{substeps}}};
}

/// Largest distance from the reference, as continuous_check::error().
template <typename Case, typename Rule, typename Samples>
double error(const Rule& rule, const Samples& samples, int intervals_per_second, double last) {
  const Case c{};
  jml::Filter filter{factored(rule), c.dynamics, Case::start()};
  double worst = 0;
  for (const auto& sample : samples) {
    if (sample.time > last) break;
    const double begin = filter.time();
    const int count = static_cast<int>(std::lround((sample.time - begin) * intervals_per_second));
    for (int i = 0; i < count; ++i) {
      const double dt = begin + (sample.time - begin) * (i + 1) / count - filter.time();
      const auto report = filter.step(c.sensor, [](double t) { return Case::y(t); }, dt, c.control);
      if (report.status != Status::ok) return INFINITY;
    }
    worst =
        std::max(worst, continuous_check::distance(filter.estimate(), continuous_check::estimate_of(sample)));
  }
  return worst;
}

// Fourth order to the published rows of Table 1, under a measurement that is there all the time.
TEST(FactoredContinuous, ConvergesToTheReferenceWithOrderFour) {
  const auto expect_order_four = [](double coarse, double fine) {
    EXPECT_LT(fine, 2e-6);
    EXPECT_NEAR(continuous_check::order(coarse, fine, 2), 4, 0.4);
  };
  expect_order_four(error<OscillatorCase>(jml::Ekf{}, OscillatorCase::ekf, 400, 2),
                    error<OscillatorCase>(jml::Ekf{}, OscillatorCase::ekf, 800, 2));
  expect_order_four(error<TimeVaryingCase>(jml::Sddre{}, TimeVaryingCase::sddre, 160, 5),
                    error<TimeVaryingCase>(jml::Sddre{}, TimeVaryingCase::sddre, 320, 5));
}

// Ṗ = Q - P²/R of a random walk has the solution √(QR) tanh(√(Q/R) t) from zero. Steps as long as the alarm
// lets pass, and P stays positive; at rest it is √(QR) to the order of the step.
struct Walk {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(T(0) * x(0));
  }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(4.0); }
};
struct Position {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(0.25); }
};
TEST(FactoredContinuous, RandomWalkFromAnExactStart) {
  const jml::Estimate exact{jml::Vector<double, 1>(0.0), jml::Matrix<double, 1, 1>(0.0)};
  jml::Filter filter{factored(jml::Kalman{}, 4), Walk{}, exact};
  for (int k = 1; k <= 40; ++k) {
    ASSERT_EQ(filter.step(Position{}, 0.0, 0.02).status, Status::ok);
    EXPECT_NEAR(filter.P()(0, 0), std::tanh(4 * 0.02 * k), 1e-8);
  }
  filter.method().rule.integrator.substeps = 1;
  for (int k = 0; k < 50; ++k) {
    ASSERT_EQ(filter.step(Position{}, 0.0, 0.25).status, Status::ok);
    EXPECT_GT(filter.P()(0, 0), 0.9);
    EXPECT_LT(filter.P()(0, 0), 1.1);
  }
}

// What is refused leaves the last good estimate.
TEST(FactoredContinuous, Refusals) {
  const OscillatorCase c{};
  jml::Filter filter{factored(jml::Ekf{}), c.dynamics, OscillatorCase::start()};
  const X x = filter.x();
  const Square P = filter.P();
  const auto expect = [&](Status found, Status status) {
    EXPECT_EQ(found, status);
    EXPECT_EQ(filter.x(), x);
    EXPECT_EQ(filter.P(), P);
    EXPECT_EQ(filter.time(), 0);
  };
  expect(filter.step(c.sensor, NAN, 0.01).status, Status::invalid_measurement);
  expect(filter.step(c.sensor, 1.0, 10.0).status, Status::step_too_long);
  expect(filter.predict(1e200), Status::step_too_long);
  expect(filter.predict(-0.1), Status::invalid_time_step);
  filter.method().rule.integrator.substeps = 0;
  expect(filter.predict(0.1), Status::invalid_option);

  const double unknown = std::numeric_limits<double>::infinity();
  jml::Filter diffuse{factored(jml::Ekf{}), c.dynamics,
                      jml::Estimate{x, Square(Eigen::Vector2d(unknown, 1).asDiagonal())}};
  EXPECT_EQ(diffuse.status(), Status::ok);
  EXPECT_EQ(diffuse.step(c.sensor, 1.0, 0.01).status, Status::step_too_long);
  EXPECT_EQ(diffuse.predict(0.01), Status::ok);
}

// An element with couplings that no step is short enough to hide: its rows, motion and noise give the
// covariance of T x + N w given H x + M w + v = z, by the information of (x, w) inverted as a whole.
TEST(FactoredContinuous, ElementIsTheJointProblem) {
  constexpr int n = 2, q = 3, p = 4, m = n + q;
  Square T, P;
  T << 1, 0.4, -0.3, 0.8;
  P << 2, 0.5, 0.5, 1;
  jml::Matrix<double, n, q> N;
  N << 0.7, -0.2, 0.5, 0.1, 0.9, -0.6;
  jml::Matrix<double, p, n> H;
  H << 1, 0.2, -0.5, 0.8, 0.3, -1, 0.6, 0.4;
  jml::Matrix<double, p, q> M;
  M << 0.5, -0.7, 0.2, 0.9, 0.4, -0.3, -0.6, 0.1, 0.8, 0.2, 1.1, 0.7;
  jml::detail::FlowElement<double, n, q, p> element;
  ASSERT_TRUE(element.form(T, N, H, M));

  const Eigen::Matrix<double, p, n> rows = element.rows;
  const Eigen::Matrix<double, n, n> prior = P, motion = element.transition;
  const Eigen::Matrix<double, n, q> noise = element.noise;
  const Eigen::DiagonalMatrix<double, p> weights(
      Eigen::Matrix<double, p, 1>(element.row_variances).cwiseInverse());
  const Eigen::DiagonalMatrix<double, q> variances(Eigen::Matrix<double, q, 1>(element.variances));
  const Eigen::Matrix2d given = (prior.inverse() + rows.transpose() * weights * rows).inverse();
  const Eigen::Matrix2d found = motion * given * motion.transpose() + noise * variances * noise.transpose();

  Eigen::Matrix<double, m, m> information = Eigen::Matrix<double, m, m>::Identity();
  information.topLeftCorner<n, n>() = prior.inverse();
  Eigen::Matrix<double, p, m> seen;
  seen << H, M;
  information += seen.transpose() * seen;
  Eigen::Matrix<double, n, m> moved;
  moved << T, N;
  const Eigen::Matrix2d right = moved * information.inverse() * moved.transpose();
  EXPECT_LT((found - right).norm(), 1e-14 * right.norm());
}

}  // namespace
