// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Continuous-time models: the oscillator of both papers of Rusnak (2018, section 6; 2015, eqs. (19)-(23))
/// with its saturating position sensor, and a ballistic target seen by a radar. The defaults are the
/// chapter's of 2018.
#pragma once

#include <cmath>
#include <jml/model/traits.hpp>

#include "radar.hpp"
#include "van_der_pol.hpp"

namespace models {

/// x = (position, velocity): µ ξ'' + 2 c (ξ² - 1) ξ' + k ξ = w.
struct Oscillator {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  double mu = 1, c = 0.01, k = 0.1, q = 1;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1), (-k * x(0) - 2 * c * (x(0) * x(0) - 1.0) * x(1)) / mu};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x) const {
    jml::Matrix<T, 2, 2> J;
    J << T(0), T(1), -(k + 4 * c * x(0) * x(1)) / mu, -2 * c * (x(0) * x(0) - 1.0) / mu;
    return J;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& x) const {
    jml::Matrix<T, 2, 2> F;
    F << T(0), T(1), T(-k / mu), -2 * c * (x(0) * x(0) - 1.0) / mu;
    return F;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1 / mu}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(q); }
};

/// y = ξ / sqrt(1 + ξ²) + v, all the time.
struct SaturatingSignal {
  static constexpr int measurements = 1;
  double r = 1e-5;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return SaturatingPosition{}.measurement(x);
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>& x) const {
    return SaturatingPosition{}.measurement_jacobian(x);
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_sdc(const jml::Vector<T, 2>& x) const {
    return SaturatingPosition{}.measurement_sdc(x);
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(r); }
};

/// Three of them in a row, coupled by springs: x = (3 positions, 3 velocities).
struct OscillatorChain {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 6, disturbances = 3;
  double c = 0.01, k = 0.1, coupling = 0.05, q = 1;

  template <typename T>
  jml::Vector<T, 6> dynamics(const jml::Vector<T, 6>& x) const {
    return dynamics_sdc(x) * x;
  }
  template <typename T>
  jml::Matrix<T, 6, 6> dynamics_sdc(const jml::Vector<T, 6>& x) const {
    jml::Matrix<T, 6, 6> F = jml::Matrix<T, 6, 6>::Zero();
    for (int i = 0; i < 3; ++i) {
      F(i, 3 + i) = T(1);
      F(3 + i, i) = T(-k - (i == 1 ? 2 : 1) * coupling);
      F(3 + i, 3 + i) = -2 * c * (x(i) * x(i) - 1.0);
    }
    F(3, 1) = F(4, 0) = F(4, 2) = F(5, 1) = T(coupling);
    return F;
  }
  template <typename T>
  jml::Matrix<T, 6, 6> dynamics_jacobian(const jml::Vector<T, 6>& x) const {
    jml::Matrix<T, 6, 6> J = dynamics_sdc(x);
    for (int i = 0; i < 3; ++i) J(3 + i, i) -= 4 * c * x(i) * x(3 + i);
    return J;
  }
  jml::Matrix<double, 6, 3> disturbance_input() const {
    jml::Matrix<double, 6, 3> G = jml::Matrix<double, 6, 3>::Zero();
    for (int i = 0; i < 3; ++i) G(3 + i, i) = 1;
    return G;
  }
  jml::Matrix<double, 3, 3> disturbance_spectral_density() const {
    return q * jml::Matrix<double, 3, 3>::Identity();
  }
};

/// y_i = ξ_i / sqrt(1 + ξ_i²) + v_i of a chain, all the time.
struct SaturatingSignals {
  static constexpr int measurements = 3;
  double r = 1e-5;

  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    jml::Vector<T, 3> y;
    for (int i = 0; i < 3; ++i) y(i) = x(i) / sqrt(1.0 + x(i) * x(i));
    return y;
  }
  template <typename T>
  jml::Matrix<T, 3, 6> measurement_jacobian(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    jml::Matrix<T, 3, 6> J = jml::Matrix<T, 3, 6>::Zero();
    for (int i = 0; i < 3; ++i) {
      const T s = 1.0 + x(i) * x(i);
      J(i, i) = 1.0 / (s * sqrt(s));
    }
    return J;
  }
  template <typename T>
  jml::Matrix<T, 3, 6> measurement_sdc(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    jml::Matrix<T, 3, 6> M = jml::Matrix<T, 3, 6>::Zero();
    for (int i = 0; i < 3; ++i) M(i, i) = 1.0 / sqrt(1.0 + x(i) * x(i));
    return M;
  }
  jml::Matrix<double, 3, 3> noise_spectral_density() const {
    return r * jml::Matrix<double, 3, 3>::Identity();
  }
};

/// x = (position, velocity), km and km/s, z up: v' = -drag |v| v + gravity + w.
struct BallisticFlight {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 6, disturbances = 3;
  double drag = 0.02, gravity = 9.80665e-3, acceleration_density = 1e-5;  // 1/km, km/s², (km/s²)²/Hz

  template <typename T>
  jml::Vector<T, 6> dynamics(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    const T rate = -drag * sqrt(x(3) * x(3) + x(4) * x(4) + x(5) * x(5));
    return {x(3), x(4), x(5), rate * x(3), rate * x(4), rate * x(5) - gravity};
  }
  template <typename T>
  jml::Matrix<T, 6, 6> dynamics_sdc(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    const T rate = -drag * sqrt(x(3) * x(3) + x(4) * x(4) + x(5) * x(5));
    jml::Matrix<T, 6, 6> F = jml::Matrix<T, 6, 6>::Zero();
    for (int i = 0; i < 3; ++i) {
      F(i, 3 + i) = T(1);
      F(3 + i, 3 + i) = rate;
    }
    return F;
  }
  template <typename T>
  jml::Matrix<T, 6, 6> dynamics_jacobian(const jml::Vector<T, 6>& x) const {
    using std::sqrt;
    const T speed = sqrt(x(3) * x(3) + x(4) * x(4) + x(5) * x(5));
    jml::Matrix<T, 6, 6> J = dynamics_sdc(x);
    const T factor = drag / speed;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) J(3 + i, 3 + j) -= factor * x(3 + i) * x(3 + j);
    }
    return J;
  }
  jml::Matrix<double, 6, 3> disturbance_input() const {
    jml::Matrix<double, 6, 3> G = jml::Matrix<double, 6, 3>::Zero();
    for (int i = 0; i < 3; ++i) G(3 + i, i) = 1;
    return G;
  }
  jml::Matrix<double, 3, 3> disturbance_spectral_density() const {
    return acceleration_density * jml::Matrix<double, 3, 3>::Identity();
  }
};

/// The radar of radar.hpp, measuring all the time: range, azimuth, elevation in km, rad, rad.
struct RadarSignal : private Radar {
  static constexpr int measurements = 3;
  double range_density = 4e-5, angle_density = 4e-7;  // km²/Hz, rad²/Hz
  using Radar::measurement, Radar::measurement_jacobian, Radar::measurement_sdc, Radar::residual;

  jml::Matrix<double, 3, 3> noise_spectral_density() const {
    jml::Matrix<double, 3, 3> R = jml::Matrix<double, 3, 3>::Zero();
    R(0, 0) = range_density;
    R(1, 1) = R(2, 2) = angle_density;
    return R;
  }
};

}  // namespace models
