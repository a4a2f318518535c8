// SPDX-License-Identifier: BSD-3-Clause
// Continuous dynamics in a space: an attitude in coning motion, whose rate is known in closed form.
#include <gtest/gtest.h>

#include <jml/jml.hpp>
#include <jml/model/discretize.hpp>

#include "figure.hpp"

namespace {

constexpr double tilt = 0.3, turn = 2.0;

/// The body's z axis goes round a cone: q(t) = (cos ½θ, sin ½θ (cos Ωt, sin Ωt, 0)), whose rate in the body's
/// axes is (-Ω sin θ sin Ωt, Ω sin θ cos Ωt, -2 Ω sin² ½θ).
jml::Vector<double, 4> coning(double t) {
  return {std::cos(tilt / 2), std::sin(tilt / 2) * std::cos(turn * t),
          std::sin(tilt / 2) * std::sin(turn * t), 0};
}
struct Coning {
  using Space = jml::SO3;
  using time_domain = jml::ContinuousTime;
  static constexpr int disturbances = 3;
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>&, const jml::Vector<T, 3>& w, const auto& at) const {
    const double phase = turn * at.time, half = std::sin(tilt / 2);
    return jml::Vector<T, 3>(T(-turn * std::sin(tilt) * std::sin(phase)) + w(0),
                             T(turn * std::sin(tilt) * std::cos(phase)) + w(1),
                             T(-2 * turn * half * half) + w(2));
  }
  jml::Matrix<double, 3, 3> disturbance_spectral_density() const {
    return 1e-4 * jml::Matrix<double, 3, 3>::Identity();
  }
};
/// The same with w added in the tangent.
struct AddedNoise : Coning {
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>& x, const auto& at) const {
    return Coning::dynamics(x, jml::Vector<T, 3>(jml::Vector<T, 3>::Zero()), at);
  }
};

template <typename Integrator>
double error_after_a_turn(int steps) {
  const auto model = jml::discretize<Integrator>(Coning{});
  jml::Vector<double, 4> x = coning(0);
  jml::StepContext<double> at;
  at.dt = 3.0 / steps;
  for (int k = 0; k < steps; ++k) {
    at.time = k * at.dt;
    x = model.dynamics(x, jml::Vector<double, 3>(jml::Vector<double, 3>::Zero()), at);
  }
  EXPECT_NEAR(x.norm(), 1.0, 1e-15);
  return jml::SO3::minus(x, coning(3.0)).norm();
}

/// The same motion by a step of the quaternion's four numbers, q' = ½ q ∘ (0, ω), brought back to length 1.
double error_in_four_numbers(int steps) {
  using Quaternion = jml::Vector<double, 4>;
  const double dt = 3.0 / steps;
  const auto rate = [](const Quaternion& q, double t) -> Quaternion {
    const double half = std::sin(tilt / 2);
    const Quaternion turning(0, -turn * std::sin(tilt) * std::sin(turn * t),
                             turn * std::sin(tilt) * std::cos(turn * t), -2 * turn * half * half);
    return 0.5 * jml::quaternion_product(q, turning);
  };
  Quaternion x = coning(0);
  for (int k = 0; k < steps; ++k) {
    const double t = k * dt;
    const Quaternion a = rate(x, t), b = rate(x + dt / 2 * a, t + dt / 2),
                     c = rate(x + dt / 2 * b, t + dt / 2), d = rate(x + dt * c, t + dt);
    x = (x + dt / 6 * (a + 2 * b + 2 * c + d)).normalized();
  }
  return jml::SO3::minus(x, coning(3.0)).norm();
}

TEST(DiscretizeInSpace, KeepsTheOrderAndTheLength) {
  const double coarse = error_after_a_turn<jml::RungeKutta4>(30),
               fine = error_after_a_turn<jml::RungeKutta4>(60);
  EXPECT_LT(coarse, 1e-5);
  const double four_numbers = error_in_four_numbers(30);
  EXPECT_NEAR(four_numbers / coarse, 1, 0.5);
  figure::print("coning", coarse, "rad");
  figure::print("coning_in_four_numbers", four_numbers, "rad");
  EXPECT_NEAR(std::log2(coarse / fine), 4, 0.2);
  const double euler = error_after_a_turn<jml::Euler>(300), finer = error_after_a_turn<jml::Euler>(600);
  EXPECT_NEAR(std::log2(euler / finer), 1, 0.1);
}

TEST(DiscretizeInSpace, RunsInAFilterWithNoiseEitherWay) {
  const jml::Matrix<double, 3, 3> P = 0.01 * jml::Matrix<double, 3, 3>::Identity();
  jml::Filter argument{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(Coning{}), jml::Estimate{coning(0), P}};
  jml::Filter added{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(AddedNoise{}), jml::Estimate{coning(0), P}};
  for (int k = 0; k < 100; ++k) {
    ASSERT_EQ(argument.predict(0.01), jml::Status::ok);
    ASSERT_EQ(added.predict(0.01), jml::Status::ok);
  }
  EXPECT_LT(jml::SO3::minus(argument.x(), coning(1)).norm(), 1e-7);
  EXPECT_LT((argument.P() - added.P()).cwiseAbs().maxCoeff(), 1e-15);
  // Turned, P and what a white disturbance adds to it stay isotropic: P + t q.
  EXPECT_LT((argument.P() - (0.01 + 1e-4) * jml::Matrix<double, 3, 3>::Identity()).cwiseAbs().maxCoeff(),
            1e-9);
}

/// The turn about z is left to the mean of the disturbance.
struct Mean : Coning {
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>& x, const auto& at) const {
    jml::Vector<T, 3> out = Coning::dynamics(x, jml::Vector<T, 3>(jml::Vector<T, 3>::Zero()), at);
    out(2) = T(0);
    return out;
  }
  jml::Vector<double, 3> disturbance_mean() const {
    return {0, 0, -2 * turn * std::sin(tilt / 2) * std::sin(tilt / 2)};
  }
};
TEST(DiscretizeInSpace, TheMeanOfTheDisturbanceMovesItToo) {
  const jml::Matrix<double, 3, 3> P = 0.01 * jml::Matrix<double, 3, 3>::Identity();
  jml::Filter mean{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(Mean{}), jml::Estimate{coning(0), P}};
  for (int k = 0; k < 100; ++k) ASSERT_EQ(mean.predict(0.01), jml::Status::ok);
  EXPECT_LT(jml::SO3::minus(mean.x(), coning(1)).norm(), 1e-7);
}

}  // namespace
