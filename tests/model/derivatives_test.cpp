// SPDX-License-Identifier: BSD-3-Clause
// Derived Jacobians against hand-written ones; the defining property of every SDC; second derivatives.
#include <gtest/gtest.h>

#include <jml/model/functions.hpp>
#include <jml/model/hessian.hpp>
#include <jml/campaign/noise.hpp>

#include "models/bare.hpp"
#include "models/pendulum.hpp"
#include "models/polynomial.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

const jml::StepContext<double> at{};

/// max |a - b| over the largest entry of the row.
template <typename A, typename B>
double relative_error(const A& a, const B& b) {
  double worst = 0;
  for (int i = 0; i < a.rows(); ++i) {
    const double scale = std::max(b.row(i).cwiseAbs().maxCoeff(), 1e-300);
    worst = std::max(worst, (a.row(i) - b.row(i)).cwiseAbs().maxCoeff() / scale);
  }
  return worst;
}

/// |F d - (f(x) - f(r))| over the size of the terms, by row.
template <typename F, typename D, typename C, typename V>
double definition_error(const F& matrix, const D& d, const C& change, const V& value) {
  double worst = 0;
  for (int i = 0; i < matrix.rows(); ++i) {
    const double scale = matrix.row(i).cwiseAbs() * d.cwiseAbs() + std::abs(value(i));
    worst = std::max(worst, std::abs(matrix.row(i).dot(d) - change(i)) / std::max(scale, 1e-300));
  }
  return worst;
}

template <typename Dynamics, int n>
void check_dynamics(const Dynamics& d, const jml::Vector<double, n>& x,
                    const jml::Vector<double, n>& reference) {
  const models::Bare<Dynamics> bare{d};
  EXPECT_LT(relative_error(jml::dynamics_jacobian(bare, x, at), d.dynamics_jacobian(x)), 1e-12);
  const jml::Vector<double, n> origin = jml::Vector<double, n>::Zero();
  const jml::Vector<double, n> f = d.dynamics(x);
  EXPECT_LT(definition_error(d.dynamics_sdc(x), x, jml::Vector<double, n>(f - d.dynamics(origin)), f), 1e-13);
  for (const auto& r : {origin, reference}) {
    EXPECT_LT(definition_error(jml::dynamics_sdc<false>(bare, x, r, at), jml::Vector<double, n>(x - r),
                               jml::Vector<double, n>(f - d.dynamics(r)), f),
              1e-13);
  }
  // About x itself a SDC is the Jacobian.
  EXPECT_LT(relative_error(jml::dynamics_sdc<false>(bare, x, x, at), d.dynamics_jacobian(x)), 1e-12);
}

template <typename Sensor, int n>
void check_sensor(const Sensor& s, const jml::Vector<double, n>& x, const jml::Vector<double, n>& reference) {
  const models::BareSensor<Sensor> bare{s};
  EXPECT_LT(relative_error(jml::measurement_jacobian(bare, x, at), s.measurement_jacobian(x)), 1e-12);
  const auto m = s.measurement(x);
  const auto change = jml::measurement_residual(s, m, s.measurement(reference));
  EXPECT_LT(definition_error(jml::measurement_sdc<false>(bare, x, reference, at),
                             jml::Vector<double, n>(x - reference), change, m),
            1e-13);
}

TEST(Derivatives, VanDerPol) {
  jml::Noise noise(1);
  for (int k = 0; k < 200; ++k) {
    const jml::Vector<double, 2> x = 2 * noise.normal_vector<2>(), r = 2 * noise.normal_vector<2>();
    check_dynamics(models::VanDerPol{}, x, r);
    check_sensor(models::SaturatingPosition{}, x, r);
    const jml::Vector<double, 2> m = models::SaturatingPosition{}.measurement_sdc(x).transpose();
    EXPECT_NEAR(m.dot(x), models::SaturatingPosition{}.measurement(x)(0), 1e-15);
  }
}

TEST(Derivatives, Pendulum) {
  jml::Noise noise(2);
  for (int k = 0; k < 200; ++k) {
    const jml::Vector<double, 2> x = 2 * noise.normal_vector<2>(), r = 2 * noise.normal_vector<2>();
    check_dynamics(models::Pendulum{}, x, r);
    check_sensor(models::SineSensor{}, x, r);
  }
}

