// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Twice the digits: an unevaluated sum of two numbers, for the steps whose own precision does not suffice.
///
/// Sums and products by the error-free transformations of Knuth and Dekker (T. J. Dekker 1971), the error of
/// a product by one fused multiply-add. Relative error of an operation: a few ε².
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/attributes.hpp>
#include <limits>
#include <type_traits>

namespace jml {

/// high + low, |low| ≤ ε |high|.
template <typename Scalar>
struct Twofold {
  Scalar high = 0;  ///< rounded to Scalar
  Scalar low = 0;   ///< what that lacks

  constexpr Twofold() = default;
  /// Itself.
  constexpr Twofold(Scalar value) : high(value) {}  // NOLINT(google-explicit-constructor): the same number
  constexpr Twofold(Scalar upper, Scalar lower) : high(upper), low(lower) {}  ///< their sum is the number

  explicit constexpr operator Scalar() const { return high + low; }  ///< rounded

  /// a + b of |a| ≥ |b|, with its error.
  static constexpr Twofold ordered_sum(Scalar a, Scalar b) {
    const Scalar sum = a + b;
    return {sum, b - (sum - a)};
  }
  /// a + b, with its error.
  static constexpr Twofold sum(Scalar a, Scalar b) {
    const Scalar total = a + b, part = total - a;
    return {total, (a - (total - part)) + (b - part)};
  }

  /// To a few ε².
  /// @{
  friend constexpr Twofold operator-(const Twofold& a) { return {-a.high, -a.low}; }
  friend Twofold operator+(const Twofold& a, const Twofold& b) {
    Twofold s = sum(a.high, b.high);
    const Twofold t = sum(a.low, b.low);
    s = ordered_sum(s.high, s.low + t.high);
    return ordered_sum(s.high, s.low + t.low);
  }
  friend Twofold operator-(const Twofold& a, const Twofold& b) { return a + -b; }
  friend Twofold operator*(const Twofold& a, const Twofold& b) {
    const Scalar product = a.high * b.high;
    const Scalar error = std::fma(a.high, b.high, -product) + (a.high * b.low + a.low * b.high);
    return ordered_sum(product, error);
  }
  friend Twofold operator/(const Twofold& a, const Twofold& b) {
    const Scalar first = a.high / b.high;
    const Twofold rest = a - b * Twofold(first);
    const Scalar second = rest.high / b.high;
    const Scalar third = (rest - b * Twofold(second)).high / b.high;
    return ordered_sum(first, second) + Twofold(third);
  }
  Twofold& operator+=(const Twofold& b) { return *this = *this + b; }
  Twofold& operator-=(const Twofold& b) { return *this = *this - b; }
  Twofold& operator*=(const Twofold& b) { return *this = *this * b; }
  Twofold& operator/=(const Twofold& b) { return *this = *this / b; }
  /// @}

  /// Of the numbers, not of their upper parts alone.
  /// @{
  friend constexpr bool operator<(const Twofold& a, const Twofold& b) {
    return a.high < b.high || (a.high == b.high && a.low < b.low);
  }
  friend constexpr bool operator>(const Twofold& a, const Twofold& b) { return b < a; }
  friend constexpr bool operator==(const Twofold& a, const Twofold& b) {
    return a.high == b.high && a.low == b.low;
  }
  /// @}
};

namespace detail {

template <typename Scalar>
struct ExtendedOf {
  using type = Twofold<Scalar>;
};
template <>
struct ExtendedOf<float> {
  using type = double;
};

}  // namespace detail

/// At least twice the digits of Scalar: double for float, else Twofold.
template <typename Scalar>
using Extended = typename detail::ExtendedOf<Scalar>::type;

/// ε of Extended<Scalar>, as a Scalar.
template <typename Scalar>
inline constexpr Scalar extended_epsilon =
    std::is_same_v<Scalar, float>
        ? static_cast<Scalar>(std::numeric_limits<double>::epsilon())
        : Scalar(4) * std::numeric_limits<Scalar>::epsilon() * std::numeric_limits<Scalar>::epsilon();

/// The nearest Scalar, and what is left.
template <typename Scalar>
[[nodiscard]] constexpr Twofold<Scalar> in_two(const Extended<Scalar>& value) {
  if constexpr (std::is_same_v<Scalar, float>) {
    const auto high = static_cast<float>(value);
    return {high, std::isfinite(high) ? static_cast<float>(value - static_cast<double>(high)) : 0.0f};
  } else {
    return value;
  }
}
/// high + low.
template <typename Scalar>
[[nodiscard]] constexpr Extended<Scalar> as_one(Scalar high, Scalar low) {
  if constexpr (std::is_same_v<Scalar, float>)
    return static_cast<double>(high) + static_cast<double>(low);
  else
    return Twofold<Scalar>(high, low);
}

}  // namespace jml
#include <jml/warnings_end.hpp>
