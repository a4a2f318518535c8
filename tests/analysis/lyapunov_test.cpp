// SPDX-License-Identifier: BSD-3-Clause
// V and its derivative, eq. (30), against differences along the filter itself, which the test integrates on
// its own: Runge-Kutta in long double, with explicit inverses.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <jml/analysis/lyapunov.hpp>

#include "models/continuous.hpp"
#include "models/linear.hpp"
#include "models/polynomial.hpp"
#include "models/stability.hpp"

namespace {

using namespace jml::operators;

using jml::Slot;
constexpr int n = 3, p = 2;
using M33 = jml::Matrix<long double, n, n>;
using M23 = jml::Matrix<long double, p, n>;
using M22 = jml::Matrix<long double, p, p>;
using X = jml::Vector<long double, n>;

struct Polynomial3 : models::Polynomial<n> {
  using time_domain = jml::ContinuousTime;
  jml::Matrix<double, 2, 2> disturbance_spectral_density() const {
    return models::Polynomial<n>::disturbance_covariance();
  }

 private:
  using models::Polynomial<n>::disturbance_covariance;
};
struct Signal : models::PolynomialSensor<n, p> {
  jml::Matrix<double, p, p> noise_spectral_density() const { return noise_covariance(); }
};

/// The matrices of the model at x, in long double; Q and R are constants.
struct Matrices {
  M33 F, f_x, noise;
  M23 M, m_x;
  M22 R;

