// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Correct models of an attitude, in discrete and in continuous time: each case spoils one thing.
#pragma once

#include "parts.hpp"

namespace space_parts {

using Vector3 = jml::Vector<double, 3>;
using Vector4 = jml::Vector<double, 4>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using Matrix4 = jml::Matrix<double, 4, 4>;

struct Noise {
  static constexpr int disturbances = 3;
  Matrix3 disturbance_covariance() const { return Matrix3::Identity(); }
};
template <typename Base>
struct Functions : Base {
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x) const {
    return x;
  }
};
struct InSpace : Noise {
  using Space = jml::SO3;
};
using Attitude = Functions<InSpace>;
struct Sensor {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 4>& x) const {
    return jml::Vector<T, 1>(x(1));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(1); }
};

/// The same numbers in ℝ⁴, with a covariance, a bound, or in continuous time.
struct Four {
  static constexpr int states = 4, disturbances = 4;
  Matrix4 disturbance_covariance() const { return Matrix4::Identity(); }
};
struct Bounded {
  static constexpr int states = 4, disturbances = 4;
  Vector4 disturbance_bound() const { return Vector4::Ones(); }
};
struct Continuous {
  static constexpr int states = 4, disturbances = 4;
  using time_domain = jml::ContinuousTime;
  Matrix4 disturbance_spectral_density() const { return Matrix4::Identity(); }
};
template <typename Base>
struct OnSphere : Base {
  using Space = jml::SO3;
};

/// Continuous in a space: a tangent velocity.
struct Turning {
  using Space = jml::SO3;
  using time_domain = jml::ContinuousTime;
  static constexpr int disturbances = 3;
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 4>&) const {
    return jml::Vector<T, 3>(T(0.1), T(0), T(0));
  }
  Matrix3 disturbance_spectral_density() const { return Matrix3::Identity(); }
};

inline const Vector4 upright{1, 0, 0, 0};
inline const jml::Estimate<double, 4, 3> start{upright, Matrix3::Identity()};
inline const jml::Estimate<double, 4> flat_start{upright, Matrix4::Identity()};

}  // namespace space_parts
