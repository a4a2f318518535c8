// SPDX-License-Identifier: BSD-3-Clause
// Continuous dynamics with discrete measurements, and what a measurement does between its samples.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <jml/continuous/continuous.hpp>
#include <jml/continuous/factored_continuous.hpp>
#include <jml/riccati/davison_maki.hpp>

#include "models/continuous.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using jml::DavisonMaki;
using jml::RungeKutta4;
using jml::Status;
using Square = jml::Matrix<double, 2, 2>;
using X = jml::Vector<double, 2>;

/// ξ'' = w of density q.
struct DoubleIntegrator {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  static constexpr bool linear = true;
  double q = 0.7;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1), T(0)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(q); }
};
struct PositionSample {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double r = 0.09;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};

// The discrete Kalman filter with Φ = [1 h; 0 1] and the integrated noise q [h³/3 h²/2; h²/2 h], by hand.
template <typename Method>
void expect_kalman(const Method& method) {
  X x(1, -0.5);
  Square P;
  P << 0.5, 0.1, 0.1, 0.8;
  jml::Filter filter{method, DoubleIntegrator{}, jml::Estimate{x, P}};
  const double lengths[] = {0.1, 0.4, 0.02, 1.0};
  for (int k = 0; k < 40; ++k) {
    const double h = lengths[k % 4], y = std::sin(0.3 * k);
    Square transition, noise;
    transition << 1, h, 0, 1;
    noise << h * h * h / 3, h * h / 2, h * h / 2, h;
    x = (transition * x).eval();
    P = (transition * P * transition.transpose() + 0.7 * noise).eval();
    const double S = P(0, 0) + 0.09, innovation = y - x(0);
    const X K = P.col(0) / S;
    x += K * innovation;
    P -= (K * P.row(0)).eval();
    const auto report = filter.step(PositionSample{}, y, h);
    ASSERT_EQ(report.status, Status::ok);
    EXPECT_NEAR(report.innovation(0), innovation, 1e-10);
    EXPECT_NEAR(report.innovation_matrix(0, 0), S, 1e-10);
    EXPECT_LT((filter.x() - x).norm(), 1e-10);
    EXPECT_LT((filter.P() - P).norm(), 1e-10);
  }
}
TEST(Samples, LinearCaseIsTheKalmanFilter) {
  expect_kalman(jml::Continuous{jml::Kalman{}, DavisonMaki{}});
  expect_kalman(jml::Continuous{jml::Ekf{}, DavisonMaki{}});
  expect_kalman(jml::Continuous{jml::Rnls{}, DavisonMaki{}});
  expect_kalman(jml::Continuous{jml::Kalman{}, RungeKutta4{}});  // polynomials of degree 3: exact, too
  expect_kalman(jml::Factored{jml::Continuous{jml::Kalman{}}});
}

TEST(Samples, StepIsPredictThenUpdate) {
  const jml::Estimate start{X(1.5, 0.5), Square(0.3 * Square::Identity())};
  jml::Filter one{jml::Continuous{jml::Rnls{}, DavisonMaki{4}}, models::Oscillator{}, start}, two = one;
  for (int k = 0; k < 10; ++k) {
    const double y = 0.6 - 0.05 * k;
    const auto report = one.step(models::SaturatingPosition{}, y, 0.05);
    ASSERT_EQ(two.predict(0.05), Status::ok);
    const auto other = two.update(models::SaturatingPosition{}, y);
    ASSERT_EQ(report.status, Status::ok);
    ASSERT_EQ(other.status, Status::ok);
    EXPECT_EQ(one.x(), two.x());
    EXPECT_EQ(one.P(), two.P());
    EXPECT_EQ(one.time(), two.time());
    EXPECT_EQ(report.innovation, other.innovation);
    EXPECT_EQ(report.gain, other.gain);
  }
  EXPECT_NE(one.P()(0, 1), one.P()(1, 0));
}

TEST(Samples, ARefusedSampleUndoesThePrediction) {
  const jml::Estimate start{X(1.5, 0.5), Square(0.3 * Square::Identity())};
  jml::Filter filter{jml::Continuous{jml::Rnls{}, DavisonMaki{}}, models::Oscillator{}, start};
  EXPECT_EQ(filter.step(models::SaturatingPosition{}, std::nan(""), 0.05).status,
            Status::invalid_measurement);
  models::SaturatingPosition bad;
  bad.r = -1;
  EXPECT_EQ(filter.step(bad, 0.5, 0.05).status, Status::invalid_noise_covariance);
  EXPECT_EQ(filter.x(), start.x);
  EXPECT_EQ(filter.P(), start.P);
  EXPECT_EQ(filter.time(), 0);
}

TEST(Samples, GateRejectsAndTimeGoesOn) {
  const jml::Estimate start{X(1, -0.5), Square(0.3 * Square::Identity())};
  jml::Filter filter{jml::Continuous{jml::Kalman{}, DavisonMaki{}}, DoubleIntegrator{}, start}, free = filter;
  filter.gate = {0.999};
  const auto far = filter.step(PositionSample{}, 50.0, 0.1);
  EXPECT_EQ(far.status, Status::ok);
  EXPECT_EQ(far.gate, jml::Verdict::rejected);
  ASSERT_EQ(free.predict(0.1), Status::ok);
  EXPECT_EQ(filter.P(), free.P());
  EXPECT_EQ(filter.x(), free.x());
  EXPECT_EQ(filter.time(), 0.1);
  EXPECT_EQ(filter.step(PositionSample{}, 1.0, 0.1).gate, jml::Verdict::accepted);
}