TEST(Derivatives, Polynomial) {
  jml::Noise noise(3);
  for (int k = 0; k < 200; ++k) {
    const jml::Vector<double, 4> x = noise.normal_vector<4>(), r = noise.normal_vector<4>();
    check_dynamics(models::Polynomial<4>{.constant = 0.3}, x, r);
    check_sensor(models::PolynomialSensor<4, 2>{}, x, r);
  }
}

TEST(Derivatives, Radar) {
  jml::Noise noise(4);
  for (int k = 0; k < 200; ++k) {
    jml::Vector<double, 6> x, r;
    x << -20 + noise.normal(), noise.normal(), 5 + noise.normal(), noise.normal(), noise.normal(),
        noise.normal();
    r << -20, k % 2 == 0 ? 3 : -3, 6, 0.5, -0.5, 0.1;
    check_dynamics(models::BallisticTarget{}, x, r);  // the azimuth of r lies on either side of ±π
    check_sensor(models::Radar{}, x, r);
  }
}

// Close to the reference the rank-one remainder must not amplify rounding: the SDC tends to the Jacobian.
TEST(Derivatives, SdcNearItsReference) {
  const jml::Vector<double, 4> r(0.3, -0.2, 0.5, 0.1), direction(1, -2, 0.5, 1);
  const models::Polynomial<4> d{};
  const models::Bare<models::Polynomial<4>> bare{d};
  for (const double step : {1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
    const jml::Vector<double, 4> x = r + step * direction;
    EXPECT_LT(relative_error(jml::dynamics_sdc<false>(bare, x, r, at), d.dynamics_jacobian(x)),
              10 * step + 1e-10)
        << step;
  }
}

// x / sqrt(1 + x²) is no polynomial: eight nodes leave 1e-4 at x = 5, the remainder term must remove it all.
TEST(Derivatives, SdcIsExactWhereQuadratureIsNot) {
  const models::BareSensor<models::SaturatingPosition> bare{};
  const jml::Vector<double, 2> x(5, 1), origin(0, 0);
  const auto M = jml::measurement_sdc<false>(bare, x, origin, at);
  EXPECT_NEAR((M * x)(0), 5 / std::sqrt(26.0), 1e-15);
}

// theory: about the origin the line-integral SDC of Van der Pol at (2, 1) has second row (-1.267, -0.067) for
// c = 0.1, k = 1, where (21) has (-1, -0.6): a SDC is not unique.
TEST(Derivatives, SdcIsNotUnique) {
  const models::VanDerPol d{.dt = 1};
  const jml::Vector<double, 2> x(2, 1), origin(0, 0);
  const jml::Matrix<double, 2, 2> derived =
      jml::dynamics_sdc<false>(models::Bare<models::VanDerPol>{d}, x, origin, at);
  EXPECT_NEAR(derived(1, 0), -1.26667, 1e-5);
  EXPECT_NEAR(derived(1, 1) - 1, -0.06667, 1e-5);
  EXPECT_DOUBLE_EQ(d.dynamics_sdc(x)(1, 0), -1);
  EXPECT_DOUBLE_EQ(d.dynamics_sdc(x)(1, 1) - 1, -0.6);
}

// Σ w_k ∇²f_k of Van der Pol by hand: only the second component bends, f_2'' = -4 c dt [v, x; x, 0].
TEST(Derivatives, Hessian) {
  const models::VanDerPol d{.dt = 0.2, .c = 0.3};
  const jml::Vector<double, 2> x(1.3, -0.7), weights(5, 2);
  jml::Matrix<double, 2, 2> expected;
  expected << x(1), x(0), x(0), 0;
  expected *= -4 * d.c * d.dt * weights(1);
  EXPECT_LT((jml::dynamics_hessian(d, x, weights, at) - expected).norm(), 1e-15);
  EXPECT_LT((jml::dynamics_hessian(models::Bare<models::VanDerPol>{d}, x, weights, at) - expected).norm(),
            1e-15);
  EXPECT_LT(
      (jml::dynamics_hessian(models::DoubleOnly<models::VanDerPol>{d}, x, weights, at) - expected).norm(),
      1e-9);
}

TEST(Dual, ElementaryFunctionsAgainstTheirDerivatives) {
  using T = jml::Dual<double, 1>;
  T x(0.7);
  x.partial[0] = 1;
  using std::sqrt, std::log, std::exp, std::sin, std::cos, std::tan, std::asin, std::acos, std::atan,
      std::sinh, std::cosh, std::tanh;
  const double v = 0.7;
  EXPECT_DOUBLE_EQ(sin(x).partial[0], std::cos(v));
  EXPECT_DOUBLE_EQ(cos(x).partial[0], -std::sin(v));
  EXPECT_NEAR(tan(x).partial[0], 1 / (std::cos(v) * std::cos(v)), 1e-15);
  EXPECT_NEAR(asin(x).partial[0], 1 / std::sqrt(1 - v * v), 1e-15);
  EXPECT_NEAR(acos(x).partial[0], -1 / std::sqrt(1 - v * v), 1e-15);
  EXPECT_NEAR(atan(x).partial[0], 1 / (1 + v * v), 1e-15);
  EXPECT_DOUBLE_EQ(sinh(x).partial[0], std::cosh(v));
  EXPECT_DOUBLE_EQ(cosh(x).partial[0], std::sinh(v));
  EXPECT_NEAR(tanh(x).partial[0], 1 / (std::cosh(v) * std::cosh(v)), 1e-15);
  EXPECT_DOUBLE_EQ(exp(x).partial[0], std::exp(v));
  EXPECT_DOUBLE_EQ(expm1(x).partial[0], std::exp(v));
  EXPECT_DOUBLE_EQ(log(x).partial[0], 1 / v);
  EXPECT_DOUBLE_EQ(log1p(x).partial[0], 1 / (1 + v));
  EXPECT_DOUBLE_EQ(sqrt(x).partial[0], 0.5 / std::sqrt(v));
  EXPECT_NEAR(cbrt(x).partial[0], std::cbrt(v) / (3 * v), 1e-15);
  EXPECT_NEAR(erf(x).partial[0], 2 / std::sqrt(std::acos(-1.0)) * std::exp(-v * v), 1e-15);
  EXPECT_NEAR(pow(x, 3).partial[0], 3 * v * v, 1e-15);
  EXPECT_NEAR(pow(x, -1.5).partial[0], -1.5 * std::pow(v, -2.5), 1e-14);
  EXPECT_NEAR(pow(x, x).partial[0], std::pow(v, v) * (std::log(v) + 1), 1e-15);
  EXPECT_NEAR(atan2(x, T(0.3)).partial[0], 0.3 / (0.3 * 0.3 + v * v), 1e-15);
  EXPECT_NEAR(atan2(T(0.3), x).partial[0], -0.3 / (0.3 * 0.3 + v * v), 1e-15);
  EXPECT_NEAR(hypot(x, 0.4).partial[0], v / std::hypot(v, 0.4), 1e-15);
  EXPECT_DOUBLE_EQ(abs(-x).partial[0], 1);
  EXPECT_NEAR((1.0 / x).partial[0], -1 / (v * v), 1e-15);
  EXPECT_NEAR((x / (x + 1.0)).partial[0], 1 / ((v + 1) * (v + 1)), 1e-15);
  EXPECT_DOUBLE_EQ(max(x, T(0.2)).partial[0], 1);
  EXPECT_DOUBLE_EQ(min(x, T(0.2)).partial[0], 0);
}

// An operator with a plain number is that with a constant: value and derivatives.
TEST(Derivatives, OperatorsWithPlainNumbers) {
  using D = jml::Dual<double, 2>;
  D x(1.7);
  x.partial[0] = 0.3;
  x.partial[1] = -2.1;
  const double c = 0.6;
  const D constant(c);
  const auto same = [](const D& a, const D& b, const char* what) {
    EXPECT_DOUBLE_EQ(a.value, b.value) << what;
    for (int i = 0; i < 2; ++i) EXPECT_DOUBLE_EQ(a.partial[i], b.partial[i]) << what;
  };
  same(x + c, x + constant, "x + c");
  same(c + x, constant + x, "c + x");
  same(x - c, x - constant, "x - c");
  same(c - x, constant - x, "c - x");
  same(x * c, x * constant, "x c");
  same(c * x, constant * x, "c x");
  same(x / c, x / constant, "x / c");
  same(c / x, constant / x, "c / x");
  EXPECT_DOUBLE_EQ((x / c).partial[1], -2.1 / 0.6);
  EXPECT_DOUBLE_EQ((c - x).partial[0], -0.3);
}

}  // namespace
