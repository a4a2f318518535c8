// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether a measurement asks for more digits than a state of Scalar has: the estimators of an interval,
/// whose nodes are such states, say so instead of answering.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/watched.hpp>
#include <jml/model/sensors.hpp>

namespace jml::detail {

/// Some sensor of a list is linear, so that too_fine() may be true.
template <typename List>
inline constexpr bool any_linear = true;
template <typename... S>
inline constexpr bool any_linear<Sensors<S...>> = (SensorTraits<S>::linear || ...);

/// Of a linear m: an ε of y, and of the terms of H x, is more than 1e-7 of the deviation of a row (float:
/// 1e-3), as thirty rows make five times as much. What a nonlinear m makes of its x is what its sensor says
/// it is.
template <typename S, typename Scalar, int n, int p, typename At>
[[nodiscard]] bool too_fine(const S& sensor, const Vector<Scalar, n>& x, const Vector<Scalar, p>& y,
                            const At& at) {
  bool fine = false;
  if constexpr (SensorTraits<S>::linear) {
    const Vector<Scalar, p> R = conditional_variances<Scalar, p>(noise_covariance(sensor, x, at));
    const Matrix<Scalar, p, n> H = measurement_jacobian(sensor, x, at);
    const Vector<Scalar, p> sizes = innovation_sizes(H, x, y);
    for (int i = 0; i < p; ++i) fine = fine || !(sizes(i) <= finest_innovation<Scalar> * R(i));
  }
  return fine;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
