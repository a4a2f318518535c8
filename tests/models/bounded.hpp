// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The test models with bounds beside their covariances: a uniform density of bound u has the variance u²/3.
#pragma once

#include <jml/bounded/box.hpp>

#include "models/linear.hpp"
#include "models/pendulum.hpp"
#include "models/van_der_pol.hpp"

namespace models {

/// The bound of a uniform density of this variance.
inline jml::Vector<double, 1> bound_of(double variance) {
  return jml::Vector<double, 1>(std::sqrt(3 * variance));
}

struct BoundedPendulum : Pendulum {
  jml::Vector<double, 1> disturbance_bound() const { return bound_of(variance); }
};
struct BoundedAngleSensor : AngleSensor {
  static constexpr bool linear = true;
  jml::Vector<double, 1> noise_bound() const { return bound_of(r); }
};
struct BoundedVanDerPol : VanDerPol {
  jml::Vector<double, 1> disturbance_bound() const { return bound_of(q_c / dt); }
};
struct BoundedSaturatingPosition : SaturatingPosition {
  jml::Vector<double, 1> noise_bound() const { return bound_of(r); }
};

/// x⁺ = F x + G w, |w| ≤ bound.
template <int n, int q>
struct BoundedLinear : LinearDynamics<n, q> {
  jml::Vector<double, q> bound;
  BoundedLinear(const jml::Matrix<double, n, n>& transition, const jml::Matrix<double, n, q>& input,
                const jml::Vector<double, q>& u)
      : LinearDynamics<n, q>{transition, input, jml::Vector<double, q>(u.cwiseAbs2() / 3).asDiagonal()},
        bound(u) {}
  jml::Vector<double, q> disturbance_bound() const { return bound; }
};

/// y = M x + v, |v| ≤ bound. A row may pick a state or combine several.
template <int n, int p>
struct BoundedLinearSensor : LinearSensor<n, p> {
  jml::Vector<double, p> bound;
  BoundedLinearSensor(const jml::Matrix<double, p, n>& rows, const jml::Vector<double, p>& b)
      : LinearSensor<n, p>{rows, jml::Vector<double, p>(b.cwiseAbs2() / 3).asDiagonal()}, bound(b) {}
  jml::Vector<double, p> noise_bound() const { return bound; }
};

/// Bounded-noise dissertation, chapter IV, example 2: a second-order plant sampled every 0.1 s, its input
/// white and uniform in ±√10, its first state measured with noise in ±1.
inline BoundedLinear<2, 1> second_order_plant() {
  return {(jml::Matrix<double, 2, 2>() << .99884, .09512, -.02283, .90371).finished(),
          {.00484, .09512},
          jml::Vector<double, 1>(std::sqrt(10.0))};
}
inline BoundedLinearSensor<2, 1> first_state() { return {{1, 0}, jml::Vector<double, 1>(1.0)}; }

/// A vehicle in the plane, x = (east, north, their rates), m and m/s; its acceleration is within the bound.
struct BoundedVehicle {
  static constexpr int states = 4, disturbances = 2;
  static constexpr bool linear = true;
  double dt = 0.1, acceleration = 0.5;  // s, m/s²

  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x) const {
    return {x(0) + dt * x(2), x(1) + dt * x(3), x(2), x(3)};
  }
  jml::Matrix<double, 4, 2> disturbance_input() const {
    jml::Matrix<double, 4, 2> G;
    G << dt * dt / 2, 0, 0, dt * dt / 2, dt, 0, 0, dt;
    return G;
  }
  jml::Vector<double, 2> disturbance_bound() const { return {acceleration, acceleration}; }
};

/// Its distance from a station, m.
struct BoundedRange {
  static constexpr int measurements = 1;
  double east = 0, north = 0, bound = 0.1;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 4>& x) const {
    using std::sqrt;
    const T dx = x(0) - east, dy = x(1) - north;
    return jml::Vector<T, 1>(sqrt(dx * dx + dy * dy));
  }
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(bound); }
};

/// Its bearing from a station, rad, which wraps at ±π.
struct BoundedBearing {
  static constexpr int measurements = 1;
  double east = 0, north = 0, bound = 0.02;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 4>& x) const {
    using std::atan2;
    return jml::Vector<T, 1>(atan2(x(1) - north, x(0) - east));
  }
  template <typename T>
  jml::Vector<T, 1> residual(const jml::Vector<T, 1>& y, const jml::Vector<T, 1>& predicted) const {
    return jml::Vector<T, 1>(std::remainder(y(0) - predicted(0), T(6.283185307179586)));
  }
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(bound); }
};

/// A uniform point of a box; with `corner` one of its vertices.
template <int n>
jml::Vector<double, n> point_of(const jml::Box<double, n>& box, jml::Noise& noise, bool corner = false) {
  jml::Vector<double, n> x;
  for (int i = 0; i < n; ++i) {
    const double at = noise.uniform();
    x(i) =
        corner ? (at < 0.5 ? box.lower(i) : box.upper(i)) : box.lower(i) + at * (box.upper(i) - box.lower(i));
  }
  return x;
}
/// A uniform vector with |w| ≤ bound; with `corner` of entries ±bound.
template <int n>
jml::Vector<double, n> within(const jml::Vector<double, n>& bound, jml::Noise& noise, bool corner = false) {
  return point_of(jml::Box<double, n>{-bound, bound}, noise, corner);
}

}  // namespace models
