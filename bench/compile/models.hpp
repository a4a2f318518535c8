// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the files beside it compile: two models as a user writes them, with nothing derived by hand.
#pragma once
#include <jml/jml.hpp>
struct D2 {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + 0.05 * x(1), x(1) - 0.05 * (x(0) + 0.2 * (x(0) * x(0) - 1.0) * x(1))};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 0.05}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(20.0); }
  jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(1.0); }
};
struct S2 {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0 + x(0) * x(0)));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.02); }
};
struct D6 {
  static constexpr int states = 6, disturbances = 3;
  template <typename T>
  jml::Vector<T, 6> dynamics(const jml::Vector<T, 6>& x) const {
    jml::Vector<T, 6> r;
    for (int i = 0; i < 3; ++i) {
      r(i) = x(i) + 0.1 * x(3 + i);
      r(3 + i) = x(3 + i) - 0.01 * x(3 + i) * x(3 + i);
    }
    return r;
  }
  jml::Matrix<double, 6, 3> disturbance_input() const {
    jml::Matrix<double, 6, 3> g;
    for (int i = 0; i < 18; ++i) g.data()[i] = 0;
    for (int i = 0; i < 3; ++i) g(3 + i, i) = 0.1;
    return g;
  }
  jml::Matrix<double, 3, 3> disturbance_covariance() const {
    jml::Matrix<double, 3, 3> q;
    for (int i = 0; i < 9; ++i) q.data()[i] = i % 4 == 0;
    return q;
  }
  jml::Vector<double, 3> disturbance_bound() const { return {1, 1, 1}; }
};
struct S6 {
  static constexpr int measurements = 3;
  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 6>& x) const {
    using std::sqrt, std::atan2;
    const T r = sqrt(x(0) * x(0) + x(1) * x(1));
    return {sqrt(r * r + x(2) * x(2)), atan2(x(1), x(0)), atan2(x(2), r)};
  }
  jml::Matrix<double, 3, 3> noise_covariance() const {
    jml::Matrix<double, 3, 3> q;
    for (int i = 0; i < 9; ++i) q.data()[i] = i % 4 == 0;
    return q;
  }
  jml::Vector<double, 3> noise_bound() const { return {1, 1, 1}; }
};
template <int n>
jml::Estimate<double, n> start() {
  jml::Estimate<double, n> e;
  for (int i = 0; i < n; ++i) {
    e.x(i) = 1 + i;
    e.P(i, i) = 1;
  }
  return e;
}
