// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The elementary functions of dual numbers: value and chain rule.
///
/// A model function written as `template <typename T> ... (const jml::Vector<T, n>& x)` with
/// `using std::sin; sin(x(0))` runs on them unchanged.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/model/dual.hpp>
#include <type_traits>

namespace jml {

/// The function with its derivative by the chain rule: NaN or infinite where that has none (√ and ∛ at 0).
/// abs at 0: slope 1 or -1.
/// @{
template <typename B, int n>
Dual<B, n> sin(const Dual<B, n>& a) {
  using std::sin, std::cos;
  return a.chain(sin(a.value), cos(a.value));
}
template <typename B, int n>
Dual<B, n> cos(const Dual<B, n>& a) {
  using std::sin, std::cos;
  return a.chain(cos(a.value), -sin(a.value));
}
template <typename B, int n>
Dual<B, n> tan(const Dual<B, n>& a) {
  using std::tan;
  const B t = tan(a.value);
  return a.chain(t, B(1) + t * t);
}
template <typename B, int n>
Dual<B, n> asin(const Dual<B, n>& a) {
  using std::asin, std::sqrt;
  return a.chain(asin(a.value), B(1) / sqrt(B(1) - a.value * a.value));
}
template <typename B, int n>
Dual<B, n> acos(const Dual<B, n>& a) {
  using std::acos, std::sqrt;
  return a.chain(acos(a.value), B(-1) / sqrt(B(1) - a.value * a.value));
}
template <typename B, int n>
Dual<B, n> atan(const Dual<B, n>& a) {
  using std::atan;
  return a.chain(atan(a.value), B(1) / (B(1) + a.value * a.value));
}
template <typename B, int n>
Dual<B, n> sinh(const Dual<B, n>& a) {
  using std::sinh, std::cosh;
  return a.chain(sinh(a.value), cosh(a.value));
}
template <typename B, int n>
Dual<B, n> cosh(const Dual<B, n>& a) {
  using std::sinh, std::cosh;
  return a.chain(cosh(a.value), sinh(a.value));
}
template <typename B, int n>
Dual<B, n> tanh(const Dual<B, n>& a) {
  using std::tanh;
  const B t = tanh(a.value);
  return a.chain(t, B(1) - t * t);
}
template <typename B, int n>
Dual<B, n> asinh(const Dual<B, n>& a) {
  using std::asinh, std::sqrt;
  return a.chain(asinh(a.value), B(1) / sqrt(a.value * a.value + B(1)));
}
template <typename B, int n>
Dual<B, n> exp(const Dual<B, n>& a) {
  using std::exp;
  const B e = exp(a.value);
  return a.chain(e, e);
}
template <typename B, int n>
Dual<B, n> expm1(const Dual<B, n>& a) {
  using std::expm1;
  const B e = expm1(a.value);
  return a.chain(e, e + B(1));
}
template <typename B, int n>
Dual<B, n> log(const Dual<B, n>& a) {
  using std::log;
  return a.chain(log(a.value), B(1) / a.value);
}
template <typename B, int n>
Dual<B, n> log1p(const Dual<B, n>& a) {
  using std::log1p;
  return a.chain(log1p(a.value), B(1) / (B(1) + a.value));
}
template <typename B, int n>
Dual<B, n> log10(const Dual<B, n>& a) {
  using std::log10;
  return a.chain(log10(a.value), B(0.43429448190325182765) / a.value);
}
template <typename B, int n>
Dual<B, n> sqrt(const Dual<B, n>& a) {
  using std::sqrt;
  const B r = sqrt(a.value);
  return a.chain(r, B(0.5) / r);
}
template <typename B, int n>
Dual<B, n> cbrt(const Dual<B, n>& a) {
  using std::cbrt;
  const B r = cbrt(a.value);
  return a.chain(r, B(1) / (B(3) * r * r));
}
template <typename B, int n>
Dual<B, n> abs(const Dual<B, n>& a) {
  return plain_value(a) < 0 ? -a : a;
}
template <typename B, int n>
Dual<B, n> fabs(const Dual<B, n>& a) {
  return abs(a);
}
template <typename B, int n>
Dual<B, n> erf(const Dual<B, n>& a) {
  using std::erf, std::exp;
  return a.chain(erf(a.value), B(1.1283791670955125739) * exp(-a.value * a.value));
}
/// @}

/// With both derivatives; at the origin they are NaN.
/// @{
template <typename B, int n>
Dual<B, n> atan2(const Dual<B, n>& y, const Dual<B, n>& x) {
  using std::atan2;
  const B inverse = B(1) / (x.value * x.value + y.value * y.value);
  Dual<B, n> out(atan2(y.value, x.value));
  for (int i = 0; i < n; ++i) out.partial[i] = (x.value * y.partial[i] - y.value * x.partial[i]) * inverse;
  return out;
}

template <typename B, int n>
Dual<B, n> hypot(const Dual<B, n>& a, const Dual<B, n>& b) {
  using std::hypot;
  const B h = hypot(a.value, b.value);
  Dual<B, n> out(h);
  for (int i = 0; i < n; ++i) out.partial[i] = (a.value * a.partial[i] + b.value * b.partial[i]) / h;
  return out;
}
/// @}

/// Constant exponent; at a = 0 the slope is p·0^(p-1), finite for p ≥ 1.
template <typename B, int n, typename Exponent>
  requires std::is_arithmetic_v<Exponent>
Dual<B, n> pow(const Dual<B, n>& a, Exponent exponent) {
  using std::pow;
  if (exponent == Exponent(0)) return Dual<B, n>(B(1));
  return a.chain(pow(a.value, exponent), B(exponent) * pow(a.value, exponent - Exponent(1)));
}
/// An exponent that has derivatives too: where a ≤ 0 and they are not zero, NaN.
template <typename B, int n>
Dual<B, n> pow(const Dual<B, n>& a, const Dual<B, n>& b) {
  using std::pow, std::log;
  const B power = pow(a.value, b.value);
  Dual<B, n> out(power);
  for (int i = 0; i < n; ++i) {
    out.partial[i] = b.value * pow(a.value, b.value - B(1)) * a.partial[i] +
                     (plain_value(b.partial[i]) == 0 ? B(0) : power * log(a.value) * b.partial[i]);
  }
  return out;
}

/// The larger, the smaller one with its derivatives; of equal ones the first.
/// @{
template <typename B, int n>
Dual<B, n> max(const Dual<B, n>& a, const Dual<B, n>& b) {
  return a < b ? b : a;
}
template <typename B, int n>
Dual<B, n> min(const Dual<B, n>& a, const Dual<B, n>& b) {
  return b < a ? b : a;
}
/// @}
/// Of the value alone.
/// @{
template <typename B, int n>
bool isfinite(const Dual<B, n>& a) {
  using std::isfinite;
  return isfinite(plain_value(a));
}
template <typename B, int n>
bool isnan(const Dual<B, n>& a) {
  using std::isnan;
  return isnan(plain_value(a));
}
/// @}

/// With a plain number in either place.
/// @{
template <typename B, int n, typename N>
  requires std::is_arithmetic_v<N>
Dual<B, n> atan2(const Dual<B, n>& y, N x) {
  return atan2(y, Dual<B, n>(x));
}
template <typename B, int n, typename N>
  requires std::is_arithmetic_v<N>
Dual<B, n> atan2(N y, const Dual<B, n>& x) {
  return atan2(Dual<B, n>(y), x);
}
template <typename B, int n, typename N>
  requires std::is_arithmetic_v<N>
Dual<B, n> hypot(const Dual<B, n>& a, N b) {
  return hypot(a, Dual<B, n>(b));
}
template <typename B, int n, typename N>
  requires std::is_arithmetic_v<N>
Dual<B, n> hypot(N a, const Dual<B, n>& b) {
  return hypot(Dual<B, n>(a), b);
}
template <typename B, int n, typename N>
  requires std::is_arithmetic_v<N>
Dual<B, n> pow(N a, const Dual<B, n>& b) {
  return pow(Dual<B, n>(a), b);
}
template <typename B, int n, detail::PlainNumber N>
Dual<B, n> max(const Dual<B, n>& a, N b) {
  static_assert(detail::require_number_for_max<N, decltype(plain_value(B()))>());
  return max(a, Dual<B, n>(b));
}
template <typename B, int n, detail::PlainNumber N>
Dual<B, n> max(N a, const Dual<B, n>& b) {
  static_assert(detail::require_number_for_max<N, decltype(plain_value(B()))>());
  return max(Dual<B, n>(a), b);
}
template <typename B, int n, detail::PlainNumber N>
Dual<B, n> min(const Dual<B, n>& a, N b) {
  static_assert(detail::require_number_for_max<N, decltype(plain_value(B()))>());
  return min(a, Dual<B, n>(b));
}
template <typename B, int n, detail::PlainNumber N>
Dual<B, n> min(N a, const Dual<B, n>& b) {
  static_assert(detail::require_number_for_max<N, decltype(plain_value(B()))>());
  return min(Dual<B, n>(a), b);
}
/// @}

}  // namespace jml
#include <jml/warnings_end.hpp>
