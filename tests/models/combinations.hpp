// SPDX-License-Identifier: BSD-3-Clause
// One oscillator in every form a user may write it: double or float, discrete or continuous, with SDC matrices and
// Jacobians of its own or with none. For the tests that stamp out the product of what compiles.
#pragma once

#include <jml/jml.hpp>

namespace models {

/// f of a damped Duffing oscillator; about the origin, where f(0) = 0.
template <typename Scalar, bool own>
struct CombinedOscillator {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1), Scalar(-1) * x(0) - Scalar(0.4) * x(1) - Scalar(0.2) * x(0) * x(0) * x(0)};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x) const
    requires own
  {
    jml::Matrix<T, 2, 2> J;
    J << T(0), T(1), Scalar(-1) - Scalar(0.6) * x(0) * x(0), T(Scalar(-0.4));
    return J;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& x) const
    requires own
  {
    jml::Matrix<T, 2, 2> F;
    F << T(0), T(1), Scalar(-1) - Scalar(0.2) * x(0) * x(0), T(Scalar(-0.4));
    return F;
  }
  jml::Matrix<Scalar, 2, 1> disturbance_input() const { return {Scalar(0), Scalar(1)}; }
  jml::Matrix<Scalar, 1, 1> disturbance_spectral_density() const { return jml::Matrix<Scalar, 1, 1>(Scalar(0.1)); }
};

/// One Euler step of it, of 0.05 s.
template <typename Scalar, bool own>
struct CombinedStep {
  static constexpr int states = 2, disturbances = 1;
  static constexpr CombinedOscillator<Scalar, true> flow{};
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    const jml::Vector<T, 2> slope = flow.dynamics(x);
    return {x(0) + Scalar(0.05) * slope(0), x(1) + Scalar(0.05) * slope(1)};
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x) const
    requires own
  {
    return stepped(flow.dynamics_jacobian(x));
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_sdc(const jml::Vector<T, 2>& x) const
    requires own
  {
    return stepped(flow.dynamics_sdc(x));
  }
  jml::Matrix<Scalar, 2, 1> disturbance_input() const { return {Scalar(0), Scalar(0.05)}; }
  jml::Matrix<Scalar, 1, 1> disturbance_covariance() const { return jml::Matrix<Scalar, 1, 1>(Scalar(2)); }
  jml::Vector<Scalar, 1> disturbance_bound() const { return jml::Vector<Scalar, 1>(Scalar(2)); }

 private:
  template <typename T>
  static jml::Matrix<T, 2, 2> stepped(jml::Matrix<T, 2, 2> A) {
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) A(i, j) = Scalar(0.05) * A(i, j) + Scalar(i == j ? 1 : 0);
    }
    return A;
  }
};

/// y = x + 0.1 x³, sampled or there all the time.
template <typename Scalar, bool own, bool always>
struct CombinedSensor {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0) + Scalar(0.1) * x(0) * x(0) * x(0));
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>& x) const
    requires own
  {
    return {Scalar(1) + Scalar(0.3) * x(0) * x(0), T(0)};
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_sdc(const jml::Vector<T, 2>& x) const
    requires own
  {
    return {Scalar(1) + Scalar(0.1) * x(0) * x(0), T(0)};
  }
  jml::Matrix<Scalar, 1, 1> noise_covariance() const
    requires(!always)
  {
    return jml::Matrix<Scalar, 1, 1>(Scalar(0.05));
  }
  jml::Matrix<Scalar, 1, 1> noise_spectral_density() const
    requires always
  {
    return jml::Matrix<Scalar, 1, 1>(Scalar(0.02));
  }
  jml::Vector<Scalar, 1> noise_bound() const { return jml::Vector<Scalar, 1>(Scalar(0.5)); }
};

template <typename Scalar>
jml::Estimate<Scalar, 2> combined_start() {
  jml::Matrix<Scalar, 2, 2> P;
  P << Scalar(0.2), Scalar(0.05), Scalar(0.05), Scalar(0.1);
  return {jml::Vector<Scalar, 2>(Scalar(0.8), Scalar(0.3)), P};
}
/// What the sensor saw at step k.
template <typename Scalar>
Scalar combined_y(int k) {
  return static_cast<Scalar>(0.7 * std::cos(0.05 * k) + 0.05 * std::sin(3.0 * k));
}

}  // namespace models
