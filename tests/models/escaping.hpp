// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Continuous models whose RNLS Riccati equation has a finite escape time though Q ≥ 0 and R > 0: at the
/// state they rest at, the sensor's SDC coefficient M and its Jacobian m_x have opposite signs, so the
/// quadratic term feeds P instead of damping it. Feed them y = m(x); the numbers below are exact in binary,
/// so x̂ stays. Escape times: tests/filter/continuous_reference.hpp. Made up for the tests.
#pragma once

#include <jml/model/traits.hpp>

namespace models {

/// n copies of f = 2 x (x - 1). At x = 1: f = 0, F = 0, f_x = 2.
template <int n>
struct EscapingCopies {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = n, disturbances = n;

  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> f;
    for (int i = 0; i < n; ++i) f(i) = 2.0 * x(i) * (x(i) - 1.0);
    return f;
  }
  template <typename T>
  jml::Matrix<T, n, n> dynamics_sdc(const jml::Vector<T, n>& x) const {
    jml::Matrix<T, n, n> F = jml::Matrix<T, n, n>::Zero();
    for (int i = 0; i < n; ++i) F(i, i) = 2.0 * (x(i) - 1.0);
    return F;
  }
  jml::Matrix<double, n, n> disturbance_input() const { return jml::Matrix<double, n, n>::Identity(); }
  jml::Matrix<double, n, n> disturbance_spectral_density() const {
    return jml::Matrix<double, n, n>::Identity();
  }
};

/// n copies of m = x (3 - 2 x). At x = 1: m = 1, M = 1, m_x = -1; with R = 1 and the dynamics above the RNLS
/// filter has P' = 2 P + 1 + P² for each copy.
template <int n>
struct EscapingCopiesSensor {
  static constexpr int measurements = n;

  template <typename T>
  jml::Vector<T, n> measurement(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> m;
    for (int i = 0; i < n; ++i) m(i) = x(i) * (3.0 - 2.0 * x(i));
    return m;
  }
  template <typename T>
  jml::Matrix<T, n, n> measurement_sdc(const jml::Vector<T, n>& x) const {
    jml::Matrix<T, n, n> M = jml::Matrix<T, n, n>::Zero();
    for (int i = 0; i < n; ++i) M(i, i) = 3.0 - 2.0 * x(i);
    return M;
  }
  jml::Matrix<double, n, n> noise_spectral_density() const { return jml::Matrix<double, n, n>::Identity(); }
};

/// f = (b - a/2, b (3/4 - a)), at rest at (0.75, 0.375), where F = [-1/2 1; -3/8 3/4], f_x = [-1/2 1; -3/8
/// 0].
struct EscapingPair {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1) - 0.5 * x(0), x(1) * (0.75 - x(0))};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& x) const {
    jml::Matrix<T, 2, 2> F;
    F << T(-0.5), T(1), -x(1), T(0.75);
    return F;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0.5, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(1); }
};

/// m = a - a³, R = 1/8. At a = 0.75: m = 0.328125, M = 0.4375, m_x = -0.6875.
struct EscapingPairSensor {
  static constexpr int measurements = 1;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0) - x(0) * x(0) * x(0));
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_sdc(const jml::Vector<T, 2>& x) const {
    return {1.0 - x(0) * x(0), T(0)};
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(0.125); }
};

}  // namespace models
