// SPDX-License-Identifier: BSD-3-Clause
// The recursion's choices: where A and B are evaluated, the reference of the SDC matrices, a disturbance with
// a mean, models that read time, dt and control, and the gate.
#include <gtest/gtest.h>

#include <jml/filter/pure.hpp>

#include "models/linear.hpp"
#include "models/polynomial.hpp"
#include "riccati/oracle.hpp"

namespace {

using namespace jml::operators;

using oracle::big;
using oracle::Big;
using Dynamics = models::Polynomial<4>;
using Sensor = models::PolynomialSensor<4, 2>;
using Vector4 = jml::Vector<double, 4>;
using Matrix4 = jml::Matrix<double, 4, 4>;
using Vector2 = jml::Vector<double, 2>;

constexpr double tolerance = 1e-13;  // some 400 ε; condition numbers here are below 100

struct Scene {
  Dynamics dynamics{.constant = 1};
  Sensor sensor{.constant = 1};
  jml::Estimate<double, 4> prior;
  Vector2 y;
  Scene() {
    jml::Noise noise(41);
    prior.x = models::random_matrix<4, 1>(noise);
    prior.P = models::random_covariance<4>(noise, 0.2);
    y = sensor.measurement(dynamics.dynamics(prior.x)) + 0.3 * models::random_matrix<2, 1>(noise);
  }
  Big noise() const {
    const Big G = big(dynamics.disturbance_input());
    return G * big(dynamics.disturbance_covariance()) * G.transpose();
  }
  oracle::Slots slots(const Matrix4& A, const Matrix4& B, const jml::Matrix<double, 2, 4>& D,
                      const jml::Matrix<double, 2, 4>& E) const {
    return {big(A), big(B), big(D), big(E), noise(), big(sensor.noise_covariance())};
  }
  template <typename Rule>
  void expect(const Rule& rule, const oracle::Slots& slots) const {
    const auto got = jml::step(rule, dynamics, sensor, prior, y);
    ASSERT_EQ(got.report.status, jml::Status::ok);
    const Vector4 f = dynamics.dynamics(prior.x);
    const auto wanted =
        oracle::push_through(slots, big(f), big(prior.P), big(y) - big(sensor.measurement(f)));
    EXPECT_LT(oracle::distance(got.estimate.P, wanted.P), tolerance);
    EXPECT_LT(oracle::distance(got.estimate.x, wanted.x), tolerance);
  }
};

TEST(EvaluatedAt, PredictionMovesTheSlotsOfTheDynamicsAlone) {
  const Scene s;
  constexpr auto printed = jml::EvaluatedAt::prediction;
  const Vector4 f = s.dynamics.dynamics(s.prior.x);
  const auto f_x = s.dynamics.dynamics_jacobian(f), F = s.dynamics.dynamics_sdc(f);
  const auto m_x = s.sensor.measurement_jacobian(f), M = s.sensor.measurement_sdc(f);
  s.expect(jml::Ekf<printed>{}, s.slots(f_x, f_x, m_x, m_x));
  s.expect(jml::Sddre<jml::AboutOrigin, printed>{}, s.slots(F, F, M, M));
  s.expect(jml::Jml<jml::AboutOrigin, printed>{}, s.slots(F, f_x, m_x, M));
  EXPECT_GT((f_x - s.dynamics.dynamics_jacobian(s.prior.x)).norm(), 0.1) << "else this test has no power";
}

TEST(Reference, AboutTheEstimateAllThreeRulesAreTheEkf) {
  const Scene s;
  const auto ekf = jml::step(jml::Ekf{}, s.dynamics, s.sensor, s.prior, s.y);
  const auto check = [&](const auto& rule) {
    const auto got = jml::step(rule, s.dynamics, s.sensor, s.prior, s.y);
    EXPECT_LT(oracle::distance(got.estimate.x, big(ekf.estimate.x)), tolerance);
    EXPECT_LT(oracle::distance(got.estimate.P, big(ekf.estimate.P)), tolerance);
  };
  check(jml::Sddre{jml::AboutEstimate{}});
  check(jml::Jml{jml::AboutEstimate{}});
}

/// ∫₀¹ J(r + s (x - r)) ds by Simpson's rule with 200 panels: exact for the quadratic and cubic models here.
template <int rows, typename Jacobian>
jml::Matrix<double, rows, 4> mean_jacobian(const Jacobian& jacobian, const Vector4& x, const Vector4& r) {
  jml::Matrix<double, rows, 4> sum = jml::Matrix<double, rows, 4>::Zero();
  for (int i = 0; i <= 200; ++i) {
    const Vector4 between = r + (x - r) * (i / 200.0);
    sum += jacobian(between) * ((i == 0 || i == 200 ? 1 : i % 2 == 1 ? 4 : 2) / 600.0);
  }
  return sum;
}

TEST(Reference, AboutAPointTheMatricesAreTheMeanJacobiansFromThere) {
  const Scene s;
  const Vector4 r(0.4, -1, 0.3, 0.7), f = s.dynamics.dynamics(s.prior.x);
  const Matrix4 f_x = s.dynamics.dynamics_jacobian(s.prior.x);
  const auto m_x = s.sensor.measurement_jacobian(f);
  const Matrix4 F =
      mean_jacobian<4>([&](const Vector4& x) { return s.dynamics.dynamics_jacobian(x); }, s.prior.x, r);
  const jml::Matrix<double, 2, 4> M =
      mean_jacobian<2>([&](const Vector4& x) { return s.sensor.measurement_jacobian(x); }, f, r);
  // What makes it a SDC matrix, whatever the quadrature: F (x - r) = f(x) - f(r).
  ASSERT_LT((F * (s.prior.x - r) - (f - s.dynamics.dynamics(r))).norm(), 1e-14);
  s.expect(jml::Sddre{jml::AboutPoint{r}}, s.slots(F, F, M, M));
  s.expect(jml::Jml{jml::AboutPoint{r}}, s.slots(F, f_x, m_x, M));
}

/// A known push w̄ on top of the noise.
struct Pushed : Dynamics {
  Vector2 disturbance_mean() const { return {0.3, -0.7}; }
};

TEST(DisturbanceMean, MovesThePredictionThroughG) {
  const Scene s;
  Pushed pushed;
  pushed.constant = 1;
  const Matrix4 f_x = s.dynamics.dynamics_jacobian(s.prior.x);
  const Vector4 prediction =
      s.dynamics.dynamics(s.prior.x) + s.dynamics.disturbance_input() * Vector2(0.3, -0.7);
  const auto m_x = s.sensor.measurement_jacobian(prediction);
  const auto got = jml::step(jml::Ekf{}, pushed, s.sensor, s.prior, s.y);
  const auto wanted = oracle::joseph(s.slots(f_x, f_x, m_x, m_x), big(prediction), big(s.prior.P),
                                     big(s.y) - big(s.sensor.measurement(prediction)));
  ASSERT_EQ(got.report.status, jml::Status::ok);
  EXPECT_LT(oracle::distance(got.estimate.x, wanted.x), tolerance);
  EXPECT_LT(oracle::distance(got.estimate.P, wanted.P), tolerance);
  const auto predicted = jml::predict(jml::Ekf{}, pushed, s.prior);
  EXPECT_LT(oracle::distance(predicted.estimate.x, big(prediction)), tolerance);
}

/// x⁺ = x + dt (u + time), Q = (1 + time) dt², y = x + 100 · time of the sample, R = 1 + time.
struct Clocked {
  static constexpr int states = 1, disturbances = 1, controls = 1;
  static constexpr bool linear = true;
  using X = jml::Vector<double, 1>;
  using At = jml::StepContext<double, 1>;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(x(0) + at.dt * (at.control(0) + at.time));
  }
  X disturbance_covariance(const X&, const At& at) const { return X((1 + at.time) * at.dt * at.dt); }
};
struct ClockedSensor {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T, typename At>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(x(0) + 100 * at.time);
  }
  template <typename At>
  jml::Vector<double, 1> noise_covariance(const jml::Vector<double, 1>&, const At& at) const {
    return jml::Vector<double, 1>(1 + at.time);
  }
};

