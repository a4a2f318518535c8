// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A ballistic target with drag, seen by a radar at the origin: n = 6, p = 3.
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>

namespace models {

/// x = (position, velocity), km and km/s, z up. One Euler step of v' = -drag |v| v + g + w.
struct BallisticTarget {
  static constexpr int states = 6, disturbances = 3;
  double dt = 0.1, drag = 0.02, gravity = 9.80665e-3, acceleration_variance = 1e-4;

  template <typename T>
  jml::Vector<T, 6> dynamics(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    const T keep = 1.0 - dt * drag * sqrt(x(3) * x(3) + x(4) * x(4) + x(5) * x(5));
    jml::Vector<T, 6> out;
    for (int i = 0; i < 3; ++i) {
      out(i) = x(i) + dt * x(3 + i);
      out(3 + i) = keep * x(3 + i);
    }
    out(5) -= dt * gravity;
    return out;
  }
  template <typename T>
  jml::Matrix<T, 6, 6> dynamics_sdc(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    const T keep = 1.0 - dt * drag * sqrt(x(3) * x(3) + x(4) * x(4) + x(5) * x(5));
    jml::Matrix<T, 6, 6> F = jml::Matrix<T, 6, 6>::Identity();
    for (int i = 0; i < 3; ++i) {
      F(i, 3 + i) = T(dt);
      F(3 + i, 3 + i) = keep;
    }
    return F;
  }
  template <typename T>
  jml::Matrix<T, 6, 6> dynamics_jacobian(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    const T speed = sqrt(x(3) * x(3) + x(4) * x(4) + x(5) * x(5));
    jml::Matrix<T, 6, 6> J = dynamics_sdc(x);
    const T factor = dt * drag / speed;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) J(3 + i, 3 + j) -= factor * x(3 + i) * x(3 + j);
    }
    return J;
  }
  jml::Matrix<double, 6, 3> disturbance_input() const {
    jml::Matrix<double, 6, 3> G = jml::Matrix<double, 6, 3>::Zero();
    for (int i = 0; i < 3; ++i) G(3 + i, i) = dt;
    return G;
  }
  jml::Matrix<double, 3, 3> disturbance_covariance() const {
    return acceleration_variance * jml::Matrix<double, 3, 3>::Identity();
  }
};

/// y = (range, azimuth, elevation): km, rad, rad; azimuth wraps.
struct Radar {
  static constexpr int measurements = 3;
  double range_sd = 0.02, angle_sd = 2e-3;

  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 6>& x) const {
    using std::atan2, std::sqrt;
    const T ground = x(0) * x(0) + x(1) * x(1);
    return {sqrt(ground + x(2) * x(2)), atan2(x(1), x(0)), atan2(x(2), sqrt(ground))};
  }
  template <typename T>
  jml::Matrix<T, 3, 6> measurement_jacobian(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    const T ground = x(0) * x(0) + x(1) * x(1), squared = ground + x(2) * x(2);
    const T distance = sqrt(ground), inverse_range = 1.0 / sqrt(squared);
    const T climb = x(2) / (squared * distance);
    jml::Matrix<T, 3, 6> J = jml::Matrix<T, 3, 6>::Zero();
    J(0, 0) = x(0) * inverse_range;
    J(0, 1) = x(1) * inverse_range;
    J(0, 2) = x(2) * inverse_range;
    J(1, 0) = -x(1) / ground;
    J(1, 1) = x(0) / ground;
    J(2, 0) = -x(0) * climb;
    J(2, 1) = -x(1) * climb;
    J(2, 2) = distance / squared;
    return J;
  }
  /// A SDC about the origin: M(x) x = m(x), each row along the components it depends on.
  template <typename T>
  jml::Matrix<T, 3, 6> measurement_sdc(const jml::Vector<T, 6>& x) const {
    using std::atan2, std::sqrt;
    const T ground = x(0) * x(0) + x(1) * x(1), squared = ground + x(2) * x(2);
    const T inverse_range = 1.0 / sqrt(squared);
    const T azimuth = atan2(x(1), x(0)) / ground, elevation = atan2(x(2), sqrt(ground)) / squared;
    jml::Matrix<T, 3, 6> M = jml::Matrix<T, 3, 6>::Zero();
    for (int i = 0; i < 3; ++i) {
      M(0, i) = x(i) * inverse_range;
      M(2, i) = x(i) * elevation;
    }
    M(1, 0) = x(0) * azimuth;
    M(1, 1) = x(1) * azimuth;
    return M;
  }
  template <typename T>
  jml::Vector<T, 3> residual(const jml::Vector<T, 3>& y, const jml::Vector<T, 3>& predicted) const {
    jml::Vector<T, 3> r = y - predicted;
    constexpr double turn = 6.283185307179586;
    if (r(1) > turn / 2) r(1) -= turn;
    if (r(1) < -turn / 2) r(1) += turn;
    return r;
  }
  jml::Matrix<double, 3, 3> noise_covariance() const {
    jml::Matrix<double, 3, 3> R = jml::Matrix<double, 3, 3>::Zero();
    R(0, 0) = range_sd * range_sd;
    R(1, 1) = R(2, 2) = angle_sd * angle_sd;
    return R;
  }
};

}  // namespace models
