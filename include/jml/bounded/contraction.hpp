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

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
