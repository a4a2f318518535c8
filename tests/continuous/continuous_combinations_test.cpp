// SPDX-License-Identifier: BSD-3-Clause
// The product of the continuous methods: every rule × integrator × (SDC and Jacobians of the model's own, or derived)
// × (double, float) × (a measurement that is there all the time, samples), by every verb. Own and derived agree to
// rounding, integrators to their order, float and double to float's digits. With CVODE: tests/cvode.
#include <gtest/gtest.h>

#include <jml/model/discretize.hpp>

#include "models/combinations.hpp"

namespace {

using jml::Vector, jml::usable;

struct Flown {
  Vector<double, 2> x;
  jml::Matrix<double, 2, 2> P = jml::Matrix<double, 2, 2>::Zero();
};

/// Half a second by every verb.
template <typename Scalar, bool own, typename M>
Flown fly(const M& method) {
  using D = models::CombinedOscillator<Scalar, own>;
  const models::CombinedSensor<Scalar, own, true> signal;
  const models::CombinedSensor<Scalar, own, false> sampled;
  const auto start = [] {
    if constexpr (requires { method.options; })
      return Vector<Scalar, 2>(models::combined_start<Scalar>().x);
    else
      return models::combined_start<Scalar>();
  }();
  jml::Filter filter{method, D{}, start};
  const Scalar dt = Scalar(0.05);
  const auto y = models::combined_y<Scalar>;
  for (int k = 0; k < 2; ++k) {
    EXPECT_TRUE(usable(filter.step(signal, y(k), dt)));
    EXPECT_TRUE(usable(filter.step(signal, jml::Line{y(k), y(k + 1)}, dt)));
    EXPECT_TRUE(usable(filter.step(
        signal, [](double t) { return Vector<Scalar, 1>(static_cast<Scalar>(0.5 + 0.1 * t)); }, dt)));
    EXPECT_TRUE(usable(filter.predict(dt)));
    EXPECT_TRUE(usable(filter.step(sampled, y(k), dt)));
    EXPECT_TRUE(usable(filter.update(sampled, y(k), jml::only(0))));
  }
  EXPECT_NEAR(filter.time(), 0.5, 1e-7);
  Flown out;
  out.x = filter.x().template cast<double>();
  out.P = filter.P().template cast<double>();
  return out;
}

void expect_near(const Flown& a, const Flown& b, double tolerance, const char* what) {
  EXPECT_LT((a.x - b.x).norm(), tolerance) << what;
  EXPECT_LT((a.P - b.P).norm(), tolerance) << what;
}

/// `order`: what the integrators may differ by from Runge-Kutta at a hundredth of the step.
template <typename Rule>
void check(const char* name, const Rule& rule) {
  SCOPED_TRACE(name);
  const Flown exact = fly<double, true>(jml::Continuous{rule, jml::RungeKutta4{100}});
  const auto by = [&](const auto& integrator, double order, const char* integrator_name) {
    SCOPED_TRACE(integrator_name);
    const jml::Continuous method{rule, integrator};
    const Flown own = fly<double, true>(method);
    expect_near(own, exact, order, "order");
    expect_near(own, fly<double, false>(method), 1e-9, "own and derived");
    const Flown single = fly<float, true>(method);
    expect_near(own, single, 1e-4, "double and float");
    expect_near(single, fly<float, false>(method), 1e-4, "own and derived in float");
  };
  by(jml::RungeKutta4{2}, 1e-6, "Runge-Kutta");
  by(jml::DavisonMaki{2}, 1e-3, "Davison-Maki");
}

TEST(ContinuousCombinations, Ekf) { check("EKF", jml::Ekf{}); }
TEST(ContinuousCombinations, Sddre) { check("SDDRE", jml::Sddre{}); }
TEST(ContinuousCombinations, Rnls) { check("RNLS", jml::Rnls{}); }

TEST(ContinuousCombinations, Algebraic) {
  const auto compare = [](const auto& method) {
    const Flown own = fly<double, true>(method);
    expect_near(own, fly<double, false>(method), 1e-9, "own and derived");
    expect_near(own, fly<float, true>(method), 1e-4, "double and float");
    expect_near(own, fly<float, false>(method), 1e-4, "derived in float");
  };
  compare(jml::Algebraic{jml::Sddre{}});
  compare(jml::Algebraic{jml::Rnls{}, {.substeps = 2, .gain = jml::GainUpdate::every_sample}});
}

/// discretize over the same: one explicit step, by each rule, with the noise either way.
template <typename Integrator, typename Noise, typename Scalar, bool own, typename Rule>
Flown discrete(const Rule& rule) {
  jml::Filter filter{rule, jml::discretize<Integrator, Noise>(models::CombinedOscillator<Scalar, own>{}),
                     models::combined_start<Scalar>()};
  const models::CombinedSensor<Scalar, own, false> sensor;
  for (int k = 0; k < 10; ++k)
    EXPECT_TRUE(usable(filter.step(sensor, models::combined_y<Scalar>(k), Scalar(0.05))));
  return {filter.x().template cast<double>(), filter.P().template cast<double>()};
}
template <typename Integrator, typename Noise>
void check_discretized() {
  const auto compare = [](const auto& rule) {
    const Flown own = discrete<Integrator, Noise, double, true>(rule);
    // A derived SDC matrix of a whole step is not the product of the stages' own: the EKF alone has the same.
    const bool same = std::is_same_v<std::remove_cvref_t<decltype(rule)>, jml::Ekf<>>;
    expect_near(own, discrete<Integrator, Noise, double, false>(rule), same ? 1e-12 : 1e-2, "own and derived");
    expect_near(own, discrete<Integrator, Noise, float, true>(rule), 1e-4, "double and float");
  };
  compare(jml::Ekf{});
  compare(jml::Sddre{});
  compare(jml::Jml{});
}
TEST(ContinuousCombinations, Discretized) {
  check_discretized<jml::RungeKutta4, jml::VanLoan>();
  check_discretized<jml::RungeKutta4, jml::HeldNoise>();
  check_discretized<jml::Euler, jml::VanLoan>();
  check_discretized<jml::Euler, jml::HeldNoise>();
}

}  // namespace
