// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A continuous model and a sensor that go wrong on demand, and what must then be answered.
#pragma once

#include <cmath>
#include <jml/continuous/continuous.hpp>

namespace continuous_faulty {

enum class Fault {
  none,
  f,
  f_x,
  F,
  G,
  Q_nan,
  Q_indefinite,
  m,
  m_x,
  M,
  R_nan,
  R_zero,
  R_negative,
  R_asymmetric
};

inline double broken(bool here) { return here ? std::nan("") : 0.0; }

/// n = 2, q = 2, one control; goes wrong from the time `since` on.
struct Plant {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 2, controls = 1;
  Fault fault = Fault::none;
  double since = -1;
  bool now(Fault f, double time) const { return fault == f && time >= since; }

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(1) + broken(now(Fault::f, at.time)), -0.5 * x(0) - 0.1 * x(0) * x(0) * x(1) + at.control(0)};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x, const auto& at) const {
    jml::Matrix<T, 2, 2> J;
    J << T(broken(now(Fault::f_x, at.time))), T(1), -0.5 - 0.2 * x(0) * x(1), -0.1 * x(0) * x(0);
    return J;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& x, const auto& at) const {
    jml::Matrix<T, 2, 2> F;
    F << T(broken(now(Fault::F, at.time))), T(1), T(-0.5), -0.1 * x(0) * x(0);
    return F;
  }
  template <typename X>
  jml::Matrix<double, 2, 2> disturbance_input(const X&, const auto& at) const {
    return (1 + broken(now(Fault::G, at.time))) * jml::Matrix<double, 2, 2>::Identity();
  }
  template <typename X>
  jml::Matrix<double, 2, 2> disturbance_spectral_density(const X&, const auto& at) const {
    jml::Matrix<double, 2, 2> Q;
    const double off = now(Fault::Q_indefinite, at.time) ? 0.5 : 0.05;
    Q << 0.1 + broken(now(Fault::Q_nan, at.time)), off, off, 0.1;
    return Q;
  }
};

/// p = 2.
struct Sensor {
  static constexpr int measurements = 2;
  Fault fault = Fault::none;
  double since = -1;
  bool now(Fault f, double time) const { return fault == f && time >= since; }

  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(0) + 0.1 * x(0) * x(0) * x(0), x(1) + broken(now(Fault::m, at.time))};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> measurement_jacobian(const jml::Vector<T, 2>& x, const auto& at) const {
    jml::Matrix<T, 2, 2> J;
    J << 1.0 + 0.3 * x(0) * x(0), T(0), T(0), T(1 + broken(now(Fault::m_x, at.time)));
    return J;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> measurement_sdc(const jml::Vector<T, 2>& x, const auto& at) const {
    jml::Matrix<T, 2, 2> M;
    M << 1.0 + 0.1 * x(0) * x(0), T(0), T(0), T(1 + broken(now(Fault::M, at.time)));
    return M;
  }
  template <typename X>
  jml::Matrix<double, 2, 2> noise_spectral_density(const X&, const auto& at) const {
    jml::Matrix<double, 2, 2> R = 0.2 * jml::Matrix<double, 2, 2>::Identity();
    if (now(Fault::R_nan, at.time)) R(1, 1) = std::nan("");
    if (now(Fault::R_zero, at.time)) R(0, 0) = 0;
    if (now(Fault::R_negative, at.time)) R(1, 1) = -1;
    if (now(Fault::R_asymmetric, at.time)) R(0, 1) = 0.1;
    return R;
  }
};

struct Expectation {
  Fault fault;
  jml::Status status;
};
inline constexpr Expectation of_plant[] = {
    {Fault::f, jml::Status::dynamics_not_finite},
    {Fault::f_x, jml::Status::dynamics_not_finite},
    {Fault::F, jml::Status::dynamics_not_finite},
    {Fault::G, jml::Status::invalid_disturbance_covariance},
    {Fault::Q_nan, jml::Status::invalid_disturbance_covariance},
    {Fault::Q_indefinite, jml::Status::invalid_disturbance_covariance}};
inline constexpr Expectation of_sensor[] = {{Fault::m, jml::Status::sensor_not_finite},
                                            {Fault::m_x, jml::Status::sensor_not_finite},
                                            {Fault::M, jml::Status::sensor_not_finite},
                                            {Fault::R_nan, jml::Status::invalid_noise_covariance},
                                            {Fault::R_zero, jml::Status::invalid_noise_covariance},
                                            {Fault::R_negative, jml::Status::invalid_noise_covariance},
                                            {Fault::R_asymmetric, jml::Status::invalid_noise_covariance}};

inline jml::Estimate<double, 2> start() {
  jml::Estimate<double, 2> e;
  e.x << 0.7, -0.4;
  e.P << 0.3, 0.05, 0.05, 0.2;
  return e;
}

inline const jml::Vector<double, 2> y{0.5, 0.1};
inline const jml::Vector<double, 1> u{0.2};

}  // namespace continuous_faulty
