// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A continuous model in which nothing is zero, symmetric or constant, so that a transpose, a swapped index
/// or a time that stands still shows: time and control in the coefficients, f(0) and m(0) not 0, correlated
/// noise. Made up for the tests; tests/filter/continuous_reference.hpp has its formulas and its filters'
/// solutions.
#pragma once

#include <cmath>
#include <jml/model/traits.hpp>

namespace models {

/// x = (a, b, c), one control, no Jacobian.
struct TimeVaryingPlant {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 3, disturbances = 2, controls = 1;

  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x, const auto& at) const {
    const double u = at.control(0), swing = std::sin(at.time);
    const T a = x(0), b = x(1), c = x(2);
    return {-0.4 * a + 0.1 * a * b + (1 + 0.2 * swing) * b + 0.3 * a * c,
            -1.2 * a - 0.5 * b - 0.2 * a * a * b + 0.4 * c + u * b * c + u,
            0.25 * std::cos(2 * at.time) * a + 0.1 * b * c - 0.3 * u * b - 0.8 * c - 0.1 * b * b * c +
                0.1 * swing};
  }
  /// F(x) x = f(x) - f(0).
  template <typename T>
  jml::Matrix<T, 3, 3> dynamics_sdc(const jml::Vector<T, 3>& x, const auto& at) const {
    const double u = at.control(0);
    const T a = x(0), b = x(1), c = x(2);
    jml::Matrix<T, 3, 3> F;
    F << 0.1 * b - 0.4, T(1 + 0.2 * std::sin(at.time)), 0.3 * a,  //
        T(-1.2), -0.2 * a * a - 0.5, u * b + 0.4,                 //
        T(0.25 * std::cos(2 * at.time)), 0.1 * c - 0.3 * u, -0.1 * b * b - 0.8;
    return F;
  }
  jml::Matrix<double, 3, 2> disturbance_input() const {
    jml::Matrix<double, 3, 2> G;
    G << 0.4, -0.2, 0.1, 0.7, 0.9, 0.3;
    return G;
  }
  jml::Matrix<double, 2, 2> disturbance_spectral_density() const {
    jml::Matrix<double, 2, 2> Q;
    Q << 0.3, 0.1, 0.1, 0.5;
    return Q;
  }
};

/// Two measurements of x = (a, b, c) all the time, no Jacobian.
struct TimeVaryingSensor {
  static constexpr int measurements = 2;

  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 3>& x, const auto& at) const {
    const T a = x(0), b = x(1), c = x(2);
    return {a + 0.1 * a * a * a + 0.2 * b * c + 0.3 * std::cos(at.time) * c,
            0.1 * a * b - 0.4 * b + c + 0.15 * a * c + 0.1 * std::sin(3 * at.time)};
  }
  /// M(x) x = m(x) - m(0).
  template <typename T>
  jml::Matrix<T, 2, 3> measurement_sdc(const jml::Vector<T, 3>& x, const auto& at) const {
    jml::Matrix<T, 2, 3> M;
    M << 0.1 * x(0) * x(0) + 1.0, 0.2 * x(2), T(0.3 * std::cos(at.time)),  //
        0.1 * x(1), T(-0.4), 0.15 * x(0) + 1.0;
    return M;
  }
  jml::Matrix<double, 2, 2> noise_spectral_density() const {
    jml::Matrix<double, 2, 2> R;
    R << 0.05, 0.015, 0.015, 0.08;
    return R;
  }
};

}  // namespace models
