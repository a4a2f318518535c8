// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cutting slices off a box that a measurement excludes, where the sensor's slope has no certain sign there.
///
/// The mean-value form cannot cut along a state whose derivative may be zero: a range, seen from a box wide
/// enough to lie on both sides of the tag. The range of m over a slice at the box's side, by interval
/// evaluation, can still miss y ± b, and then no state of the slice was measured (shaving, Lhomme 1993).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/contraction.hpp>
#include <jml/model/functions.hpp>

namespace jml::detail {

/// Row of y that no state of the box can have given, with noise within `bound`, and by how much; -1: none.
/// A residual that wraps is asked at the middle of the range: then the nearest turn is the one that counts.
template <typename S, typename Scalar, int n, int p, typename At>
[[nodiscard]] int contradicting_row(const S& s, const Vector<Interval<Scalar>, n>& box,
                                    const Vector<Scalar, p>& y, const Vector<Scalar, p>& bound, const At& at,
                                    Scalar& excess) {
  const Vector<Interval<Scalar>, p> range = measurement(s, box, at);
  Vector<Scalar, p> middle;
  for (int row = 0; row < p; ++row) middle(row) = range(row).centre();
  const Vector<Scalar, p> away = measurement_residual(s, y, middle);
  for (int row = 0; row < p; ++row) {
    const Scalar reach = range(row).radius() + bound(row);
    const Scalar slack = Scalar(8) * std::numeric_limits<Scalar>::epsilon() *
                         (std::abs(y(row)) + std::abs(middle(row)) + reach);
    excess = std::abs(away(row)) - reach;
    if (excess > slack) return row;
  }
  return -1;
}

/// Takes off the box what it can along `state`, from both sides: halves of what is left, then quarters, down
/// to a sixty-fourth, at most sixteen tries a side.
template <typename S, typename Scalar, int n, int p, typename At>
void shave(const S& s, Vector<Interval<Scalar>, n>& box, int state, const Vector<Scalar, p>& y,
           const Vector<Scalar, p>& bound, const At& at) {
  Interval<Scalar>& side = box(state);
  for (const bool low : {true, false}) {
    Scalar share = Scalar(0.5), excess;
    for (int tries = 0; tries < 16 && share > Scalar(0.015); ++tries) {
      const Scalar at_cut =
          low ? side.low + share * (side.high - side.low) : side.high - share * (side.high - side.low);
      if (!(side.low < at_cut && at_cut < side.high)) break;  // too thin, or infinite
      const Interval<Scalar> all = side;
      side = low ? Interval<Scalar>{all.low, at_cut} : Interval<Scalar>{at_cut, all.high};
      const bool excluded = contradicting_row(s, box, y, bound, at, excess) >= 0;
      side = all;
      if (!excluded)
        share /= Scalar(2);
      else
        (low ? side.low : side.high) = at_cut;
    }
  }
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
