// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Models linearised at a point, in the places of the models themselves: one more step of a one-pass rule on
/// them is one more Gauss-Newton sweep.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/functions.hpp>

namespace jml::detail {

/// f(x_0) + A (x - x_0), of dynamics D; what disturbs them is given beside.
template <typename D, typename Scalar, int n>
struct LinearisedDynamics {
  Vector<Scalar, n> x_0, f;
  Matrix<Scalar, n, n> A;

  Vector<Scalar, n> dynamics(const Vector<Scalar, n>& x) const { return f + A * (x - x_0); }
  Matrix<Scalar, n, n> dynamics_jacobian(const Vector<Scalar, n>&) const { return A; }
};

/// m(x_0) + H (x - x_0) and R.
template <typename S, typename Scalar, int n, int p>
struct LinearisedSensor {
  const S& of;
  Vector<Scalar, n> x_0;
  Vector<Scalar, p> m;
  Matrix<Scalar, p, n> H;
  Matrix<Scalar, p, p> R;

  Vector<Scalar, p> measurement(const Vector<Scalar, n>& x) const { return m + H * (x - x_0); }
  Matrix<Scalar, p, n> measurement_jacobian(const Vector<Scalar, n>&) const { return H; }
  Matrix<Scalar, p, p> noise_covariance() const { return R; }
};

}  // namespace jml::detail

namespace jml {

template <typename D, typename Scalar, int n>
struct DynamicsTraits<detail::LinearisedDynamics<D, Scalar, n>> : DynamicsDefaults {
  static constexpr int states = n, controls = DynamicsTraits<D>::controls;
};

template <typename S, typename Scalar, int n, int p>
struct SensorTraits<detail::LinearisedSensor<S, Scalar, n, p>> : SensorDefaults {
  static constexpr int measurements = p;

  template <typename... A>
  static auto residual(const detail::LinearisedSensor<S, Scalar, n, p>& s, const A&... a)
      -> decltype(SensorTraits<S>::residual(s.of, a...)) {
    return SensorTraits<S>::residual(s.of, a...);
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
