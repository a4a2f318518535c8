// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Continuous models whose region of stability can be worked out by hand: copies of ẋ = a x, h = x - x³, and
/// a linear system.
#pragma once

#include <jml/model/traits.hpp>

namespace models {

/// n copies, not coupled: x_i' = a_i x_i + w_i.
template <int n>
struct Copies {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = n, disturbances = n;
  jml::Vector<double, n> a, q;

  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> f;
    for (int i = 0; i < n; ++i) f(i) = a(i) * x(i);
    return f;
  }
  jml::Matrix<double, n, n> dynamics_sdc(const jml::Vector<double, n>&) const { return a.asDiagonal(); }
  jml::Matrix<double, n, n> disturbance_input() const { return jml::Matrix<double, n, n>::Identity(); }
  jml::Matrix<double, n, n> disturbance_spectral_density() const { return q.asDiagonal(); }
};

/// y_i = x_i - x_i³ / s_i² + v_i: blind to x_i at ±s_i.
template <int n>
struct TurningSignals {
  static constexpr int measurements = n;
  jml::Vector<double, n> r, s = jml::Vector<double, n>::Ones();

  template <typename T>
  jml::Vector<T, n> measurement(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> h;
    for (int i = 0; i < n; ++i) h(i) = x(i) - x(i) * x(i) * x(i) * (1 / (s(i) * s(i)));
    return h;
  }
  jml::Matrix<double, n, n> measurement_sdc(const jml::Vector<double, n>& x) const {
    jml::Matrix<double, n, n> H = jml::Matrix<double, n, n>::Zero();
    for (int i = 0; i < n; ++i) H(i, i) = 1 - x(i) * x(i) / (s(i) * s(i));
    return H;
  }
  jml::Matrix<double, n, n> noise_spectral_density() const { return r.asDiagonal(); }
};

/// x' = F x + G w.
template <int n, int q>
struct LinearFlow {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = n, disturbances = q;
  jml::Matrix<double, n, n> F;
  jml::Matrix<double, n, q> G;

  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    return F.template cast<T>() * x;
  }
  template <typename T>
  jml::Matrix<T, n, n> dynamics_jacobian(const jml::Vector<T, n>&) const {
    return F.template cast<T>();
  }
  template <typename T>
  jml::Matrix<T, n, n> dynamics_sdc(const jml::Vector<T, n>&) const {
    return F.template cast<T>();
  }
  jml::Matrix<double, n, q> disturbance_input() const { return G; }
  jml::Matrix<double, q, q> disturbance_spectral_density() const {
    return jml::Matrix<double, q, q>::Identity();
  }
};

/// y = M x + v, all the time.
template <int n, int p>
struct LinearSignal {
  static constexpr int measurements = p;
  jml::Matrix<double, p, n> M;
  double r = 1;

  template <typename T>
  jml::Vector<T, p> measurement(const jml::Vector<T, n>& x) const {
    return M.template cast<T>() * x;
  }
  template <typename T>
  jml::Matrix<T, p, n> measurement_jacobian(const jml::Vector<T, n>&) const {
    return M.template cast<T>();
  }
  template <typename T>
  jml::Matrix<T, p, n> measurement_sdc(const jml::Vector<T, n>&) const {
    return M.template cast<T>();
  }
  jml::Matrix<double, p, p> noise_spectral_density() const {
    return r * jml::Matrix<double, p, p>::Identity();
  }
};

}  // namespace models