  Matrices(const Polynomial3& d, const Signal& s, const X& x)
      : F(d.dynamics_sdc(x)),
        f_x(d.dynamics_jacobian(x)),
        M(s.measurement_sdc(x)),
        m_x(s.measurement_jacobian(x)) {
    const jml::Matrix<double, n, 2> G = d.disturbance_input();
    noise = (G * d.disturbance_spectral_density() * G.transpose()).cast<long double>();
    R = s.noise_covariance().cast<long double>();
  }
  const M33& dynamics(Slot slot) const { return slot == Slot::sdc ? F : f_x; }
  const M23& sensor(Slot slot) const { return slot == Slot::sdc ? M : m_x; }
};

struct State {
  X x;
  M33 P;
  State operator+(const State& other) const { return {x + other.x, P + other.P}; }
  State operator*(long double factor) const { return {factor * x, factor * P}; }
};

/// ẋ = f(x) - K m(x) and Ṗ of a rule.
template <typename Rule>
State motion(const Polynomial3& d, const Signal& s, const State& at) {
  const Matrices m(d, s, at.x);
  const M33 A = m.dynamics(Rule::A), B = m.dynamics(Rule::B);
  const M23 D = m.sensor(Rule::D), E = m.sensor(Rule::E);
  const jml::Matrix<long double, n, p> K = at.P * D.transpose() * m.R.inverse();
  return {d.dynamics(at.x) - K * s.measurement(at.x),
          A * at.P + at.P * B.transpose() + m.noise - K * E * at.P};
}

template <typename Rule>
State rk4(const Polynomial3& d, const Signal& s, State y, long double h) {
  const State k1 = motion<Rule>(d, s, y), k2 = motion<Rule>(d, s, y + k1 * (h / 2)),
              k3 = motion<Rule>(d, s, y + k2 * (h / 2)), k4 = motion<Rule>(d, s, y + k3 * h);
  return y + (k1 + k2 * 2 + k3 * 2 + k4) * (h / 6);
}

long double value(const State& y) {
  const M33 inverse = y.P.inverse();
  return (y.x.transpose() * (inverse + inverse.transpose()) * y.x)(0) / 2;
}

/// dV/dt by a central difference of fourth order, over one Runge-Kutta step.
template <typename Rule>
long double difference(const Polynomial3& d, const Signal& s, const State& y) {
  const long double h = 2e-5L;
  const auto at = [&](long double t) { return value(rk4<Rule>(d, s, y, t)); };
  return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
}

/// (31) as printed.
long double printed(const Matrices& m, const X& x, const M33& P) {
  const M33 i = P.inverse(), it = i.transpose(), gap = m.f_x - m.F;
  const M22 w = m.R.inverse();
  const M33 sum = it * P * (m.M.transpose() * w * m.M + m.m_x.transpose() * w * m.m_x) -
                  it * P * (m.M - m.m_x).transpose() * w * (m.M - m.m_x) + i * m.noise * i +
                  it * m.noise * it + gap.transpose() * i + it * gap;
  return -(x.transpose() * sum * x)(0) / 2;
}

template <typename Rule>
void check(const Rule& rule, const char* name) {
  jml::Noise noise(17);
  const Polynomial3 d;
  const Signal s;
  for (int run = 0; run < 20; ++run) {
    const jml::Vector<double, n> x = models::random_matrix<n, 1>(noise);
    const jml::Matrix<double, n, n> P =
        models::random_covariance<n>(noise, 0.5) + 0.3 * models::random_matrix<n, n>(noise);
    if (std::abs(P.determinant()) < 1e-2) continue;
    const State y{x.cast<long double>(), P.cast<long double>()};
    const auto got = jml::lyapunov(rule, d, s, x, P);
    ASSERT_EQ(got.status, jml::Status::ok) << name << run;
    const auto close = [&](double a, long double b, double tolerance) {
      EXPECT_NEAR(a, static_cast<double>(b), tolerance * std::max(1.0, std::abs(static_cast<double>(b))))
          << name << run;
    };
    close(got.value, value(y), 1e-12);
    close(got.rate, difference<Rule>(d, s, y), 1e-7);
  }
}

TEST(Lyapunov, DerivativeIsThatAlongTheFilterForEveryRow) {
  check(jml::Jml{}, "RNLS");
  check(jml::Ekf{}, "EKF");
  check(jml::Sddre{}, "SDDRE");
  check(jml::GainRule<Slot::jacobian, Slot::sdc, Slot::sdc, Slot::jacobian>{}, "the other way round");
}

// The tolerance above means something only if (31) is far away for two measurements.
TEST(Lyapunov, ThePrintedDerivativeDiffersForTwoMeasurements) {
  jml::Noise noise(18);
  const Polynomial3 d;
  const Signal s;
  double largest = 0;
  for (int run = 0; run < 10; ++run) {
    const jml::Vector<double, n> x = models::random_matrix<n, 1>(noise);
    const jml::Matrix<double, n, n> P =
        models::random_covariance<n>(noise, 0.5) + 0.3 * models::random_matrix<n, n>(noise);
    const auto exact = jml::lyapunov(jml::Jml{}, d, s, x, P);
    const Matrices m(d, s, x.cast<long double>());
    const double other = static_cast<double>(printed(m, x.cast<long double>(), P.cast<long double>()));
    largest = std::max(largest, std::abs(other - exact.rate) / std::abs(exact.rate));
  }
  EXPECT_GT(largest, 1e-2);
}

// One measurement with M and m_x parallel, as in the chapter's example: there the print is right.
TEST(Lyapunov, ThePrintedDerivativeAgreesForOneMeasurementWithParallelRows) {
  const models::Oscillator d;
  const models::SaturatingSignal s;
  const jml::Vector<double, 2> x(1.5, -0.4);
  const jml::Matrix<double, 2, 2> P{{0.3, 0.15}, {0.05, 0.4}};
  const auto got = jml::lyapunov(jml::Jml{}, d, s, x, P);
  ASSERT_EQ(got.status, jml::Status::ok);
  using M2 = jml::Matrix<double, 2, 2>;
  const M2 i = P.inverse(), it = i.transpose(), gap = d.dynamics_jacobian(x) - d.dynamics_sdc(x);
  const M2 noise = d.disturbance_input() * d.disturbance_input().transpose();
  const jml::Matrix<double, 1, 2> M = s.measurement_sdc(x), m_x = s.measurement_jacobian(x);
  const M2 sum = it * P * (M.transpose() * M + m_x.transpose() * m_x) / s.r -
                 it * P * (M - m_x).transpose() * (M - m_x) / s.r + i * noise * i + it * noise * it +
                 gap.transpose() * i + it * gap;
  const double wanted = -0.5 * x.dot(sum * x);
  EXPECT_NEAR(got.rate, wanted, 1e-12 * std::abs(wanted));
}

TEST(Lyapunov, OfALinearSystemIsTwice28) {  // (27) has a half that (28) forgot; (30) has not
  const models::LinearFlow<2, 1> d{jml::Matrix<double, 2, 2>{{0, 1}, {-2, -0.3}}, {0, 1}};
  const models::LinearSignal<2, 1> s{{1, 0.5}, 0.2};
  const jml::Vector<double, 2> x(1, 2);
  const jml::Matrix<double, 2, 2> P{{0.5, 0.1}, {0.1, 0.3}};
  const auto got = jml::lyapunov(jml::Sddre{}, d, s, x, P);
  const jml::Vector<double, 2> z = P.inverse() * x;
  EXPECT_NEAR(got.value, x.dot(z), 1e-14);
  EXPECT_NEAR(got.rate, -(z(1) * z(1) + 4 / 0.2), 1e-12);  // M x = 2
  EXPECT_EQ(jml::lyapunov(jml::Ekf{}, d, s, x, P).rate, got.rate);
}

TEST(Lyapunov, RefusesWhatHasNoInverse) {
  const models::Oscillator d;
  const models::SaturatingSignal s;
  const jml::Vector<double, 2> x(1, 1), nowhere(NAN, 1);
  using M2 = jml::Matrix<double, 2, 2>;
  const auto status = [&](const M2& P) { return jml::lyapunov(jml::Jml{}, d, s, x, P).status; };
  EXPECT_EQ(status(M2::Zero()), jml::Status::invalid_covariance);
  EXPECT_EQ(status(M2{{1, 2}, {2, 4}}), jml::Status::invalid_covariance);
  EXPECT_EQ(status(M2{{1e-20, 2e-20}, {2e-20, 4e-20}}), jml::Status::invalid_covariance);
  EXPECT_EQ(status(M2{{1, NAN}, {2, 4}}), jml::Status::invalid_covariance);
  EXPECT_EQ(status(M2{{1e-20, 0}, {0, 4e-20}}), jml::Status::ok);
  EXPECT_EQ(status(M2{{1e-20, 0}, {0, 4e+20}}), jml::Status::ok);
  EXPECT_EQ(jml::lyapunov(jml::Jml{}, d, s, nowhere, M2(M2::Identity())).status, jml::Status::invalid_state);
  models::SaturatingSignal perfect;
  perfect.r = 0;
  EXPECT_EQ(jml::lyapunov(jml::Jml{}, d, perfect, x, M2(M2::Identity())).status,
            jml::Status::invalid_noise_covariance);
}

}  // namespace
