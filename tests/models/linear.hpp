// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Linear systems, random but reproducible: on them every estimator of the library is the Kalman filter.
#pragma once

#include <jml/model/step_context.hpp>
#include <jml/campaign/noise.hpp>

namespace models {

/// x⁺ = F x + G w. No Jacobian and no SDC matrix is given: the library derives both.
template <int n, int q>
struct LinearDynamics {
  static constexpr int states = n, disturbances = q;
  static constexpr bool linear = true;
  jml::Matrix<double, n, n> F;
  jml::Matrix<double, n, q> G;
  jml::Matrix<double, q, q> Q;

  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    return F.template cast<T>() * x;
  }
  jml::Matrix<double, n, q> disturbance_input() const { return G; }
  jml::Matrix<double, q, q> disturbance_covariance() const { return Q; }
};

/// y = M x + v.
template <int n, int p>
struct LinearSensor {
  static constexpr int measurements = p;
  static constexpr bool linear = true;
  jml::Matrix<double, p, n> M;
  jml::Matrix<double, p, p> R;

  template <typename T>
  jml::Vector<T, p> measurement(const jml::Vector<T, n>& x) const {
    return M.template cast<T>() * x;
  }
  jml::Matrix<double, p, p> noise_covariance() const { return R; }
};

/// Two axes of position and velocity, x = (p0, v0, p1, v1), exact over any dt; the white acceleration's
/// covariance per step depends on dt, so Q is read anew at each step. Units: m, m/s, m/s².
struct ConstantVelocity {
  static constexpr int states = 4, disturbances = 4;
  static constexpr bool linear = true;
  double q_c = 0.3;  // spectral density of the acceleration, (m/s²)²/Hz

  template <typename T, typename At>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x, const At& at) const {
    return {x(0) + at.dt * x(1), x(1), x(2) + at.dt * x(3), x(3)};
  }
  template <typename T, typename At>
  jml::Matrix<double, 4, 4> disturbance_covariance(const jml::Vector<T, 4>&, const At& at) const {
    const double dt = at.dt;
    jml::Matrix<double, 4, 4> Q = jml::Matrix<double, 4, 4>::Zero();
    for (int i = 0; i < 4; i += 2) {
      Q(i, i) = q_c * dt * dt * dt / 3;
      Q(i, i + 1) = Q(i + 1, i) = q_c * dt * dt / 2;
      Q(i + 1, i + 1) = q_c * dt;
    }
    return Q;
  }
};

/// Entries uniform in (-1, 1).
template <int rows, int cols>
jml::Matrix<double, rows, cols> random_matrix(jml::Noise& noise) {
  jml::Matrix<double, rows, cols> a;
  for (int j = 0; j < cols; ++j) {
    for (int i = 0; i < rows; ++i) a(i, j) = noise.uniform(-1, 1);
  }
  return a;
}

/// a aᵀ + floor I, exactly symmetric.
template <int n>
jml::Matrix<double, n, n> random_covariance(jml::Noise& noise, double floor) {
  const auto a = random_matrix<n, n>(noise);
  jml::Matrix<double, n, n> c = floor * jml::Matrix<double, n, n>::Identity();
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i) {
      for (int k = 0; k < n; ++k) c(i, j) += a(i, k) * a(j, k);
      c(j, i) = c(i, j);
    }
  }
  return c;
}

/// Mildly stable (largest row sum of |F| is 0.98) and dense.
template <int n, int q>
LinearDynamics<n, q> random_linear_dynamics(jml::Noise& noise) {
  LinearDynamics<n, q> d;
  d.F = random_matrix<n, n>(noise);
  d.F *= 0.98 / d.F.cwiseAbs().rowwise().sum().maxCoeff();
  d.G = random_matrix<n, q>(noise);
  d.Q = random_covariance<q>(noise, 0.05);
  return d;
}

template <int n, int p>
LinearSensor<n, p> random_linear_sensor(jml::Noise& noise) {
  LinearSensor<n, p> s;
  s.M = random_matrix<p, n>(noise);
  s.R = random_covariance<p>(noise, 0.1);
  return s;
}

}  // namespace models
