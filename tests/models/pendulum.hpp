// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A pendulum, x = (angle, rate) in rad and rad/s: θ'' = -(g/l) sin θ - damping θ' + w. Made up; no source.
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>

namespace models {

/// One semi-implicit Euler step of length dt: the new rate moves the angle. `damping` = 0: undamped.
struct Pendulum {
  static constexpr int states = 2, disturbances = 1;
  double dt = 0.05, stiffness = 9.80665, damping = 0.1;  // s, 1/s² (g/l, l = 1 m), 1/s
  double variance = 0.05;  // of the angular acceleration, held over a step, (rad/s²)²

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    using std::sin;
    const T rate = (1.0 - dt * damping) * x(1) - dt * stiffness * sin(x(0));
    return {x(0) + dt * rate, rate};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x) const {
    using std::cos;
    return around<T>(cos(x(0)));
  }
  /// sin θ = (sin θ / θ) θ.
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& x) const {
    return around<T>(sine_ratio(x(0)));
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {dt * dt, dt}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(variance); }

  /// sin(a)/a, by its series where the quotient would lose digits of the derivative; exact to rounding there.
  template <typename T>
  static T sine_ratio(const T& a) {
    using std::sin;
    const T squared = a * a;
    if (squared < 1e-4) return 1.0 - squared / 6.0 * (1.0 - squared / 20.0 * (1.0 - squared / 42.0));
    return sin(a) / a;
  }

 private:
  template <typename T>
  jml::Matrix<T, 2, 2> around(const T& slope) const {
    const double keep = 1.0 - dt * damping;
    jml::Matrix<T, 2, 2> F;
    F << 1.0 - dt * dt * stiffness * slope, T(dt * keep), -dt * stiffness * slope, T(keep);
    return F;
  }
};

/// y = θ + v, rad; an encoder that counts turns: no wrapping.
struct AngleSensor {
  static constexpr int measurements = 1;
  double r = 1e-3;  // rad²

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>&) const {
    return {T(1), T(0)};
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_sdc(const jml::Vector<T, 2>&) const {
    return {T(1), T(0)};
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};

/// y = sin θ + v: the horizontal position of the bob, m for l = 1 m.
struct SineSensor {
  static constexpr int measurements = 1;
  double r = 1e-2;  // m²

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sin;
    return jml::Vector<T, 1>(sin(x(0)));
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>& x) const {
    using std::cos;
    return {cos(x(0)), T(0)};
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_sdc(const jml::Vector<T, 2>& x) const {
    return {Pendulum::sine_ratio(x(0)), T(0)};
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};

}  // namespace models
