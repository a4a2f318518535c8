// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rusnak 2015, eqs. (19)-(23): the Van der Pol oscillator, one Euler step, and its saturating position sensor.
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>

namespace models {

/// x = (position, velocity). q_c: spectral density of the acceleration noise, held over a step.
struct VanDerPol {
  static constexpr int states = 2, disturbances = 1;
  double dt = 0.05, c = 0.1, k = 1, q_c = 1;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    const T acceleration = -k * x(0) - 2 * c * (x(0) * x(0) - 1.0) * x(1);
    return {x(0) + dt * x(1), x(1) + dt * acceleration};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x) const {  // I + dt (22)
    jml::Matrix<T, 2, 2> J;
    J << T(1), T(dt), -dt * (k + 4 * c * x(0) * x(1)), 1.0 - dt * 2 * c * (x(0) * x(0) - 1.0);
    return J;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& x) const {  // I + dt (21)
    jml::Matrix<T, 2, 2> F;
    F << T(1), T(dt), T(-dt * k), 1.0 - dt * 2 * c * (x(0) * x(0) - 1.0);
    return F;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, dt}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(q_c / dt); }
};

/// The same driven by white noise within the step: what it does to a double integrator over dt (Van Loan), a
/// regular 2×2 covariance and G = I.
struct VanDerPolWhite : VanDerPol {
  static constexpr int disturbances = 2;
  jml::Matrix<double, 2, 2> disturbance_input() const { return jml::Matrix<double, 2, 2>::Identity(); }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    jml::Matrix<double, 2, 2> Q;
    Q << dt * dt * dt / 3, dt * dt / 2, dt * dt / 2, dt;
    return q_c * Q;
  }
};

/// y = x / sqrt(1 + x²) + v.
struct SaturatingPosition {
  static constexpr int measurements = 1;
  double r = 1e-3 / 0.05;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0 + x(0) * x(0)));
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    const T s = 1.0 + x(0) * x(0);
    return {1.0 / (s * sqrt(s)), T(0)};
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_sdc(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return {1.0 / sqrt(1.0 + x(0) * x(0)), T(0)};
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};

}  // namespace models
