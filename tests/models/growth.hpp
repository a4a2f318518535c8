// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The univariate nonstationary growth model (Gordon, Salmond and Smith 1993; figures as in the EKF/UKF
/// toolbox manual): two lobes, a measurement blind to the sign, so the density of x has two peaks most of the
/// time.
#pragma once

#include <cmath>
#include <jml/model/step_context.hpp>

namespace models {

/// x⁺ = x/2 + 25 x/(1 + x²) + 8 cos(1.2 k) + w, with k = at.time, the number of the sample stepped from; Q
/// = 1.
struct Growth {
  static constexpr int states = 1, disturbances = 1;

  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(0.5 * x(0) + 25.0 * x(0) / (1.0 + x(0) * x(0)) + 8 * std::cos(1.2 * at.time));
  }
  /// x/(1 + x²) is (1/(1 + x²)) x; the cosine is f(0).
  template <typename T>
  jml::Matrix<T, 1, 1> dynamics_sdc(const jml::Vector<T, 1>& x) const {
    return jml::Matrix<T, 1, 1>(0.5 + 25.0 / (1.0 + x(0) * x(0)));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(1); }
};

/// y = x²/20 + v, R = 1.
struct SquareSensor {
  static constexpr int measurements = 1;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0) / 20.0);
  }
  template <typename T>
  jml::Matrix<T, 1, 1> measurement_sdc(const jml::Vector<T, 1>& x) const {
    return jml::Matrix<T, 1, 1>(x(0) / 20.0);
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(1); }
};

}  // namespace models