TEST(StepContext, StepReadsTheStartAndTheSensorTheEnd) {
  using X = jml::Vector<double, 1>;
  jml::Filter filter{jml::Kalman{}, Clocked{}, jml::Estimate{X(2), X(3)}, 10};
  double x = 2, P = 3, time = 10;
  for (const double dt : {0.5, 0.25, 1.0, 0.0}) {
    const double control = 4 * dt - 1, y = 1003 + 100 * dt;
    ASSERT_EQ(filter.step(ClockedSensor{}, y, dt, X(control)).status, jml::Status::ok);
    x += dt * (control + time);
    P += (1 + time) * dt * dt;
    time += dt;
    const double R = 1 + time;
    x += P / (P + R) * (y - x - 100 * time);
    P = P * R / (P + R);
    EXPECT_NEAR(filter.x()(0), x, 1e-12 * std::abs(x));
    EXPECT_NEAR(filter.P()(0), P, 1e-14 * P);
    EXPECT_EQ(filter.time(), time);
  }
  ASSERT_EQ(filter.predict(2.0, X(-1)), jml::Status::ok);
  EXPECT_NEAR(filter.x()(0), x + 2 * (time - 1), 1e-12 * std::abs(x));
  EXPECT_EQ(filter.time(), time + 2);
  x = filter.x()(0);
  P = filter.P()(0);
  ASSERT_EQ(filter.update(ClockedSensor{}, 1380.0).status, jml::Status::ok);
  const double R = 1 + time + 2;
  EXPECT_NEAR(filter.x()(0), x + P / (P + R) * (1380 - x - 100 * (time + 2)), 1e-12 * 1380);
  EXPECT_EQ(filter.time(), time + 2) << "an update takes no time";
}

