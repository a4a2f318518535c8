// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A sensor whose measurements weigh less while P is large: for a strongly nonlinear m, whose neglected
/// second order would make P small before x is right.
///
/// R ← R + β S while an entry of √S_ii is above its limit (Lear's underweighting, S for its H P Hᵀ, which it
/// nearly is there): the correction is 1/(1 + β) of what it would be, and P falls by as much less.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/sensors.hpp>

namespace jml {

///     jml::Channel radar{jml::Underweighted{Radar{}, 0.2, Vector2(100, 0.01)}};
///
/// In a list of sensors it stands as jml::sensors<jml::Underweighted<Radar>>.
template <typename S>
struct Underweighted {
  static constexpr int p = measurements_of<S>;  ///< of the sensor
  static_assert(
      detail::noises_of_sensor<S>() == p,
      "jml: what an Underweighted sensor adds is in units of y: of a sensor with m(x, v) give R in them");
  using Limit = Vector<double, p>;  ///< of p

  [[no_unique_address]] S sensor;        ///< whose R is added to
  double share = 0.2;                    ///< β, ≥ 0: 0.2 is the Space Shuttle's
  Limit above = kernel::zeros<Limit>();  ///< of √S_ii, units of y: below all of them nothing is changed
  Matrix<double, p, p> added = kernel::zeros<Matrix<double, p, p>>();  ///< to R; the channel sets it

  /// A finite share ≥ 0, and limits ≥ 0.
  [[nodiscard]] bool valid() const {
    bool good = share >= 0 && std::isfinite(share);
    for (int i = 0; i < p; ++i) good = good && above(i) >= 0;
    return good;
  }
  /// What to add to R beside an innovation matrix S.
  template <typename Scalar>
  void weigh(const Matrix<Scalar, p, p>& innovation_matrix) {
    bool large = false;
    for (int i = 0; i < p; ++i)
      large = large || static_cast<double>(innovation_matrix(i, i)) > above(i) * above(i);
    for (int i = 0; i < p * p; ++i)
      added.data()[i] = large ? share * static_cast<double>(innovation_matrix.data()[i]) : 0;
  }
};
/// Types from the arguments.
/// @{
template <typename S>
Underweighted(S) -> Underweighted<S>;
template <typename S>
Underweighted(S, double) -> Underweighted<S>;
template <typename S, typename Limit>
Underweighted(S, double, Limit) -> Underweighted<S>;
/// @}

namespace detail {
template <typename S>
inline constexpr bool is_underweighted = false;
template <typename S>
inline constexpr bool is_underweighted<Underweighted<S>> = true;

template <typename T, int p>
constexpr Matrix<T, p, p> plus_noise(Matrix<T, p, p> R, const Matrix<double, p, p>& added) {
  for (int i = 0; i < p * p; ++i) R.data()[i] += static_cast<T>(added.data()[i]);
  return R;
}
}  // namespace detail

template <typename S>
struct SensorTraits<Underweighted<S>> : SensorDefaults {
  using Of = SensorTraits<S>;
  static constexpr int measurements = Of::measurements;
  static constexpr bool linear = Of::linear;

  template <typename... A>
  static constexpr auto measurement(const Underweighted<S>& s, const A&... a)
      -> decltype(Of::measurement(s.sensor, a...)) {
    return Of::measurement(s.sensor, a...);
  }
  template <typename... A>
  static constexpr auto jacobian(const Underweighted<S>& s, const A&... a)
      -> decltype(Of::jacobian(s.sensor, a...)) {
    return Of::jacobian(s.sensor, a...);
  }
  template <typename... A>
  static constexpr auto sdc(const Underweighted<S>& s, const A&... a) -> decltype(Of::sdc(s.sensor, a...)) {
    return Of::sdc(s.sensor, a...);
  }
  template <typename... A>
  static constexpr auto sdc_about(const Underweighted<S>& s, const A&... a)
      -> decltype(Of::sdc_about(s.sensor, a...)) {
    return Of::sdc_about(s.sensor, a...);
  }
  template <typename... A>
  static constexpr auto residual(const Underweighted<S>& s, const A&... a)
      -> decltype(Of::residual(s.sensor, a...)) {
    return Of::residual(s.sensor, a...);
  }
  template <typename... A>
  static constexpr auto noise_covariance(const Underweighted<S>& s, const A&... a)
      -> decltype(Of::noise_covariance(s.sensor, a...)) {
    return detail::plus_noise(Of::noise_covariance(s.sensor, a...), s.added);
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