/// ẋ = 0; an angle that is measured all the time.
struct Resting {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>&) const {
    return jml::Vector<T, 1>(T(0));
  }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(4); }
};
struct Angle {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  template <typename T>
  jml::Vector<T, 1> residual(const jml::Vector<T, 1>& y, const jml::Vector<T, 1>& z) const {
    using std::remainder;
    return jml::Vector<T, 1>(T(remainder(y(0) - z(0), 6.283185307179586)));
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(0.01); }
};

// At the equilibrium P = √(QR) = 0.2 the gain is 20 /s, and x̂ follows the ramp y = a + b t from x̂ = y with
// the lag b (1 - e^{-20 t})/20. Across ±π the ramp goes on.
TEST(Signals, LineAcrossPiTakesTheShortWay) {
  const double pi = 3.141592653589793, a = pi - 0.05, b = 2.0, dt = 0.05;
  const auto expect = [&](const auto& integrator, double tolerance) {
    jml::Filter filter{jml::Continuous{jml::Ekf{}, integrator}, Resting{},
                       jml::Estimate{jml::Vector<double, 1>(a), jml::Matrix<double, 1, 1>(0.2)}};
    const auto report = filter.step(Angle{}, jml::Line{a, a + b * dt - 2 * pi}, dt);
    ASSERT_EQ(report.status, Status::ok);
    EXPECT_NEAR(filter.x()(0), a + b * dt - b * (1 - std::exp(-20 * dt)) / 20, tolerance);
    EXPECT_NEAR(filter.P()(0, 0), 0.2, 1e-12);
  };
  expect(RungeKutta4{100}, 1e-8);
  expect(DavisonMaki{1000}, 1e-6);
}

// A line is the function of time that it draws, and the report is that of the start.
TEST(Signals, LineIsAFunction) {
  const jml::Estimate start{X(1, 0.5), Square(0.001 * Square::Identity())};
  jml::Filter line{jml::Continuous{jml::Rnls{}, RungeKutta4{10}}, models::Oscillator{}, start, 2.0},
      function = line;
  const auto report = line.step(models::SaturatingSignal{}, jml::Line{0.6, 0.62}, 0.01);
  ASSERT_EQ(report.status, Status::ok);
  ASSERT_EQ(function
                .step(
                    models::SaturatingSignal{},
                    [](double t) { return jml::Vector<double, 1>(0.6 + 2 * (t - 2)); }, 0.01)
                .status,
            Status::ok);
  EXPECT_LT((line.x() - function.x()).norm(), 1e-13);
  EXPECT_NEAR(report.innovation(0), 0.6 - 1 / std::sqrt(2), 1e-15);
  EXPECT_NEAR(report.gain(0), 0.001 * std::pow(2, -1.5) / 1e-5, 1e-11);
  EXPECT_EQ(report.steps, 10);
}

// Two positions of a double integrator make a line: P of it by hand, of a P_0 that is infinite or as good as
// that.
TEST(Samples, ADiffuseStartIsResolved) {
  constexpr double h = 0.5, r = 0.09, q = 0.7, y0 = 3, y1 = 4;
  for (const double unknown : {std::numeric_limits<double>::infinity(), 1e20}) {
    const jml::Estimate start{
        X(0, 0), Square(unknown == 1e20 ? Square(1e20 * Square::Identity())
                                        : Square(Eigen::Vector2d(unknown, unknown).asDiagonal()))};
    jml::Filter filter{jml::Factored{jml::Continuous{jml::Kalman{}}}, DoubleIntegrator{}, start};
    ASSERT_EQ(filter.status(), Status::ok);
    ASSERT_EQ(filter.update(PositionSample{}, y0).status, Status::ok);
    const auto report = filter.step(PositionSample{}, y1, h);
    ASSERT_EQ(report.status, Status::ok);
    EXPECT_TRUE(report.redone);
    EXPECT_NEAR(filter.x()(0), y1, 1e-12);
    EXPECT_NEAR(filter.x()(1), (y1 - y0) / h, 1e-12);
    const Square P = filter.P();
    EXPECT_NEAR(P(0, 0), r, 1e-12);
    EXPECT_NEAR(P(0, 1), r / h, 1e-12);
    EXPECT_NEAR(P(1, 1), 2 * r / (h * h) + q * h / 3, 1e-12);
  }
}

// A position that is as good as exact leaves P nearly singular: by hand, where the plain form names the loss
// or does it over.
TEST(Samples, AnExactPositionLeavesTheDigitsOfTheRest) {
  const jml::Estimate start{X(0, 0), Square(Square::Identity())};
  PositionSample exact;
  exact.r = 0;
  jml::Filter filter{jml::Factored{jml::Continuous{jml::Kalman{}}}, DoubleIntegrator{}, start};
  ASSERT_EQ(filter.step(exact, 1.0, 0.5).status, Status::ok);
  // N = [1 + h² + q h³/3, h + q h²/2; ., 1 + q h]
  const double a = 1 + 0.25 + 0.7 * 0.125 / 3, b = 0.5 + 0.7 * 0.25 / 2, c = 1 + 0.7 * 0.5;
  EXPECT_EQ(filter.P()(0, 0), 0);
  EXPECT_EQ(filter.x()(0), 1);
  EXPECT_NEAR(filter.P()(1, 1), c - b * b / a, 1e-14);
  EXPECT_NEAR(filter.x()(1), b / a, 1e-14);
  ASSERT_EQ(filter.update(exact, 1.0).status, Status::ok);  // said again: skipped
  EXPECT_EQ(filter.update(exact, 1.5).status, Status::contradiction);
  EXPECT_EQ(filter.x()(0), 1);
}

}  // namespace