TEST(GateVerdict, RejectedLeavesThePredictionAcceptedDoesNot) {
  const Scene s;
  const auto check = [&](const auto& rule) {
    jml::Filter plain{rule, s.dynamics, s.prior};
    ASSERT_EQ(plain.predict(), jml::Status::ok);
    jml::Filter gated{rule, s.dynamics, s.prior};
    gated.gate = {0.999};
    const auto rejected = gated.step(s.sensor, s.y + Vector2(60, 0));
    EXPECT_EQ(rejected.status, jml::Status::ok);
    EXPECT_EQ(rejected.gate, jml::Verdict::rejected);
    EXPECT_GT(rejected.nis(), 13.816);  // 99.9 % of χ² with two degrees
    EXPECT_EQ(gated.x(), plain.x());
    EXPECT_EQ(gated.P(), plain.P());

    jml::Filter open{rule, s.dynamics, s.prior}, barely{rule, s.dynamics, s.prior};
    barely.gate = {0.999};
    EXPECT_EQ(open.step(s.sensor, s.y).gate, jml::Verdict::off);
    const auto accepted = barely.step(s.sensor, s.y);
    EXPECT_EQ(accepted.gate, jml::Verdict::accepted);
    EXPECT_EQ(barely.x(), open.x());
    EXPECT_EQ(barely.P(), open.P());
    // NIS by the oracle's inverse, from the symmetric part of S.
    const Big S = (big(accepted.innovation_matrix) + big(accepted.innovation_matrix).transpose()) / 2;
    const Big nis = big(accepted.innovation).transpose() * oracle::inverse(S) * big(accepted.innovation);
    EXPECT_NEAR(accepted.nis(), static_cast<double>(nis(0, 0)), 1e-12 * accepted.nis());
  };
  check(jml::Ekf{});
  check(jml::Sddre{});
  check(jml::Jml{});
}

}  // namespace
