// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The most that rounding may make of a covariance and of a state.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/pivots.hpp>

namespace jml::detail {

/// The most that rounding may make of P in a step of the plain form, in its worst direction, by the sizes of
/// what it came from. A tenth of what x may be off by, in deviations: the gain is as wrong as P is.
template <typename Scalar>
inline constexpr Scalar plain_error = std::is_same_v<Scalar, float> ? Scalar(1e-4) : Scalar(1e-7);
/// The same of an iterated rule.
template <typename Scalar>
inline constexpr Scalar iterated_error = std::is_same_v<Scalar, float> ? Scalar(2.5e-3) : Scalar(1.3e-6);
/// Of an innovation y - H x: how much larger its terms may be than √R, squared, for ε of them not to matter:
/// 1e-7 of a standard deviation, in float 1e-3.
template <typename Scalar>
inline constexpr Scalar finest_innovation = std::is_same_v<Scalar, float> ? Scalar(1e8) : Scalar(2e17);
/// y² + Σ (H x)² of each row.
template <typename Scalar, int n, int p>
[[nodiscard]] JML_INLINE inline Vector<Scalar, p> innovation_sizes(const Matrix<Scalar, p, n>& H,
                                                                   const Vector<Scalar, n>& x,
                                                                   const Vector<Scalar, p>& y) {
  Vector<Scalar, p> out;
  for (int i = 0; i < p; ++i) {
    Scalar terms = y(i) * y(i);
    for (int j = 0; j < n; ++j) terms += (H(i, j) * x(j)) * (H(i, j) * x(j));
    out(i) = terms;
  }
  return out;
}
/// The same as plain_error of a nonsymmetric rule, of the entries of its P.
template <typename Scalar>
inline constexpr Scalar worst_error = std::is_same_v<Scalar, float> ? Scalar(1e-2) : Scalar(1e-3);

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
