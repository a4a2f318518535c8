// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A correct linear model, two states and one measurement: each case spoils one thing in a copy of its parts.
#pragma once

#include <jml/jml.hpp>

namespace parts {

using Matrix1 = jml::Matrix<double, 1, 1>;
using Matrix2 = jml::Matrix<double, 2, 2>;
using Vector1 = jml::Vector<double, 1>;
using Vector2 = jml::Vector<double, 2>;

struct Functions {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + 0.1 * x(1), x(1)};
  }
};
struct WithInput : Functions {
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
};
struct Model : WithInput {
  Matrix1 disturbance_covariance() const { return Matrix1(1); }
};
/// The same with a bound in place of the covariance.
struct Pushed : WithInput {
  Vector1 disturbance_bound() const { return Vector1(1.0); }
};

struct Position {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
};
struct Sensor : Position {
  Matrix1 noise_covariance() const { return Matrix1(1); }
};

inline const jml::Estimate<double, 2> start{Vector2(1, 0), Matrix2::Identity()};
inline const jml::Box<double, 2> box{Vector2(0, -1), Vector2(2, 1)};

}  // namespace parts
