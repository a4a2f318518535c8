// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One sample of the RNLS filter as somebody writes it by hand for one size: a Runge-Kutta step in plain
/// loops, 1/R at hand, nothing checked and nothing reported. The yardstick of rnls_sample/rk4; the model's
/// functions are the same.
#pragma once

#include <jml/linear_algebra.hpp>

namespace limit {

template <int n>
struct FlowState {
  double x[n], P[n][n];
};

/// ẋ and Ṗ of eqs. (17), (19), for diagonal R.
template <int n, int p, typename D, typename S>
inline void rnls_slope(const D& dynamics, const S& sensor, const double (&noise)[n][n],
                       const double (&inverse_R)[p], const jml::Vector<double, p>& y, const FlowState<n>& z,
                       FlowState<n>& slope) {
  const jml::Vector<double, n> x = Eigen::Map<const jml::Vector<double, n>>(z.x);
  const auto F = dynamics.dynamics_sdc(x), f_x = dynamics.dynamics_jacobian(x);
  const auto M = sensor.measurement_sdc(x), m_x = sensor.measurement_jacobian(x);
  const auto f = dynamics.dynamics(x);
  const auto m = sensor.measurement(x);
  double K[n][p], closed[n][n];
  for (int i = 0; i < n; ++i) {
    double sum = f(i);
    for (int j = 0; j < p; ++j) {
      double gain = 0;
      for (int k = 0; k < n; ++k) gain += z.P[i][k] * m_x(j, k);
      K[i][j] = gain * inverse_R[j];
      sum += K[i][j] * (y(j) - m(j));
    }
    slope.x[i] = sum;
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      double sum = F(i, j);
      for (int k = 0; k < p; ++k) sum -= K[i][k] * M(k, j);
      closed[i][j] = sum;
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      double sum = noise[i][j];
      for (int k = 0; k < n; ++k) sum += closed[i][k] * z.P[k][j];
      for (int k = 0; k < n; ++k) sum += z.P[i][k] * f_x(j, k);
      slope.P[i][j] = sum;
    }
  }
}

template <int n>
inline void move(const FlowState<n>& from, double h, const FlowState<n>& slope, FlowState<n>& to) {
  for (int i = 0; i < n; ++i) to.x[i] = from.x[i] + h * slope.x[i];
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) to.P[i][j] = from.P[i][j] + h * slope.P[i][j];
  }
}

template <int n, int p, typename D, typename S>
inline void rnls_sample(const D& dynamics, const S& sensor, const double (&noise)[n][n],
                        const double (&inverse_R)[p], const jml::Vector<double, p>& y, double h,
                        FlowState<n>& z) {
  FlowState<n> slope, at, sum;
  rnls_slope<n, p>(dynamics, sensor, noise, inverse_R, y, z, slope);
  move(z, h / 6, slope, sum);
  move(z, h / 2, slope, at);
  rnls_slope<n, p>(dynamics, sensor, noise, inverse_R, y, at, slope);
  move(sum, h / 3, slope, sum);
  move(z, h / 2, slope, at);
  rnls_slope<n, p>(dynamics, sensor, noise, inverse_R, y, at, slope);
  move(sum, h / 3, slope, sum);
  move(z, h, slope, at);
  rnls_slope<n, p>(dynamics, sensor, noise, inverse_R, y, at, slope);
  move(sum, h / 6, slope, z);
}

}  // namespace limit
