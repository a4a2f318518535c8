// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A dense, mildly nonlinear system of any size, for timing: no zero that a clever product could skip.
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>

namespace models {

/// x⁺ = A x + bend · x³ (by component), Q = q I.
template <int n>
struct DenseDynamics {
  static constexpr int states = n, disturbances = n;
  jml::Matrix<double, n, n> A;
  jml::Matrix<double, n, n> Q = 1e-3 * jml::Matrix<double, n, n>::Identity();
  double bend = -0.01;

  DenseDynamics() {
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) A(i, j) = (i == j ? 0.9 : 0) + 0.1 * std::sin(1.0 + 3 * i + 7 * j) / n;
    }
  }
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> out = A.template cast<T>() * x;
    for (int i = 0; i < n; ++i) out(i) += bend * x(i) * x(i) * x(i);
    return out;
  }
  jml::Matrix<double, n, n> dynamics_jacobian(const jml::Vector<double, n>& x) const {
    jml::Matrix<double, n, n> J = A;
    for (int i = 0; i < n; ++i) J(i, i) += 3 * bend * x(i) * x(i);
    return J;
  }
  jml::Matrix<double, n, n> dynamics_sdc(const jml::Vector<double, n>& x) const {
    jml::Matrix<double, n, n> F = A;
    for (int i = 0; i < n; ++i) F(i, i) += bend * x(i) * x(i);
    return F;
  }
  jml::Matrix<double, n, n> disturbance_covariance() const { return Q; }
};

/// y = H x + bend · (H x)³ (by component), R = r I.
template <int n, int p>
struct DenseSensor {
  static constexpr int measurements = p;
  jml::Matrix<double, p, n> H;
  double bend = 0.01, r = 0.1;

  DenseSensor() {
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j < n; ++j) H(i, j) = std::cos(2.0 + 5 * i + 3 * j);
    }
  }
  template <typename T>
  jml::Vector<T, p> measurement(const jml::Vector<T, n>& x) const {
    jml::Vector<T, p> out = H.template cast<T>() * x;
    for (int i = 0; i < p; ++i) out(i) += bend * out(i) * out(i) * out(i);
    return out;
  }
  jml::Matrix<double, p, n> measurement_jacobian(const jml::Vector<double, n>& x) const {
    jml::Matrix<double, p, n> J = H;
    const jml::Vector<double, p> z = H * x;
    for (int i = 0; i < p; ++i) J.row(i) *= 1 + 3 * bend * z(i) * z(i);
    return J;
  }
  jml::Matrix<double, p, n> measurement_sdc(const jml::Vector<double, n>& x) const {
    jml::Matrix<double, p, n> M = H;
    const jml::Vector<double, p> z = H * x;
    for (int i = 0; i < p; ++i) M.row(i) *= 1 + bend * z(i) * z(i);
    return M;
  }
  jml::Matrix<double, p, p> noise_covariance() const { return r * jml::Matrix<double, p, p>::Identity(); }
};

}  // namespace models
