// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Robust losses: how much a measurement counts whose residual is many standard deviations long.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <cstdint>
#include <jml/attributes.hpp>

namespace jml {

/// In J a measurement counts ½ ρ(s) with s = rᵀR⁻¹r, its residual squared in standard deviations.
///   none    ρ = s
///   huber   ρ = s up to s = width², then 2 width √s - width²: an outlier pulls with a bounded force
///   cauchy  ρ = width² log(1 + s/width²): a far outlier pulls less and less; not convex
/// width: standard deviations, positive. The sensor's whole vector is judged at once.
struct Loss {
  /// Which of them.
  enum class Kind : std::uint8_t { none, huber, cauchy };
  Kind kind = Kind::none;  ///< quadratic at first
  double width = 1;        ///< standard deviations

  /// A bounded force from `width` on.
  static constexpr Loss huber(double width) { return {Kind::huber, width}; }
  /// Less and less from `width` on.
  static constexpr Loss cauchy(double width) { return {Kind::cauchy, width}; }
  /// A width above 0, at most 1e150.
  [[nodiscard]] constexpr bool valid() const { return width > 0 && width <= 1e150; }

  /// ρ and what a minimisation asks of it.
  template <typename Scalar>
  struct Value {
    Scalar rho;    ///< ρ(s)
    Scalar slope;  ///< ρ'(s)
    /// β: curvature ρ' - β s along the residual, cut at zero (ρ' + 2 ρ'' s may be negative).
    Scalar bend;  // β: curvature ρ' - β s along the residual, cut at zero (ρ' + 2 ρ'' s may be negative)
  };
  /// At s = rᵀR⁻¹r, ≥ 0.
  template <typename Scalar>
  [[nodiscard]] JML_INLINE Value<Scalar> operator()(Scalar s) const {
    if (kind == Kind::none) return {s, Scalar(1), Scalar(0)};
    const auto c = static_cast<Scalar>(width);
    const Scalar square = c * c;
    if (kind == Kind::huber) {
      if (!(s > square)) return {s, Scalar(1), Scalar(0)};
      const Scalar root = std::sqrt(s);
      return {Scalar(2) * c * root - square, c / root, c / (root * s)};
    }
    const Scalar slope = square / (square + s);
    const Scalar along = slope * (square - s) / (square + s);  // ρ' + 2 ρ'' s
    return {square * std::log1p(s / square), slope,
            s > Scalar(0) ? (slope - (along > Scalar(0) ? along : Scalar(0))) / s : Scalar(0)};
  }
};

constexpr Loss::Kind last_value(Loss::Kind) { return Loss::Kind::cauchy; }  ///< for saving, image/parts.hpp

}  // namespace jml
#include <jml/warnings_end.hpp>
