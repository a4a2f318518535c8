// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A target seen by two direction finders: bearings-only tracking of the EKF/UKF toolbox manual (Hartikainen,
/// Solin and Särkkä 2011). Lengths and times without units, bearings in rad.
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>

namespace models {

/// x = (position, velocity) in the plane, white acceleration of spectral density q_c on each axis, exact over
/// dt.
struct WhiteAcceleration {
  static constexpr int states = 4, disturbances = 4;
  static constexpr bool linear = true;
  double dt = 0.01, q_c = 0.1;

  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x) const {
    return {x(0) + dt * x(2), x(1) + dt * x(3), x(2), x(3)};
  }
  jml::Matrix<double, 4, 4> disturbance_covariance() const {
    jml::Matrix<double, 4, 4> Q = jml::Matrix<double, 4, 4>::Zero();
    for (int i = 0; i < 2; ++i) {
      Q(i, i) = q_c * dt * dt * dt / 3;
      Q(i, 2 + i) = Q(2 + i, i) = q_c * dt * dt / 2;
      Q(2 + i, 2 + i) = q_c * dt;
    }
    return Q;
  }
};

/// y = the bearings of the target from (-1, -2) and (1, 1); they wrap.
struct DirectionFinders {
  static constexpr int measurements = 2;
  double sd = 0.05;
  static constexpr double at[2][2] = {{-1, -2}, {1, 1}};

  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 4>& x) const {
    using std::atan2;
    jml::Vector<T, 2> out;
    for (int i = 0; i < 2; ++i) {
      const T dx = x(0) - at[i][0], dy = x(1) - at[i][1];
      out(i) = atan2(dy, dx);
    }
    return out;
  }
  template <typename T>
  jml::Vector<T, 2> residual(const jml::Vector<T, 2>& y, const jml::Vector<T, 2>& predicted) const {
    jml::Vector<T, 2> r = y - predicted;
    constexpr double half = 3.141592653589793;
    for (int i = 0; i < 2; ++i) {
      if (r(i) > half) r(i) -= 2 * half;
      if (r(i) < -half) r(i) += 2 * half;
    }
    return r;
  }
  jml::Matrix<double, 2, 2> noise_covariance() const {
    return sd * sd * jml::Matrix<double, 2, 2>::Identity();
  }
};

}  // namespace models
