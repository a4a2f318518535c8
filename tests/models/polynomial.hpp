// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Polynomial models with every entry coupled to every other, so that a transposed or misplaced matrix shows.
/// Made up for the tests; no source.
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>

namespace models {

/// f_i = c_i + Σ_j A_ij x_j + Σ_jk B_ijk x_j x_k + e x_i² x_{i+1}; q = 2 disturbances through a dense G.
/// `constant` ≠ 0 gives f(0) ≠ 0. B_ijk ≠ B_ikj, so the SDC matrix is not half of the Jacobian's quadratic
/// part.
template <int n>
struct Polynomial {
  static constexpr int states = n, disturbances = 2;
  double constant = 0, bend = 0.05, cubic = 0.02;

  static double c(int i) { return 1.0 + 0.5 * i; }
  static double A(int i, int j) { return (i == j ? 0.6 : 0) + 0.15 * std::sin(1.0 + 3 * i + 7 * j); }
  static double B(int i, int j, int k) { return std::cos(1.0 + 5 * i + 2 * j + 11 * k); }
  static int next(int i) { return (i + 1) % n; }

  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> f;
    for (int i = 0; i < n; ++i) {
      f(i) = T(constant * c(i)) + cubic * x(i) * x(i) * x(next(i));
      for (int j = 0; j < n; ++j) {
        f(i) += A(i, j) * x(j);
        for (int k = 0; k < n; ++k) f(i) += bend * B(i, j, k) * x(j) * x(k);
      }
    }
    return f;
  }
  template <typename T>
  jml::Matrix<T, n, n> dynamics_jacobian(const jml::Vector<T, n>& x) const {
    jml::Matrix<T, n, n> J;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        J(i, j) = T(A(i, j));
        for (int k = 0; k < n; ++k) J(i, j) += bend * (B(i, j, k) + B(i, k, j)) * x(k);
      }
      J(i, i) += 2 * cubic * x(i) * x(next(i));
      J(i, next(i)) += cubic * x(i) * x(i);
    }
    return J;
  }
  /// F(x) x = f(x) - f(0).
  template <typename T>
  jml::Matrix<T, n, n> dynamics_sdc(const jml::Vector<T, n>& x) const {
    jml::Matrix<T, n, n> F;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        F(i, j) = T(A(i, j));
        for (int k = 0; k < n; ++k) F(i, j) += bend * B(i, j, k) * x(k);
      }
      F(i, i) += cubic * x(i) * x(next(i));
    }
    return F;
  }
  jml::Matrix<double, n, 2> disturbance_input() const {
    jml::Matrix<double, n, 2> G;
    for (int i = 0; i < n; ++i) G.row(i) << std::sin(2.0 + i), std::cos(3.0 + 4 * i);
    return G;
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    jml::Matrix<double, 2, 2> Q;
    Q << 0.02, 0.005, 0.005, 0.04;
    return Q;
  }
};

/// m_i = c_i + Σ_j A_ij x_j + Σ_jk B_ijk x_j x_k with a full, correlated R.
template <int n, int p>
struct PolynomialSensor {
  static constexpr int measurements = p;
  double constant = 0, bend = 0.05;

  static double c(int i) { return 0.7 - 0.4 * i; }
  static double A(int i, int j) { return std::cos(2.0 + 5 * i + 3 * j); }
  static double B(int i, int j, int k) { return std::sin(1.0 + 2 * i + 7 * j + 3 * k); }

  template <typename T>
  jml::Vector<T, p> measurement(const jml::Vector<T, n>& x) const {
    jml::Vector<T, p> m;
    for (int i = 0; i < p; ++i) {
      m(i) = T(constant * c(i));
      for (int j = 0; j < n; ++j) {
        m(i) += A(i, j) * x(j);
        for (int k = 0; k < n; ++k) m(i) += bend * B(i, j, k) * x(j) * x(k);
      }
    }
    return m;
  }
  template <typename T>
  jml::Matrix<T, p, n> measurement_jacobian(const jml::Vector<T, n>& x) const {
    jml::Matrix<T, p, n> J;
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j < n; ++j) {
        J(i, j) = T(A(i, j));
        for (int k = 0; k < n; ++k) J(i, j) += bend * (B(i, j, k) + B(i, k, j)) * x(k);
      }
    }
    return J;
  }
  /// M(x) x = m(x) - m(0).
  template <typename T>
  jml::Matrix<T, p, n> measurement_sdc(const jml::Vector<T, n>& x) const {
    jml::Matrix<T, p, n> M;
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j < n; ++j) {
        M(i, j) = T(A(i, j));
        for (int k = 0; k < n; ++k) M(i, j) += bend * B(i, j, k) * x(k);
      }
    }
    return M;
  }
  jml::Matrix<double, p, p> noise_covariance() const {
    jml::Matrix<double, p, p> R;
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j < p; ++j) R(i, j) = i == j ? 0.1 * (i + 1) : 0.02;
    }
    return R;
  }
};

}  // namespace models
