// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The problems of the interval contests: models, and the one flight of each, the same for every contender.
#pragma once

#include <cstdlib>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <models/van_der_pol.hpp>
#include <vector>

namespace peers {

/// A flight: measurements and controls of each step, and where every engine begins at each node.
template <int n, int p, int u>
struct Flight {
  std::vector<jml::Vector<double, p>> y;
  std::vector<jml::Vector<double, n>> start, truth;  // one more than steps
  std::vector<jml::Vector<double, (u > 0 ? u : 1)>> control;
  [[nodiscard]] int steps() const { return static_cast<int>(y.size()); }
};

/// n = 2, p = 1, nonlinear: the Van der Pol oscillator driven by white noise, position saturating.
struct VanDerPolProblem {
  static constexpr double gradient = 1e-8;  ///< to be reached, as a part of that at the start
  static constexpr double step = 1e-6;      ///< the same for this library: length of the next, in deviations
  static constexpr const char* name = "van_der_pol";
  static constexpr int n = 2, p = 1, u = 0;
  models::VanDerPolWhite dynamics;
  models::SaturatingPosition sensor;
  jml::Estimate<double, 2> prior{{1.5, 0.5}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};
  jml::Vector<double, 2> truth{1, 0};
  static jml::Vector<double, 1> control(int) { return jml::Vector<double, 1>(0.0); }
};

/// A robot in the plane: x, y, heading; m, rad. Control: what its odometry says of a step, in its own frame.
struct Robot {
  static constexpr int states = 3, disturbances = 3, controls = 3;
  using At = jml::StepContext<double, 3>;
  double position_sd = 0.02, heading_sd = 2e-3;

  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x, const At& at) const {
    using std::cos, std::sin;
    const T c = cos(x(2)), s = sin(x(2));
    return {x(0) + c * at.control(0) - s * at.control(1), x(1) + s * at.control(0) + c * at.control(1),
            x(2) + at.control(2)};
  }
  template <typename T>
  jml::Matrix<T, 3, 3> dynamics_jacobian(const jml::Vector<T, 3>& x, const At& at) const {
    using std::cos, std::sin;
    const T c = cos(x(2)), s = sin(x(2));
    jml::Matrix<T, 3, 3> J = jml::Matrix<T, 3, 3>::Identity();
    J(0, 2) = -s * at.control(0) - c * at.control(1);
    J(1, 2) = c * at.control(0) - s * at.control(1);
    return J;
  }
  jml::Matrix<double, 3, 3> disturbance_covariance() const {
    return jml::Vector<double, 3>(position_sd * position_sd, position_sd * position_sd,
                                  heading_sd * heading_sd)
        .asDiagonal();
  }
};

/// Its position, m.
struct Fix {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  double sd = 0.3;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 3>& x) const {
    return {x(0), x(1)};
  }
  jml::Matrix<double, 2, 3> measurement_jacobian(const jml::Vector<double, 3>&) const {
    return jml::Matrix<double, 2, 3>::Identity();
  }
  jml::Matrix<double, 2, 2> noise_covariance() const {
    return sd * sd * jml::Matrix<double, 2, 2>::Identity();
  }
};

/// n = 3, p = 2, nonlinear through the heading: what gtsam's own factors say, BetweenFactorPose2 and
/// PoseTranslationPrior2D. gtsam's residual of a step is the logarithm of its pose error, longer than the
/// difference here by (θ/2) / sin(θ/2): at 2 mrad 2e-7 of it. gtsam's gradient goes no lower than 1e-6 of
/// that at the start, whatever its solver and ordering.
struct RobotProblem {
  static constexpr double gradient = 1e-5, step = 1e-4;
  static constexpr const char* name = "robot";
  static constexpr int n = 3, p = 2, u = 3;
  Robot dynamics;
  Fix sensor;
  jml::Estimate<double, 3> prior{{0.5, -0.5, 0.2}, jml::Vector<double, 3>(0.25, 0.25, 0.04).asDiagonal()};
  jml::Vector<double, 3> truth{0, 0, 0};
  static jml::Vector<double, 3> control(int k) { return {0.5, 0, 0.03 * std::sin(0.01 * k) + 0.01}; }
};

/// Position and velocity under white acceleration over 0.1 s; its position measured. Linear.
struct Cart {
  static constexpr int states = 2, disturbances = 2;
  static constexpr bool linear = true;
  double dt = 0.1, q = 0.5;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + dt * x(1), x(1)};
  }
  jml::Matrix<double, 2, 2> dynamics_jacobian(const jml::Vector<double, 2>&) const {
    jml::Matrix<double, 2, 2> J;
    J << 1, dt, 0, 1;
    return J;
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    jml::Matrix<double, 2, 2> Q;
    Q << dt * dt * dt / 3, dt * dt / 2, dt * dt / 2, dt;
    return q * Q;
  }
};
struct CartPosition {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double r = 0.04;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 2> measurement_jacobian(const jml::Vector<double, 2>&) const { return {1, 0}; }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};

/// n = 2, p = 1, linear: what a general solver does best.
struct CartProblem {
  static constexpr double gradient = 1e-8, step = 1e-6;
  static constexpr const char* name = "cart";
  static constexpr int n = 2, p = 1, u = 0;
  Cart dynamics;
  CartPosition sensor;
  jml::Estimate<double, 2> prior{{1, 0}, jml::Matrix<double, 2, 2>::Identity()};
  jml::Vector<double, 2> truth{0, 0.5};
  static jml::Vector<double, 1> control(int) { return jml::Vector<double, 1>(0.0); }
};

/// The step of a filter or batch with the problem's measurement and, where it has one, control.
template <typename Problem, typename Filter>
auto step(Filter& filter, const Problem& problem, const Flight<Problem::n, Problem::p, Problem::u>& flight,
          int k) {
  const auto i = static_cast<std::size_t>(k);
  if constexpr (Problem::u > 0)
    return filter.step(problem.sensor, flight.y[i], 1.0, flight.control[i]);
  else
    return filter.step(problem.sensor, flight.y[i]);
}

/// The truth with both noises, and an EKF along it: the start of every engine.
template <typename Problem>
Flight<Problem::n, Problem::p, Problem::u> fly(const Problem& problem, int steps) {
  Flight<Problem::n, Problem::p, Problem::u> flight;
  jml::Noise noise(1);
  auto x = problem.truth;
  flight.truth.push_back(x);
  jml::Filter ekf{jml::Ekf{}, problem.dynamics, problem.prior};
  flight.start.push_back(problem.prior.x);
  for (int k = 0; k < steps; ++k) {
    flight.control.push_back(Problem::control(k));
    if constexpr (Problem::u > 0)
      x = problem.dynamics.dynamics(x, {.dt = 1, .control = flight.control.back()});
    else
      x = problem.dynamics.dynamics(x);
    x += noise.normal_vector(problem.dynamics.disturbance_covariance());
    flight.truth.push_back(x);
    flight.y.push_back(problem.sensor.measurement(x) +
                       noise.normal_vector(problem.sensor.noise_covariance()));
    if (!jml::usable(step(ekf, problem, flight, k).status)) std::abort();
    flight.start.push_back(ekf.x());
  }
  return flight;
}

}  // namespace peers
