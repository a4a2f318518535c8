// SPDX-License-Identifier: BSD-3-Clause
// An attitude that turns by a known rate and a disturbance on it, and vectors seen from it; as a quaternion
// or as a rotation matrix.
#pragma once

#include <jml/jml.hpp>

namespace models {

/// x⁺ = x Exp(rate dt) Exp(w): w additive on the right, rad. `Of`: jml::SO3 or jml::SO3Matrix.
template <typename Of>
struct TurningIn {
  using Space = Of;
  using Group = jml::SpaceTraits<Of>;
  static constexpr int states = Group::numbers, disturbances = 3, controls = 3;
  jml::Matrix<double, 3, 3> Q = 1e-4 * jml::Matrix<double, 3, 3>::Identity();

  template <typename T>
  jml::Vector<T, states> dynamics(const jml::Vector<T, states>& x, const auto& at) const {
    jml::Vector<T, 3> turn;
    for (int i = 0; i < 3; ++i) turn(i) = T(at.control(i) * at.dt);
    return Group::plus(x, turn);
  }
  jml::Matrix<double, 3, 3> disturbance_covariance() const { return Q; }
};

/// A direction of the reference axes as seen in the body's, both ways to write an attitude.
template <typename T>
jml::Vector<T, 3> seen_from(const jml::Vector<T, 4>& q, const jml::Vector<double, 3>& direction) {
  return jml::rotate_back(q, jml::detail::cast_to<T>(direction));
}
template <typename T>
jml::Vector<T, 3> seen_from(const jml::Vector<T, 9>& R, const jml::Vector<double, 3>& direction) {
  jml::Vector<T, 3> out;
  for (int i = 0; i < 3; ++i)
    out(i) = R(3 * i) * direction(0) + R(3 * i + 1) * direction(1) + R(3 * i + 2) * direction(2);
  return out;
}

struct VectorSensor {
  static constexpr int measurements = 3;
  jml::Vector<double, 3> direction{1, 0, 0};
  double sigma = 0.01;

  template <typename T, int numbers>
  jml::Vector<T, 3> measurement(const Eigen::Matrix<T, numbers, 1>& x) const {
    return seen_from(jml::Vector<T, numbers>(x), direction);
  }
  jml::Matrix<double, 3, 3> noise_covariance() const {
    return sigma * sigma * jml::Matrix<double, 3, 3>::Identity();
  }
};

}  // namespace models
