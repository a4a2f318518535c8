// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A vehicle entering the atmosphere, seen by a radar on the ground. Julier and Uhlmann, "Unscented filtering
/// and nonlinear estimation", Proc. IEEE 92 (2004); figures as in the EKF/UKF toolbox manual (Hartikainen,
/// Solin and Särkkä 2011). Units: km, s.
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>

namespace models {

/// x = (position, velocity, drag parameter), one Euler step:
/// v' = D v - Gm/|p|³ p, D = b0 exp(x5) exp((R0 - |p|)/H0) |v|; noise on both velocities and the parameter.
struct ReentryVehicle {
  static constexpr int states = 5, disturbances = 3;
  double dt = 0.1, b0 = -0.59783, H0 = 13.406, Gm = 3.9860e5, R0 = 6374;
  double velocity_variance = 2.4064e-5, parameter_variance = 1e-6;  // per step

  template <typename T>
  jml::Vector<T, 5> dynamics(const jml::Vector<T, 5>& x) const {
    const T drag = this->drag(x), gravity = this->gravity(x);
    jml::Vector<T, 5> out;
    out(4) = x(4);
    for (int i = 0; i < 2; ++i) {
      out(i) = x(i) + dt * x(2 + i);
      out(2 + i) = x(2 + i) + dt * (drag * x(2 + i) + gravity * x(i));
    }
    return out;
  }
  /// F(x) x = f(x): drag and gravity along the velocity and position they multiply.
  template <typename T>
  jml::Matrix<T, 5, 5> dynamics_sdc(const jml::Vector<T, 5>& x) const {
    const T drag = this->drag(x), gravity = this->gravity(x);
    jml::Matrix<T, 5, 5> F = jml::Matrix<T, 5, 5>::Identity();
    for (int i = 0; i < 2; ++i) {
      F(i, 2 + i) = T(dt);
      F(2 + i, i) = dt * gravity;
      F(2 + i, 2 + i) += dt * drag;
    }
    return F;
  }
  jml::Matrix<double, 5, 3> disturbance_input() const {
    jml::Matrix<double, 5, 3> G = jml::Matrix<double, 5, 3>::Zero();
    G.bottomRows<3>().setIdentity();
    return G;
  }
  jml::Matrix<double, 3, 3> disturbance_covariance() const {
    return jml::Vector<double, 3>(velocity_variance, velocity_variance, parameter_variance).asDiagonal();
  }

 private:
  template <typename T>
  T drag(const jml::Vector<T, 5>& x) const {
    using std::exp, std::sqrt;
    const T radius = sqrt(x(0) * x(0) + x(1) * x(1)), speed = sqrt(x(2) * x(2) + x(3) * x(3));
    return b0 * exp(x(4) + (R0 - radius) / H0) * speed;
  }
  template <typename T>
  T gravity(const jml::Vector<T, 5>& x) const {
    using std::sqrt;
    const T squared = x(0) * x(0) + x(1) * x(1);
    return -Gm / (squared * sqrt(squared));
  }
};

/// y = (range, bearing) from a radar at (6374, 0): km, rad; the bearing wraps.
struct GroundRadar {
  static constexpr int measurements = 2;
  double at_x = 6374, at_y = 0, range_sd = 1e-3, bearing_sd = 0.17e-3;

  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 5>& x) const {
    using std::atan2, std::sqrt;
    const T dx = x(0) - at_x, dy = x(1) - at_y;
    return {sqrt(dx * dx + dy * dy), atan2(dy, dx)};
  }
  template <typename T>
  jml::Vector<T, 2> residual(const jml::Vector<T, 2>& y, const jml::Vector<T, 2>& predicted) const {
    jml::Vector<T, 2> r = y - predicted;
    constexpr double half = 3.141592653589793;
    if (r(1) > half) r(1) -= 2 * half;
    if (r(1) < -half) r(1) += 2 * half;
    return r;
  }
  jml::Matrix<double, 2, 2> noise_covariance() const {
    return jml::Vector<double, 2>(range_sd * range_sd, bearing_sd * bearing_sd).asDiagonal();
  }
};

}  // namespace models
