// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Elementary functions of one interval: an enclosure of f over [low, high], from f at the ends of its
/// monotone pieces.
///
/// The C library does not round correctly. Its error is taken to be at most 4 ulp: glibc's documented worst
/// of these functions is cbrt with 4, the others have 2 or less; picolibc on a Cortex-M7 stayed below 1.5 in
/// a sample. A library that errs more breaks the guarantee. Values are then cut to what f can take at all
/// (|sin| ≤ 1, exp ≥ 0, ...), and exact zeros stay.
///
/// Domain. Where only a part of [low, high] is inside the domain, the result encloses f over that part:
/// sqrt([-1, 4]) is about [0, 2]. Where nothing is inside, both ends are NaN.
///
/// Include <jml/bounded/interval_functions.hpp>, which has these, those of two arguments and those of dual
/// numbers.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/interval.hpp>

namespace jml {

namespace detail {

/// A lower bound of the value that a library function rounded to r.
template <typename Base>
Base under(Base r) {
  if (r == Float<Base>::infinite) return Float<Base>::largest;
  return r - Base(4) * (Float<Base>::epsilon() * std::abs(r) + Float<Base>::subnormal);
}
template <typename Base>
Base over(Base r) {
  return -under(-r);
}
/// f over a where it increases.
template <typename Base, typename F>
JML_INLINE inline Interval<Base> increasing(const Interval<Base>& a, const F& f) {
  return {under(f(a.low)), over(f(a.high))};
}
/// The same with f(0) = 0.
template <typename Base, typename F>
JML_INLINE inline Interval<Base> through_zero(const Interval<Base>& a, const F& f) {
  return {a.low == Base(0) ? a.low : under(f(a.low)), a.high == Base(0) ? a.high : over(f(a.high))};
}
/// The part of a in [low, high]; NaN where that is nothing.
template <typename Base>
Interval<Base> within(const Interval<Base>& a, Base low, Base high) {
  if (!(a.low <= high && low <= a.high)) return Interval<Base>::undefined();
  return {std::max(a.low, low), std::min(a.high, high)};
}

/// Which of the points (k + shift) π may lie in a: k = first..last. Not certain where a is large, then false.
template <typename Base>
[[nodiscard]] bool turning_points(const Interval<Base>& a, Base shift, int& first, int& last) {
  constexpr Base limit = Base(1 << (Float<Base>::digits / 2));  // ε limit ≪ 1: slack() is at most 0.002
  constexpr Base turns = Base(0.318309886183790671537767526745028724L);
  if (!(-limit < a.low && a.high < limit)) return false;
  const auto slack = [](Base x) { return 4 * Float<Base>::epsilon() * (std::abs(x) + 1); };
  const Base from = a.low * turns - shift - slack(a.low), to = a.high * turns - shift + slack(a.high);
  first = static_cast<int>(from);
  first += static_cast<Base>(first) < from;  // up
  last = static_cast<int>(to);
  last -= static_cast<Base>(last) > to;  // down
  return true;
}

/// sin and cos: f(a), f = ±1 at (k + shift) π, +1 where k is even.
template <typename Base, typename F>
Interval<Base> wave(const Interval<Base>& a, Base shift, const F& f) {
  if (isnan(a)) return a;
  int first = 0, last = 1;
  if (!turning_points(a, shift, first, last) || first < last) return {-1, 1};
  const Base x = f(a.low), y = f(a.high);
  const Interval<Base> ends(std::min(x, y), std::max(x, y));
  Interval<Base> out = within(through_zero(ends, [](Base end) { return end; }), Base(-1), Base(1));
  if (first == last) (first % 2 == 0 ? out.high : out.low) = first % 2 == 0 ? Base(1) : Base(-1);
  return out;
}

}  // namespace detail

/// An enclosure of π.
template <typename Base>
constexpr Interval<Base> pi() {
  if constexpr (std::same_as<Base, float>)
    return {0x1.921fb4p+1f, 0x1.921fb6p+1f};
  else
    return {0x1.921fb54442d18p+1, 0x1.921fb54442d19p+1};
}

/// Encloses the function over the interval, with the error of the C library's function on top of rounding.
/// Where it has no value on a part of the interval, that part is left out; where on none, undefined.
/// @{
template <typename B>
Interval<B> sin(const Interval<B>& a) {
  return detail::wave(a, B(0.5), [](B x) { return std::sin(x); });
}
template <typename B>
Interval<B> cos(const Interval<B>& a) {
  return detail::wave(a, B(0), [](B x) { return std::cos(x); });
}
/// whole() where a pole may be inside.
template <typename B>
Interval<B> tan(const Interval<B>& a) {
  if (isnan(a)) return a;
  int first = 0, last = 0;
  if (!detail::turning_points(a, B(0.5), first, last) || first <= last) return Interval<B>::whole();
  return detail::through_zero(a, [](B x) { return std::tan(x); });
}
template <typename B>
Interval<B> asin(const Interval<B>& a) {
  constexpr B most = pi<B>().high / 2;
  return detail::within(
      detail::through_zero(detail::within(a, B(-1), B(1)), [](B x) { return std::asin(x); }), -most, most);
}
template <typename B>
Interval<B> acos(const Interval<B>& a) {
  return detail::within(
      -detail::increasing(detail::within(a, B(-1), B(1)), [](B x) { return -std::acos(x); }), B(0),
      pi<B>().high);
}
template <typename B>
Interval<B> atan(const Interval<B>& a) {
  constexpr B most = pi<B>().high / 2;
  return detail::within(detail::through_zero(a, [](B x) { return std::atan(x); }), -most, most);
}
template <typename B>
Interval<B> sinh(const Interval<B>& a) {
  return detail::through_zero(a, [](B x) { return std::sinh(x); });
}
template <typename B>
Interval<B> cosh(const Interval<B>& a) {
  if (isnan(a)) return a;
  const Interval<B> size(mig(a), mag(a));
  return detail::within(detail::increasing(size, [](B x) { return std::cosh(x); }), B(1),
                        detail::Float<B>::infinite);
}
template <typename B>
Interval<B> tanh(const Interval<B>& a) {
  return detail::within(detail::through_zero(a, [](B x) { return std::tanh(x); }), B(-1), B(1));
}
template <typename B>
Interval<B> asinh(const Interval<B>& a) {
  return detail::through_zero(a, [](B x) { return std::asinh(x); });
}
template <typename B>
Interval<B> exp(const Interval<B>& a) {
  return detail::within(detail::increasing(a, [](B x) { return std::exp(x); }), B(0),
                        detail::Float<B>::infinite);
}
template <typename B>
Interval<B> expm1(const Interval<B>& a) {
  return detail::within(detail::through_zero(a, [](B x) { return std::expm1(x); }), B(-1),
                        detail::Float<B>::infinite);
}
template <typename B>
Interval<B> log(const Interval<B>& a) {
  const Interval<B> inside = detail::within(a, B(0), detail::Float<B>::infinite);
  if (!(inside.high > B(0))) return Interval<B>::undefined();
  return detail::increasing(inside, [](B x) { return std::log(x); });
}
template <typename B>
Interval<B> log10(const Interval<B>& a) {
  const Interval<B> inside = detail::within(a, B(0), detail::Float<B>::infinite);
  if (!(inside.high > B(0))) return Interval<B>::undefined();
  return detail::increasing(inside, [](B x) { return std::log10(x); });
}
template <typename B>
Interval<B> log1p(const Interval<B>& a) {
  const Interval<B> inside = detail::within(a, B(-1), detail::Float<B>::infinite);
  if (!(inside.high > B(-1))) return Interval<B>::undefined();
  return detail::through_zero(inside, [](B x) { return std::log1p(x); });
}
template <typename B>
Interval<B> erf(const Interval<B>& a) {
  return detail::within(detail::through_zero(a, [](B x) { return std::erf(x); }), B(-1), B(1));
}
template <typename B>
Interval<B> cbrt(const Interval<B>& a) {
  return detail::through_zero(a, [](B x) { return std::cbrt(x); });
}
/// IEEE 754 rounds this one correctly.
template <typename B>
Interval<B> sqrt(const Interval<B>& a) {
  const Interval<B> inside = detail::within(a, B(0), detail::Float<B>::infinite);
  return {detail::below(std::sqrt(inside.low)), detail::above(std::sqrt(inside.high))};
}

template <typename B>
Interval<B> abs(const Interval<B>& a) {
  return isnan(a) ? a : Interval<B>(mig(a), mag(a));
}
template <typename B>
Interval<B> fabs(const Interval<B>& a) {
  return abs(a);
}
/// @}

}  // namespace jml
#include <jml/warnings_end.hpp>
