// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Boxes as intervals, and what a guaranteed step does with them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/bounded_report.hpp>
#include <jml/bounded/interval.hpp>
#include <jml/bounded/zonotope.hpp>

namespace jml::detail {

template <typename Scalar, int n>
using Ranges = Vector<Interval<Scalar>, n>;

template <typename Scalar, int n>
Ranges<Scalar, n> ranges(const Box<Scalar, n>& box) {
  Ranges<Scalar, n> out;
  for (int i = 0; i < n; ++i) out(i) = {box.lower(i), box.upper(i)};
  return out;
}

/// side - point. Neither is asked whether it is zero: 5 % of a step with n = 2.
template <typename Scalar>
[[nodiscard]] JML_INLINE inline Interval<Scalar> seen_from(Scalar point, const Interval<Scalar>& side) {
  return {below(side.low - point), above(side.high - point)};
}

/// A NaN says nothing about a derivative: it may be any.
template <typename Scalar>
void known(Interval<Scalar>& a) {
  if (isnan(a)) a = Interval<Scalar>::whole();
}

/// box ∩ with; false where that is empty, and which state it is.
template <typename Scalar, int n>
[[nodiscard]] bool cut(Box<Scalar, n>& box, const Ranges<Scalar, n>& with, Violation<Scalar>& violation) {
  for (int i = 0; i < n; ++i) {
    if (isnan(with(i))) continue;  // it overflowed, and says nothing
    Interval<Scalar> side{box.lower(i), box.upper(i)};
    if (!intersect(side, with(i), side)) {
      violation = {-1, i, with(i).low > side.high ? with(i).low - side.high : side.low - with(i).high};
      return false;
    }
    box.lower(i) = side.low;
    box.upper(i) = side.high;
  }
  return true;
}
template <typename Scalar, int n, int columns>
[[nodiscard]] bool cut(Box<Scalar, n>& box, const Zonotope<Scalar, n, columns>& shape,
                       Violation<Scalar>& violation) {
  const Vector<Scalar, n> reach = shape.reach();
  Ranges<Scalar, n> sides;
  for (int i = 0; i < n; ++i)
    sides(i) = Interval<Scalar>(shape.centre()(i)) + Interval<Scalar>(-reach(i), reach(i));
  return cut(box, sides, violation);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
