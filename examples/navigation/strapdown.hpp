// SPDX-License-Identifier: BSD-3-Clause
// Strapdown navigation with an inertial unit, to copy into one's own project: a state of 16 numbers and 15
// degrees of freedom, in a local frame with z up that does not turn. No Jacobian is written.
#pragma once

#include <jml/jml.hpp>

namespace navigation {

/// Attitude as the quaternion from the body's axes to the local ones (4), position m (3), velocity m/s (3),
/// gyro bias rad/s (3), accelerometer bias m/s² (3).
using Space = jml::Product<jml::SO3, jml::Euclidean<12>>;
constexpr int numbers = 16, degrees = 15;
template <typename T>
using State = jml::Vector<T, numbers>;
constexpr int attitude = 0, position = 4, velocity = 7, gyro_bias = 10, force_bias = 13;

template <typename T>
jml::Vector<T, 4> attitude_of(const State<T>& x) {
  return x.template head<4>();
}

/// Of the inertial unit: noise densities per √Hz and walks of the biases per √s.
struct Grade {
  double gyro_noise = 1e-3;   // rad/s/√Hz
  double force_noise = 1e-2;  // m/s²/√Hz
  double gyro_walk = 1e-5;    // rad/s/√s
  double force_walk = 1e-4;   // m/s²/√s
};

/// One sample of the inertial unit, held over dt: control = (rate rad/s, specific force m/s²), body's axes.
/// w: noise of the gyros (3) and accelerometers (3), steps of the walks of their biases (6).
// [model]
struct Strapdown {
  using Space = navigation::Space;
  static constexpr int disturbances = 12, controls = 6;
  Grade grade{};
  double gravity = 9.81;  // m/s²

  template <typename T>
  State<T> dynamics(const State<T>& x, const jml::Vector<T, 12>& w, const auto& at) const {
    const double dt = at.dt;
    jml::Vector<T, 3> half_turn, force;
    for (int i = 0; i < 3; ++i) {
      half_turn(i) = (at.control(i) - x(gyro_bias + i) - w(i)) * (dt / 2);
      force(i) = at.control(3 + i) - x(force_bias + i) - w(3 + i);
    }
    const jml::Vector<T, 4> half = jml::exp_quaternion(half_turn);
    const jml::Vector<T, 4> middle = jml::quaternion_product(attitude_of(x), half);
    jml::Vector<T, 3> acceleration = jml::rotate(middle, force);
    acceleration(2) -= gravity;
    State<T> next;
    next.template head<4>() = jml::quaternion_product(middle, half);
    for (int i = 0; i < 3; ++i) {
      next(position + i) = x(position + i) + (x(velocity + i) + acceleration(i) * (dt / 2)) * dt;
      next(velocity + i) = x(velocity + i) + acceleration(i) * dt;
      next(gyro_bias + i) = x(gyro_bias + i) + w(6 + i);
      next(force_bias + i) = x(force_bias + i) + w(9 + i);
    }
    return next;
  }
  template <typename Scalar>
  jml::Matrix<double, 12, 12> disturbance_covariance(const State<Scalar>&, const auto& at) const {
    const double dt = at.dt;
    jml::Matrix<double, 12, 12> Q = jml::Matrix<double, 12, 12>::Zero();
    for (int i = 0; i < 3; ++i) {
      Q(i, i) = grade.gyro_noise * grade.gyro_noise / dt;
      Q(3 + i, 3 + i) = grade.force_noise * grade.force_noise / dt;
      Q(6 + i, 6 + i) = grade.gyro_walk * grade.gyro_walk * dt;
      Q(9 + i, 9 + i) = grade.force_walk * grade.force_walk * dt;
    }
    return Q;
  }
};
// [/model]

/// Position m of an antenna at `arm` m in the body's axes.
struct GnssPosition {
  static constexpr int measurements = 3;
  jml::Vector<double, 3> arm{0, 0, 0};
  double horizontal = 1, vertical = 2;  // m, standard deviations

  template <typename T>
  jml::Vector<T, 3> measurement(const State<T>& x) const {
    const jml::Vector<T, 3> to_antenna =
        jml::rotate(attitude_of(x), jml::Vector<T, 3>(T(arm(0)), T(arm(1)), T(arm(2))));
    jml::Vector<T, 3> out;
    for (int i = 0; i < 3; ++i) out(i) = x(position + i) + to_antenna(i);
    return out;
  }
  jml::Matrix<double, 3, 3> noise_covariance() const {
    jml::Matrix<double, 3, 3> R = jml::Matrix<double, 3, 3>::Identity() * (horizontal * horizontal);
    R(2, 2) = vertical * vertical;
    return R;
  }
};

}  // namespace navigation
