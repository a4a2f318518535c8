// SPDX-License-Identifier: BSD-3-Clause
// CVODE with models that leave something out, as the README's own does: SDC matrices, Jacobians and residuals in
// every form a user may give them, stamped out over the rules, against Runge-Kutta with a thousandth of the step.
#include <gtest/gtest.h>

#include <jml/continuous/cvode.hpp>

#include "models/combinations.hpp"

namespace {

using namespace jml::operators;

using jml::Status;

/// The README's: f alone.
struct Oscillator {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1), -0.1 * x(0) - 0.02 * (x(0) * x(0) - 1.0) * x(1)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(1.0); }
};

/// The same in double only, with its Jacobian: no dual number can pass.
struct PlainOscillator {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  jml::Vector<double, 2> dynamics(const jml::Vector<double, 2>& x) const { return Oscillator{}.dynamics(x); }
  jml::Matrix<double, 2, 2> dynamics_jacobian(const jml::Vector<double, 2>& x) const {
    jml::Matrix<double, 2, 2> J;
    J << 0, 1, -0.1 - 0.04 * x(0) * x(1), -0.02 * (x(0) * x(0) - 1);
    return J;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(1.0); }
};

/// The same with a SDC matrix about any reference, in double only: F (x - r) = f(x) - f(r).
struct OscillatorAbout : Oscillator {
  jml::Matrix<double, 2, 2> dynamics_sdc_about(const jml::Vector<double, 2>& x,
                                               const jml::Vector<double, 2>& r) const {
    jml::Matrix<double, 2, 2> F;
    F << 0, 1, -0.1 - 0.02 * (x(0) + r(0)) * r(1), -0.02 * (x(0) * x(0) - 1);
    return F;
  }
};

struct SaturatingSignal {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0 + x(0) * x(0)));
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(1e-2); }
};

/// With a residual for any scalar.
struct SignalWithResidual : SaturatingSignal {
  template <typename T>
  jml::Vector<T, 1> residual(const jml::Vector<T, 1>& y, const jml::Vector<T, 1>& predicted) const {
    return jml::Vector<T, 1>(y(0) - predicted(0));
  }
};

/// With one in double only.
struct SignalWithPlainResidual : SaturatingSignal {
  jml::Vector<double, 1> residual(const jml::Vector<double, 1>& y, const jml::Vector<double, 1>& predicted) const {
    return jml::Vector<double, 1>(y(0) - predicted(0));
  }
};

/// One second by CVODE with either method, and by RK4; the two must agree to what CVODE was asked.
template <typename Rule, typename D, typename S>
void expect_as_runge_kutta(const Rule& rule, const D& d, const S& s) {
  const jml::Vector<double, 2> x0(0.8, 0.3);
  jml::Matrix<double, 2, 2> P0;
  P0 << 0.2, 0.05, 0.05, 0.1;
  const auto measured = [](double t) { return jml::Vector<double, 1>(0.6 * std::sin(t + 1)); };
  jml::Filter exact{jml::Continuous{rule, jml::RungeKutta4{1000}}, d, jml::Estimate{x0, P0}};
  ASSERT_EQ(exact.step(s, measured, 1.0).status, Status::ok);
  for (const jml::CvodeMethod method : {jml::CvodeMethod::adams, jml::CvodeMethod::bdf}) {
    jml::Cvode cvode;
    cvode.method = method;
    cvode.relative_tolerance = 1e-9;
    cvode.absolute_tolerance = 1e-11;
    jml::Filter filter{jml::Continuous{rule, cvode}, d, jml::Estimate{x0, P0}};
    const auto report = filter.step(s, measured, 1.0);
    ASSERT_EQ(report.status, Status::ok) << jml::describe(report.status);
    EXPECT_LT((filter.x() - exact.x()).norm(), 1e-7);
    EXPECT_LT((filter.P() - exact.P()).norm(), 1e-7);
    EXPECT_LT(report.evaluations, 3000);
  }
}

TEST(CvodeCombinations, ReadmesOscillator) {
  expect_as_runge_kutta(jml::Rnls{}, Oscillator{}, SaturatingSignal{});
  expect_as_runge_kutta(jml::Sddre{}, Oscillator{}, SaturatingSignal{});
}
TEST(CvodeCombinations, AboutAPoint) {
  expect_as_runge_kutta(jml::Rnls{jml::AboutPoint{jml::Vector<double, 2>(0.5, -0.5)}}, Oscillator{},
                        SignalWithResidual{});
}
TEST(CvodeCombinations, AboutTheEstimate) {
  expect_as_runge_kutta(jml::Rnls{jml::AboutEstimate{}}, Oscillator{}, SaturatingSignal{});
}
TEST(CvodeCombinations, ResidualInDouble) {
  expect_as_runge_kutta(jml::Rnls{}, Oscillator{}, SignalWithPlainResidual{});
}
TEST(CvodeCombinations, ModelInDouble) {
  expect_as_runge_kutta(jml::Rnls{}, PlainOscillator{}, SaturatingSignal{});
}
TEST(CvodeCombinations, SdcAboutInDouble) {
  expect_as_runge_kutta(jml::Rnls{jml::AboutPoint{jml::Vector<double, 2>(0.5, -0.5)}}, OscillatorAbout{},
                        SaturatingSignal{});
}

// Every rule, with the model's own matrices and with derived ones.
template <bool own>
void every_rule() {
  const models::CombinedOscillator<double, own> d;
  const models::CombinedSensor<double, own, true> s;
  expect_as_runge_kutta(jml::Ekf{}, d, s);
  expect_as_runge_kutta(jml::Sddre{}, d, s);
  expect_as_runge_kutta(jml::Rnls{}, d, s);
}
TEST(CvodeCombinations, EveryRuleWithOwnMatrices) { every_rule<true>(); }
TEST(CvodeCombinations, EveryRuleWithDerivedMatrices) { every_rule<false>(); }

// F(x; r) of f = x², r = 1, is x + r: its derivative is 1 everywhere, also at x = r, where f_x alone would give 2.
TEST(DerivedSdc, DerivativeAtTheReference) {
  using T = jml::Dual<double, 1>;
  const auto slope_at = [](double at) {
    const jml::Vector<T, 1> x = jml::seed(jml::Vector<double, 1>(at));
    const jml::Vector<T, 1> r(T(1.0)), change(x(0) * x(0) - r(0) * r(0));
    const auto jacobian = [](const jml::Vector<T, 1>& z) { return jml::Matrix<T, 1, 1>(2.0 * z(0)); };
    return jml::derive_sdc<1>(jacobian, change, jml::detail::sizes(x, r), x, r)(0, 0);
  };
  for (const double at : {1.0, 1.0 + 1e-9, 3.0}) {
    EXPECT_NEAR(slope_at(at).value, at + 1, 1e-14);
    EXPECT_NEAR(slope_at(at).partial[0], 1, 1e-6) << at;
  }
}

}  // namespace
