// SPDX-License-Identifier: BSD-3-Clause
// The smoother on a nonlinear system against the Rauch-Tung-Striebel form, in long double, from the model's
// hand-written Jacobians at the filtered points.
#include <gtest/gtest.h>

#include <jml/interval/smoother.hpp>

#include "models/van_der_pol.hpp"
#include "riccati/oracle.hpp"

namespace {

using namespace jml::operators;

using jml::Status;
using oracle::big;
using oracle::Big;

// N, which the oracle inverts, has a condition number of up to 65.
constexpr double tolerance = 1e-12;

/// Van der Pol with noise on both states, so that N can be inverted.
struct Noisy : models::VanDerPol {
  static constexpr int disturbances = 2;
  jml::Matrix<double, 2, 2> disturbance_input() const { return jml::Matrix<double, 2, 2>::Identity(); }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    jml::Matrix<double, 2, 2> Q;
    Q << 1e-3, 5e-4, 5e-4, 0.05;
    return Q;
  }
};
using State = jml::Vector<double, 2>;
const jml::Estimate<double, 2> start{{1, 0}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};
constexpr int samples = 120;

double measured(int i) { return 0.8 * std::sin(0.05 * i) + 0.1 * std::cos(7.0 * i); }

/// RTS, from the filtered estimates. `jacobian(x)`: what the rule has for A.
template <typename Rule, typename Jacobian>
void check_against_rts(const Rule& rule, const Jacobian& jacobian, const char* name) {
  SCOPED_TRACE(name);
  const Noisy model;
  jml::Smoother smoother{jml::Filter{rule, model, start}, samples};
  for (int i = 0; i < samples; ++i) {
    ASSERT_EQ(
        i % 7 == 3 ? smoother.predict() : smoother.step(models::SaturatingPosition{}, measured(i)).status,
        Status::ok);
    if (i % 5 == 0) {
      ASSERT_EQ(smoother.update(models::SaturatingPosition{.r = 0.3}, measured(i + 1)).status, Status::ok);
    }
  }
  ASSERT_EQ(smoother.smooth(), Status::ok);
  Big x = big(smoother.filtered(samples).x), P = big(smoother.filtered(samples).P);
  double worst = 0, gain = 0;
  for (int k = samples - 1; k >= 0; --k) {
    const State& filtered = smoother.filtered(k).x;
    const Big P_f = big(smoother.filtered(k).P), A = big(jacobian(filtered));
    const Big N = A * P_f * A.transpose() + big(model.disturbance_covariance());
    const Big C = P_f * A.transpose() * oracle::inverse(N);
    x = Big(big(filtered) + C * (x - big(model.dynamics(filtered))));
    P = Big(P_f + C * (P - N) * C.transpose());
    worst = std::max({worst, oracle::distance(smoother.x(k), x), oracle::distance(smoother.P(k), P)});
    gain = std::max(gain, (smoother.x(k) - filtered).norm());
  }
  EXPECT_LT(worst, tolerance);
  EXPECT_GT(gain, 0.1) << "smoothing moves nothing: the test has no power";
}

TEST(NonlinearSmoother, IsRauchTungStriebel) {
  const Noisy model;
  check_against_rts(jml::Ekf{}, [&](const State& x) { return model.dynamics_jacobian(x); }, "EKF");
  check_against_rts(
      jml::Ekf<jml::EvaluatedAt::prediction>{},
      [&](const State& x) { return model.dynamics_jacobian(State(model.dynamics(x))); },
      "EKF, A at the prediction");
  check_against_rts(jml::Sddre{}, [&](const State& x) { return model.dynamics_sdc(x); }, "SDDRE");
}

}  // namespace
