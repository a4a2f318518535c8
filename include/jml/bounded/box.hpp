// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A box: a lower and an upper bound for each state.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/argument.hpp>
#include <jml/image/parts.hpp>
#include <limits>

namespace jml {

/// lower ≤ x ≤ upper by component, n, in the units of the model. An infinite bound: nothing is known there.
template <typename Scalar_, int n>
struct Box {
  using Scalar = Scalar_;  ///< of the bounds
  static_assert(n >= 0,
                "jml: how many states a box has must be known at compile time: write "
                "jml::Box<double, n>{lower, upper} where the bounds have their size at run time");
  /// Least values, n; -∞: none.
  Vector<Scalar, n> lower = kernel::filled<Vector<Scalar, n>>(-std::numeric_limits<Scalar>::infinity());
  /// Greatest values, n; ∞: none.
  Vector<Scalar, n> upper = kernel::filled<Vector<Scalar, n>>(std::numeric_limits<Scalar>::infinity());

  Box() = default;
  /// Both of n.
  Box(const Argument<Scalar, n>& least, const Argument<Scalar, n>& greatest)
      : lower(least), upper(greatest) {}

  /// NaN where a bound is missing.
  [[nodiscard]] Vector<Scalar, n> centre() const { return Scalar(0.5) * (lower + upper); }
  [[nodiscard]] Vector<Scalar, n> width() const { return upper - lower; }  ///< upper - lower, n
  /// (d - c)²/12, eq. (2.34) of the bounded-noise dissertation: of an estimate at the centre, in the units of
  /// the states squared.
  [[nodiscard]] Vector<Scalar, n> error_variance() const {
    return kernel::by_entry(width(), width()) / Scalar(12);
  }
  /// Bounds included.
  [[nodiscard]] bool contains(const Vector<Scalar, n>& x) const {
    bool inside = true;
    for (int i = 0; i < n; ++i) inside &= lower(i) <= x(i) && x(i) <= upper(i);
    return inside;
  }
  /// True where every state has both bounds.
  [[nodiscard]] bool bounded() const { return all_finite(lower) && all_finite(upper); }
  /// lower ≤ upper, no NaN, and infinite only where a bound is missing.
  [[nodiscard]] bool valid() const {
    constexpr Scalar infinity = std::numeric_limits<Scalar>::infinity();
    bool good = true;
    for (int i = 0; i < n; ++i) good &= lower(i) <= upper(i) && lower(i) < infinity && upper(i) > -infinity;
    return good;
  }
};

template <typename Scalar, int n>
struct PartsOf<Box<Scalar, n>> {
  static auto each(auto& box, auto&& f) { return f(box.lower, box.upper); }
};

namespace detail {

/// The middle, or where a bound is missing the point next to zero: always inside.
template <typename Scalar>
[[nodiscard]] Scalar point_in(Scalar lower, Scalar upper) {
  const Scalar middle = Scalar(0.5) * (lower + upper);
  if (std::isfinite(middle)) return middle;
  return lower > Scalar(0) ? lower : upper < Scalar(0) ? upper : Scalar(0);
}
template <typename Scalar, int n>
[[nodiscard]] Vector<Scalar, n> point_in(const Box<Scalar, n>& box) {
  Vector<Scalar, n> out;
  for (int i = 0; i < n; ++i) out(i) = point_in(box.lower(i), box.upper(i));
  return out;
}

}  // namespace detail

/// Types from the arguments.
template <typename Scalar, int n>
Box(const Vector<Scalar, n>&, const Vector<Scalar, n>&) -> Box<Scalar, n>;
/// From Eigen expressions.
template <typename L, typename U>
Box(const Eigen::MatrixBase<L>&, const Eigen::MatrixBase<U>&)
    -> Box<typename L::Scalar, L::RowsAtCompileTime>;

}  // namespace jml
#include <jml/warnings_end.hpp>
