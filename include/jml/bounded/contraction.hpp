// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cutting a box with one equation: Σ a_j δ_j in a given interval leaves for each δ_k the interval (target -
/// Σ_{j≠k} a_j δ_j) / a_k.
///
/// One pass forward and one back over the partial sums (HC4, Benhamou et al. 1999), linear in the number of
/// states. With a row of H and the measurement's interval it is eqs. (2.13)-(2.30) of the bounded-noise
/// dissertation, and any linear combination beyond them; with a row of an interval Jacobian the mean-value
/// form of a nonlinear sensor, or of the dynamics backward.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/bounded/interval.hpp>
#include <jml/kernels.hpp>
#include <type_traits>

namespace jml::detail {

/// An interval with ends rounded to nearest, for a box that is no guarantee: the caller widens it once.
template <typename Scalar>
struct Span {
  Scalar low = 0, high = 0;
  constexpr Span() = default;
  constexpr Span(Scalar from, Scalar to) : low(from), high(to) {}
  explicit constexpr Span(Scalar number) : low(number), high(number) {}
  JML_INLINE friend Span operator+(const Span& a, const Span& b) { return {a.low + b.low, a.high + b.high}; }
  JML_INLINE friend Span operator-(const Span& a, const Span& b) { return {a.low - b.high, a.high - b.low}; }
  JML_INLINE friend void meet(Span& a, const Span& b) {
    a.low = b.low > a.low ? b.low : a.low;
    a.high = b.high < a.high ? b.high : a.high;
  }
};

// Its coefficients are numbers: two products, not four.
template <typename Scalar>
JML_INLINE inline Span<Scalar> product(Scalar a, const Span<Scalar>& b) {
  return {a * (a >= Scalar(0) ? b.low : b.high), a * (a >= Scalar(0) ? b.high : b.low)};
}
template <typename Scalar>
JML_INLINE inline Span<Scalar> quotient(const Span<Scalar>& a, Scalar b) {
  const Scalar inverse = Scalar(1) / b;
  return product(inverse, a);
}
template <typename Scalar>
JML_INLINE inline bool is_zero(Scalar a) {
  return a == Scalar(0);
}
template <typename Scalar>
JML_INLINE inline bool has_sign(Scalar a) {
  return a != Scalar(0);
}

// With an interval for coefficient, all of them finite.
template <typename Scalar>
JML_INLINE inline Span<Scalar> product(const Interval<Scalar>& a, const Span<Scalar>& b) {
  const Scalar ll = a.low * b.low, lh = a.low * b.high, hl = a.high * b.low, hh = a.high * b.high;
  return {std::min(std::min(ll, lh), std::min(hl, hh)), std::max(std::max(ll, lh), std::max(hl, hh))};
}
template <typename Scalar>
JML_INLINE inline Span<Scalar> quotient(const Span<Scalar>& a, const Interval<Scalar>& b) {
  const bool turned = is_negative(b);
  const Scalar low = turned ? -a.high : a.low, high = turned ? -a.low : a.high;
  const Scalar least = turned ? -b.high : b.low, most = turned ? -b.low : b.high;
  return {low / (low < Scalar(0) ? least : most) - Float<Scalar>::smallest_normal,  // where it underflows
          high / (high < Scalar(0) ? most : least) + Float<Scalar>::smallest_normal};
}

// The same of intervals.
template <typename Scalar>
JML_INLINE inline Interval<Scalar> product(const Interval<Scalar>& a, const Interval<Scalar>& b) {
  return a * b;
}
template <typename Scalar>
JML_INLINE inline Interval<Scalar> quotient(const Interval<Scalar>& a, const Interval<Scalar>& b) {
  return a / b;
}
template <typename Scalar>
JML_INLINE inline bool has_sign(const Interval<Scalar>& a) {
  return is_positive(a) || is_negative(a);
}
template <typename Scalar>
JML_INLINE inline void meet(Interval<Scalar>& a, const Interval<Scalar>& b) {
  (void)intersect(a, b, a);  // empty by rounding alone: then a stays
}

/// Cuts `offset` by Σ_j a(row, j) offset[j] ∈ target(k), asked for each state k that is cut, and for all of
/// them with k = -1. Returns by how much the sum misses the target; zero where they meet. Coefficients are
/// numbers with `Side` a Span, intervals with intervals.
template <typename Coefficient, typename Side, int rows, int n, typename Target>
[[nodiscard]] JML_INLINE inline auto contract(const Matrix<Coefficient, rows, n>& a, int row,
                                              Side (&offset)[n], const Target& target) {
  using Scalar = std::remove_cvref_t<decltype(offset[0].low)>;
  Side before[n + 1];
  before[0] = Side(Scalar(0));
  kernel::repeat<n>([&](int j) JML_INLINE {
    before[j + 1] = is_zero(a(row, j)) ? before[j] : before[j] + product(a(row, j), offset[j]);
  });
  const Side all = target(-1);
  const Scalar above = before[n].low - all.high, below = all.low - before[n].high;
  if (above > Scalar(0) || below > Scalar(0)) return above > below ? above : below;
  if (all.low <= before[n].low && before[n].high <= all.high) return Scalar(0);  // says nothing
  Side after(Scalar(0));
  kernel::repeat<n>([&](int k) JML_INLINE {
    const int j = n - 1 - k;
    if (is_zero(a(row, j))) return;
    if (has_sign(a(row, j))) meet(offset[j], quotient(target(j) - (before[j] + after), a(row, j)));
    if (j > 0) after = after + product(a(row, j), offset[j]);
  });
  return Scalar(0);
}

// Rounding these two sums once, not each product and sum of them: 9 % fewer instructions a step without a
// zonotope, n = 2 and 6.

/// start + Σ_j a(row, j) offset[j]. Rounded to nearest and widened once, by twice what n + 1 products and
/// sums can have lost.
template <typename Scalar, int rows, int n>
[[nodiscard]] JML_INLINE inline Interval<Scalar> linear_form(const Interval<Scalar>& start,
                                                             const Matrix<Interval<Scalar>, rows, n>& a,
                                                             int row, const Interval<Scalar>* offset) {
  Span<Scalar> sum(start.low, start.high);
  Scalar size = mag(start) + Float<Scalar>::smallest_normal;  // that for what underflows
  kernel::repeat<n>([&](int j) JML_INLINE {
    const Interval<Scalar>& slope = a(row, j);
    if (is_zero(slope)) return;
    size += mag(slope) * mag(offset[j]);
    sum = sum + product(slope, Span<Scalar>(offset[j].low, offset[j].high));
  });
  if (size < Float<Scalar>::infinite) [[likely]] {  // or a product may be none
    const Scalar slack = Scalar(n + 3) * Float<Scalar>::epsilon() * size;
    return {sum.low - slack, sum.high + slack};
  }
  Interval<Scalar> any = start;
  for (int j = 0; j < n; ++j) {
    if (!is_zero(a(row, j))) any = any + a(row, j) * offset[j];
  }
  return any;
}

/// contract() of intervals with one target, rounded likewise: what is lost widens the target. A state's own
/// width is not in what is taken from the target to cut it.
template <typename Scalar, int rows, int n>
[[nodiscard]] JML_INLINE inline Scalar contract_once(const Matrix<Interval<Scalar>, rows, n>& a, int row,
                                                     Interval<Scalar> (&offset)[n],
                                                     const Interval<Scalar>& target) {
  constexpr Scalar rounding = Scalar(n + 5) * Float<Scalar>::epsilon();
  Span<Scalar> before[n + 1];
  Scalar size[n + 1];  // of the target and of what is before
  int state[n], count = 0;
  size[0] = mag(target) + Float<Scalar>::smallest_normal;
  kernel::repeat<n>([&](int j) JML_INLINE {
    const Interval<Scalar>& slope = a(row, j);
    if (is_zero(slope)) return;
    size[count + 1] = size[count] + mag(slope) * mag(offset[j]);
    before[count + 1] = before[count] + product(slope, Span<Scalar>(offset[j].low, offset[j].high));
    state[count++] = j;
  });
  if (!(size[count] < Float<Scalar>::infinite)) [[unlikely]]
    return contract(a, row, offset, [&target](int) { return target; });
  const Span<Scalar> all = before[count];
  const Scalar gap =
      std::max(all.low - target.high, target.low - all.high) - Scalar(2) * rounding * size[count];
  if (gap > Scalar(0)) return gap;
  if (target.low <= all.low && all.high <= target.high) return 0;  // says nothing
  Span<Scalar> after;
  Scalar size_after = 0;
  for (int k = count - 1; k >= 0; --k) {
    Interval<Scalar>& side = offset[state[k]];
    const Interval<Scalar>& slope = a(row, state[k]);
    if (has_sign(slope)) {
      const Scalar slack = rounding * (size[k] + size_after);
      const Span<Scalar> wide(target.low - slack, target.high + slack);
      const Span<Scalar> left = quotient(wide - (before[k] + after), slope);
      if (left.low <= side.high && side.low <= left.high)
        side = {std::max(side.low, left.low), std::min(side.high, left.high)};
    }
    if (k == 0) break;
    size_after += mag(slope) * mag(side);
    after = after + product(slope, Span<Scalar>(side.low, side.high));
  }
  return 0;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
