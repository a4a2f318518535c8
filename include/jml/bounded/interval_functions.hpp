// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a model's own code may call on intervals and on dual numbers of intervals: the functions of
/// interval_elementary.hpp, those of two arguments, and those of Dual for which the chain rule is not enough.
///
/// Dual<Interval, n> encloses a function and its partial derivatives over a box. Where a function has a kink,
/// the "derivative" is the hull of the slopes on both sides: f(y) - f(x) = J (y - x) holds for some J inside,
/// which is all that a mean-value enclosure uses.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/interval_elementary.hpp>
#include <jml/model/dual_functions.hpp>

namespace jml {

/// Encloses the function over both intervals.
/// @{
template <typename B>
Interval<B> max(const Interval<B>& a, const Interval<B>& b) {
  if (isnan(a) || isnan(b)) return Interval<B>::undefined();
  return {std::max(a.low, b.low), std::max(a.high, b.high)};
}
template <typename B>
Interval<B> min(const Interval<B>& a, const Interval<B>& b) {
  return -max(-a, -b);
}
template <typename B>
Interval<B> hypot(const Interval<B>& a, const Interval<B>& b) {
  if (isnan(a) || isnan(b)) return Interval<B>::undefined();
  const B least = std::hypot(mig(a), mig(b)), most = std::hypot(mag(a), mag(b));
  return {std::max(B(0), detail::under(least)), most == B(0) ? most : detail::over(most)};
}
/// @}

/// The angle of (x, y): [-π, π] where the box meets the negative x axis, on which atan2 jumps, or the origin.
template <typename B>
Interval<B> atan2(const Interval<B>& y, const Interval<B>& x) {
  if (isnan(y) || isnan(x)) return Interval<B>::undefined();
  constexpr B most = pi<B>().high;
  const bool above = y.low > B(0), below = y.high < B(0), left = x.low <= B(0), right = x.high >= B(0);
  if (contains_zero(y) && left) return {-most, most};
  // The corners that are seen at the largest and at the smallest angle.
  const B last_x = below ? x.high : x.low, last_y = (below ? right : !left) ? y.high : y.low;
  const B first_x = above ? x.high : x.low, first_y = (above ? right : !left) ? y.low : y.high;
  const auto end = [](B angle, B at_y, bool lower) {
    if (at_y == B(0)) return B(0);
    return lower ? detail::under(angle) : detail::over(angle);
  };
  const Interval<B> out(end(std::atan2(first_y, first_x), first_y, true),
                        end(std::atan2(last_y, last_x), last_y, false));
  return detail::within(out, -most, most);
}

namespace detail {

/// x^p for one p.
template <typename B>
Interval<B> power(const Interval<B>& a, B p) {
  if (isnan(a) || p == B(1)) return a;
  if (p == B(0)) return 1;
  if (p == B(2)) return square(a);
  const auto raised = [p](B x) { return std::pow(x, p); };
  const bool whole_number = std::trunc(p) == p, odd = whole_number && std::fmod(p, B(2)) != B(0);
  const Interval<B> inside = whole_number ? a : within(a, B(0), Float<B>::infinite);
  if (isnan(inside)) return inside;
  // Library pows of some years lose hundreds of ulp beyond 2^30; beyond 1/ε no number is odd.
  constexpr B most = std::min(B(1 << 30), B(1) / std::numeric_limits<B>::epsilon());
  if (!(std::abs(p) < most) || (p < B(0) && contains_zero(inside))) return Interval<B>::whole();
  const Interval<B> base = odd ? inside : Interval<B>(mig(inside), mag(inside));
  const Interval<B> out =
      p > B(0) ? through_zero(base, raised) : -increasing(base, [&](B x) { return -raised(x); });
  return odd ? out : within(out, B(0), Float<B>::infinite);
}

}  // namespace detail

/// a^p: whole exponents of any sign of a, tight for even ones; others over the part of a that is not
/// negative. whole() for a negative exponent where a contains zero.
template <typename B>
Interval<B> pow(const Interval<B>& a, const Interval<B>& p) {
  if (p.low == p.high) return detail::power(a, p.low);
  const bool both_signs = a.low < B(0) && std::floor(p.high) >= p.low;  // a whole exponent is inside
  const Interval<B> base = both_signs ? abs(a) : detail::within(a, B(0), detail::Float<B>::infinite);
  if (isnan(base) || isnan(p)) return Interval<B>::undefined();
  // p ↦ x^p is monotone for each x.
  const Interval<B> out = hull(detail::power(base, p.low), detail::power(base, p.high));
  return both_signs ? hull(out, -out) : out;
}

namespace detail {

template <typename T>
inline constexpr bool is_interval = false;
template <typename Base>
inline constexpr bool is_interval<Interval<Base>> = true;
template <typename A, typename B>
concept IntervalAndNumber =
    (is_interval<A> && std::is_arithmetic_v<B>) || (std::is_arithmetic_v<A> && is_interval<B>);
template <typename A, typename B>
using IntervalOf = std::conditional_t<is_interval<A>, A, B>;

}  // namespace detail

/// The same, with a plain number in either place.
/// @{
template <typename A, typename B>
  requires detail::IntervalAndNumber<A, B>
detail::IntervalOf<A, B> max(const A& a, const B& b) {
  static_assert(detail::require_number_for_max<A, void>() && detail::require_number_for_max<B, void>());
  return max(detail::IntervalOf<A, B>(a), detail::IntervalOf<A, B>(b));
}
template <typename A, typename B>
  requires detail::IntervalAndNumber<A, B>
detail::IntervalOf<A, B> min(const A& a, const B& b) {
  static_assert(detail::require_number_for_max<A, void>() && detail::require_number_for_max<B, void>());
  return min(detail::IntervalOf<A, B>(a), detail::IntervalOf<A, B>(b));
}
template <typename A, typename B>
  requires detail::IntervalAndNumber<A, B>
detail::IntervalOf<A, B> hypot(const A& a, const B& b) {
  return hypot(detail::IntervalOf<A, B>(a), detail::IntervalOf<A, B>(b));
}
template <typename A, typename B>
  requires detail::IntervalAndNumber<A, B>
detail::IntervalOf<A, B> atan2(const A& y, const B& x) {
  return atan2(detail::IntervalOf<A, B>(y), detail::IntervalOf<A, B>(x));
}
template <typename A, typename B>
  requires detail::IntervalAndNumber<A, B>
detail::IntervalOf<A, B> pow(const A& a, const B& p) {
  return pow(detail::IntervalOf<A, B>(a), detail::IntervalOf<A, B>(p));
}
/// @}

/// Both slopes where zero is inside.
template <typename B, int n>
Dual<Interval<B>, n> abs(const Dual<Interval<B>, n>& a) {
  if (a.value.low >= B(0)) return a;
  if (a.value.high < B(0)) return -a;
  Dual<Interval<B>, n> out(abs(a.value));
  for (int i = 0; i < n; ++i) out.partial[i] = hull(a.partial[i], -a.partial[i]);
  return out;
}
/// Both slopes where either may be the larger.
template <typename B, int n>
Dual<Interval<B>, n> max(const Dual<Interval<B>, n>& a, const Dual<Interval<B>, n>& b) {
  if (b.value.high < a.value.low) return a;
  if (a.value.high < b.value.low) return b;
  Dual<Interval<B>, n> out(max(a.value, b.value));
  for (int i = 0; i < n; ++i) out.partial[i] = hull(a.partial[i], b.partial[i]);
  return out;
}
/// As max().
template <typename B, int n>
Dual<Interval<B>, n> min(const Dual<Interval<B>, n>& a, const Dual<Interval<B>, n>& b) {
  return -max(-a, -b);
}
/// The slopes are a cosine and a sine: at the origin too they are within ±1.
template <typename B, int n>
Dual<Interval<B>, n> hypot(const Dual<Interval<B>, n>& a, const Dual<Interval<B>, n>& b) {
  const Interval<B> h = hypot(a.value, b.value);
  const Interval<B> cosine = detail::within(a.value / h, B(-1), B(1)),
                    sine = detail::within(b.value / h, B(-1), B(1));
  Dual<Interval<B>, n> out(h);
  for (int i = 0; i < n; ++i) out.partial[i] = cosine * a.partial[i] + sine * b.partial[i];
  return out;
}
/// (2/√π) exp(-x²), its constant enclosed.
template <typename B, int n>
Dual<Interval<B>, n> erf(const Dual<Interval<B>, n>& a) {
  return a.chain(erf(a.value), Interval<B>(2) / sqrt(pi<B>()) * exp(-square(a.value)));
}
/// 1/(x ln 10), its constant enclosed.
template <typename B, int n>
Dual<Interval<B>, n> log10(const Dual<Interval<B>, n>& a) {
  return a.chain(log10(a.value), Interval<B>(1) / (log(Interval<B>(10)) * a.value));
}

namespace detail {

/// p - 1, exact for a whole number.
template <typename B>
Interval<B> one_less(const Interval<B>& p) {
  return p.low == p.high && std::trunc(p.low) == p.low ? Interval<B>(p.low - B(1)) : p - Interval<B>(1);
}

}  // namespace detail

/// Exponent a number, or a dual number too: value and slopes enclosed.
/// @{
template <typename B, int n, typename Exponent>
  requires std::is_arithmetic_v<Exponent>
Dual<Interval<B>, n> pow(const Dual<Interval<B>, n>& a, Exponent exponent) {
  const Interval<B> p(exponent);
  if (is_zero(p)) return Dual<Interval<B>, n>(1);
  return a.chain(pow(a.value, p), p * pow(a.value, detail::one_less(p)));
}
template <typename B, int n>
Dual<Interval<B>, n> pow(const Dual<Interval<B>, n>& a, const Dual<Interval<B>, n>& b) {
  const Interval<B> power = pow(a.value, b.value), slope = b.value * pow(a.value, detail::one_less(b.value));
  Dual<Interval<B>, n> out(power);
  for (int i = 0; i < n; ++i) {
    out.partial[i] = slope * a.partial[i];
    if (!is_zero(b.partial[i])) out.partial[i] += power * log(a.value) * b.partial[i];
  }
  return out;
}
/// @}

}  // namespace jml
#include <jml/warnings_end.hpp>
