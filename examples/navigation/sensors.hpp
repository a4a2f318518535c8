// SPDX-License-Identifier: BSD-3-Clause
// What a vehicle with an inertial unit is also told by, to copy: GNSS, barometer, magnetometer, stars, and
// that it stands. Each is a measurement and its noise; no Jacobian is written. (GnssPosition: strapdown.hpp.)
#pragma once

#include "strapdown.hpp"

namespace navigation {

/// σ² I.
template <int n>
jml::Matrix<double, n, n> white(double sigma) {
  return sigma * sigma * jml::Matrix<double, n, n>::Identity();
}

/// R(q) v.
template <typename T>
jml::Vector<T, 3> in_local_axes(const State<T>& x, const jml::Vector<T, 3>& v) {
  return jml::rotate(attitude_of(x), v);
}
/// R(q)ᵀ v of a vector that is known in the local axes.
template <typename T>
jml::Vector<T, 3> in_body_axes(const State<T>& x, const jml::Vector<double, 3>& v) {
  return jml::rotate_back(attitude_of(x), jml::Vector<T, 3>(v.template cast<T>()));
}
/// Velocity m/s of a point at `arm` m in the body's axes, in the local ones: v + R (ω × arm), where ω is the
/// rate of the last inertial sample less the bias of the gyros. The noise of that one sample times the arm is
/// left out: 1 cm/s for 0.01 rad/s and 1 m, to be added to the noise of the sensor where it counts.
template <typename T>
jml::Vector<T, 3> velocity_at(const State<T>& x, const jml::Vector<double, 3>& arm, const auto& at) {
  jml::Vector<T, 3> rate, turning, out;
  for (int i = 0; i < 3; ++i) rate(i) = at.control(i) - x(gyro_bias + i);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    turning(i) = rate(j) * arm(k) - rate(k) * arm(j);
  }
  const jml::Vector<T, 3> extra = in_local_axes(x, turning);
  for (int i = 0; i < 3; ++i) out(i) = x(velocity + i) + extra(i);
  return out;
}

/// Velocity m/s of an antenna at `arm` m in the body's axes.
struct GnssVelocity {
  static constexpr int measurements = 3;
  jml::Vector<double, 3> arm{0, 0, 0};
  double horizontal = 0.05, vertical = 0.1;  // m/s, standard deviations

  template <typename T>
  jml::Vector<T, 3> measurement(const State<T>& x, const auto& at) const {
    return velocity_at(x, arm, at);
  }
  jml::Matrix<double, 3, 3> noise_covariance() const {
    jml::Matrix<double, 3, 3> R = white<3>(horizontal);
    R(2, 2) = vertical * vertical;
    return R;
  }
};

/// Position m and velocity m/s of one antenna: the usual fix of a receiver.
struct GnssFix {
  static constexpr int measurements = 6;
  GnssPosition place{};
  GnssVelocity speed{};  // with the same arm

  explicit GnssFix(const jml::Vector<double, 3>& arm = {0, 0, 0}) {
    place.arm = arm;
    speed.arm = arm;
  }
  template <typename T>
  jml::Vector<T, 6> measurement(const State<T>& x, const auto& at) const {
    jml::Vector<T, 6> out;
    out.template head<3>() = place.measurement(x);
    out.template tail<3>() = speed.measurement(x, at);
    return out;
  }
  jml::Matrix<double, 6, 6> noise_covariance() const {
    jml::Matrix<double, 6, 6> R = jml::Matrix<double, 6, 6>::Zero();
    R.topLeftCorner<3, 3>() = place.noise_covariance();
    R.bottomRightCorner<3, 3>() = speed.noise_covariance();
    return R;
  }
};

/// Height m, of an atmosphere that is known.
struct Barometer {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double sigma = 0.5;  // m

  template <typename T>
  jml::Vector<T, 1> measurement(const State<T>& x) const {
    return jml::Vector<T, 1>(x(position + 2));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return white<1>(sigma); }
};

/// The Earth's magnetic field µT, known in the local axes, as seen in the body's.
struct Magnetometer {
  static constexpr int measurements = 3;
  jml::Vector<double, 3> field{0, 20, -44};
  double sigma = 0.5;  // µT

  template <typename T>
  jml::Vector<T, 3> measurement(const State<T>& x) const {
    return in_body_axes(x, field);
  }
  jml::Matrix<double, 3, 3> noise_covariance() const { return white<3>(sigma); }
};

/// The unit vector to a star (or to the Sun), known in the local axes, as seen in the body's. R = σ² I: what
/// it says of the length of the vector tells nothing of the attitude.
struct StarVector {
  static constexpr int measurements = 3;
  jml::Vector<double, 3> direction{1, 0, 0};
  double sigma = 1e-4;  // rad

  template <typename T>
  jml::Vector<T, 3> measurement(const State<T>& x) const {
    return in_body_axes(x, direction);
  }
  jml::Matrix<double, 3, 3> noise_covariance() const { return white<3>(sigma); }
};

/// The vehicle stands: its velocity m/s is measured as y = 0.
struct ZeroVelocity {
  static constexpr int measurements = 3;
  static constexpr bool linear = true;
  double sigma = 0.01;  // m/s

  template <typename T>
  jml::Vector<T, 3> measurement(const State<T>& x) const {
    return x.template segment<3>(velocity);
  }
  jml::Matrix<double, 3, 3> noise_covariance() const { return white<3>(sigma); }
};

}  // namespace navigation
