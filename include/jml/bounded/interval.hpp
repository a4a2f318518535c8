// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Interval arithmetic: [low, high] holds every value that the expression takes on its operands' numbers.
///
/// Rounding. An IEEE sum, difference, product, quotient or root r is within half an ulp of the exact one, and
/// ε/2 |r| is between half an ulp and one. r ∓ (3/4) ε |r|, itself rounded, fused or not, is therefore the
/// neighbour of r, and the exact result is on the inner side of it. A subnormal sum is exact; a product or a
/// quotient that underflows, overflows or meets an infinity leaves the fast path. The rounding mode is never
/// touched; it must be to nearest, with subnormals (no flush to zero).
///
/// What an interval cannot know: that two operands depend on each other. x - x is [-width, width]. One case
/// is seen: a product of an object with itself, x(0) * x(0), is a square, for an object stands for one
/// number.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <compare>
#include <concepts>
#include <jml/linear_algebra.hpp>
#include <jml/model/plain_number.hpp>
#include <limits>

namespace jml {

template <typename Base>
struct Interval;

namespace detail {

template <typename Base>
struct Float : std::numeric_limits<Base> {
  static constexpr Base largest = Float::max(), smallest_normal = Float::min(), infinite = Float::infinity(),
                        subnormal = Float::denorm_min(), widening = Base(0.75) * Float::epsilon();
};

/// A bound of the exact result that was rounded to r: finite, and no product or quotient that underflowed.
template <typename Base>
JML_INLINE inline Base below(Base r) {
  return r - Float<Base>::widening * std::abs(r);
}
template <typename Base>
JML_INLINE inline Base above(Base r) {
  return r + Float<Base>::widening * std::abs(r);
}
/// The same for every r.
template <typename Base>
Base below_any(Base r) {
  if (r == Float<Base>::infinite) return Float<Base>::largest;
  return r - (Float<Base>::widening * std::abs(r) + Float<Base>::subnormal);
}
template <typename Base>
Base above_any(Base r) {
  return -below_any(-r);
}

/// [low, high] from rounded sums.
template <typename Base>
JML_INLINE inline Interval<Base> enclose_sum(Base low, Base high) {
  if (!(high - low < Float<Base>::infinite)) [[unlikely]]
    return {below_any(low), above_any(high)};
  return {below(low), above(high)};
}

/// True where below() and above() serve the products or quotients low and high; sum: of all to be finite.
template <typename Base>
JML_INLINE inline bool are_normal(Base sum, Base low, Base high) {
  return std::abs(sum) < Float<Base>::infinite &&
         std::min(std::abs(low), std::abs(high)) >= Float<Base>::smallest_normal;
}

template <typename Base>
JML_RARE Interval<Base> product_at_the_edge(Interval<Base> a, Interval<Base> b) {
  if (isnan(a) || isnan(b)) return Interval<Base>::undefined();
  if (is_zero(a)) return a;
  if (is_zero(b)) return b;
  Interval<Base> out(Float<Base>::infinite, -Float<Base>::infinite);
  for (const Base x : {a.low, a.high}) {
    for (const Base y : {b.low, b.high}) {
      const bool zero = x == Base(0) || y == Base(0);  // also of an infinity, which is no number inside
      out.low = std::min(out.low, zero ? Base(0) : below_any(x * y));
      out.high = std::max(out.high, zero ? Base(0) : above_any(x * y));
    }
  }
  return out;
}

template <typename Base>
JML_RARE Interval<Base> quotient_at_the_edge(Interval<Base> a, Interval<Base> b, Base low, Base high) {
  if (isnan(a) || isnan(b)) return Interval<Base>::undefined();
  if (contains_zero(b) || std::isnan(low) || std::isnan(high)) return Interval<Base>::whole();
  return {a.low == Base(0) ? Base(0) : below_any(low), a.high == Base(0) ? Base(0) : above_any(high)};
}

template <typename Other, typename Answer>
constexpr Answer refuse_comparison(Answer answer) {
  static_assert(!sizeof(Other*),
                "jml: the model compares states; a box has no single answer: use abs, min, max or write it "
                "without a branch, or use jml::Linearised");
  return answer;
}

}  // namespace detail

/// The numbers from low to high, both included. Ends that are NaN: the operation had no value anywhere on its
/// operands; isfinite() says no, and every operation hands it on.
///
/// A number converts implicitly, outward where Base cannot hold it, and stands for itself: 0.05 is not 1/20.
template <typename Base>
struct Interval {
  static_assert(std::same_as<Base, float> || std::same_as<Base, double>, "jml: Interval<float> or <double>");
  using Limits = detail::Float<Base>;  ///< of the ends
  Base low{};                          ///< least number inside
  Base high{};                         ///< greatest one

  constexpr Interval() = default;
  constexpr Interval(Base lower, Base upper) : low(lower), high(upper) {}  ///< lower ≤ upper, or both NaN
  /// From a number: itself, or, where Base cannot hold it, an interval about it.
  template <typename Number>
    requires std::is_arithmetic_v<Number>
  constexpr Interval(Number number)  // NOLINT: a constant is an interval
      : low(static_cast<Base>(number)), high(low) {
    using From = std::numeric_limits<Number>;
    if constexpr (From::digits > Limits::digits || From::max_exponent > Limits::max_exponent) {
      const bool exact =
          From::is_integer ? std::abs(low) < 2 / Limits::epsilon() : static_cast<Number>(low) == number;
      if (!exact) *this = {detail::below_any(low), detail::above_any(high)};
    }
  }
  /// Never, as of Dual: here ends std::sin(x).
  template <typename Number>
    requires std::is_arithmetic_v<Number>
  explicit(!std::same_as<Number, long double>) constexpr operator Number() const {
    static_assert(detail::refuse_plain_function_of_interval<Base>());
    return {};
  }
  constexpr auto each_part(auto&& f) { return f(low, high); }  ///< for saving, image/parts.hpp
  static constexpr Interval whole() { return {-Limits::infinite, Limits::infinite}; }  ///< every number
  /// No value at all: both ends NaN.
  static constexpr Interval undefined() { return {Limits::quiet_NaN(), Limits::quiet_NaN()}; }

  [[nodiscard]] Base width() const { return detail::above(high - low); }  ///< high - low, rounded up
  /// A number inside, half way to rounding; finite also where an end is not.
  [[nodiscard]] Base centre() const {
    const Base half = Base(0.5) * (low + high);
    if (std::abs(half) < Limits::infinite) return half;
    constexpr Base most = Limits::largest;
    return Base(0.5) * std::clamp(low, -most, most) + Base(0.5) * std::clamp(high, -most, most);
  }
  /// centre() ± radius() covers the interval: rounded up.
  [[nodiscard]] Base radius() const {
    const Base middle = centre();
    return detail::above(std::max(high - middle, middle - low));
  }
  /// Ends included.
  [[nodiscard]] bool contains(Base number) const { return low <= number && number <= high; }
  /// Ends included.
  [[nodiscard]] bool contains(const Interval& other) const { return low <= other.low && other.high <= high; }

  /// Encloses the results of the operation on all numbers of its operands; undefined where an operand is. By
  /// a divisor with zero inside: the whole line.
  /// @{
  JML_INLINE friend Interval operator+(const Interval& a) { return a; }
  JML_INLINE friend Interval operator-(const Interval& a) { return {-a.high, -a.low}; }
  JML_INLINE friend Interval operator+(const Interval& a, const Interval& b) {
    if (is_zero(b)) return a;
    if (is_zero(a)) return b;
    return detail::enclose_sum(a.low + b.low, a.high + b.high);
  }
  JML_INLINE friend Interval operator-(const Interval& a, const Interval& b) {
    if (is_zero(b)) return a;
    if (is_zero(a)) return -b;
    return detail::enclose_sum(a.low - b.high, a.high - b.low);
  }
  JML_INLINE friend Interval operator*(const Interval& a, const Interval& b) {
    if (&a == &b) return square(a);
    const Base ll = a.low * b.low, lh = a.low * b.high, hl = a.high * b.low, hh = a.high * b.high;
    const Base lower = std::min(std::min(ll, lh), std::min(hl, hh));
    const Base upper = std::max(std::max(ll, lh), std::max(hl, hh));
    if (!detail::are_normal((ll + lh) + (hl + hh), lower, upper)) [[unlikely]]
      return detail::product_at_the_edge(a, b);
    return {detail::below(lower), detail::above(upper)};
  }
  /// whole() where b contains zero.
  JML_INLINE friend Interval operator/(const Interval& a, const Interval& b) {
    const Interval up = is_negative(b) ? -a : a, down = is_negative(b) ? -b : b;
    const Base lower = up.low / (up.low < Base(0) ? down.low : down.high);
    const Base upper = up.high / (up.high < Base(0) ? down.high : down.low);
    if (!(down.low > Base(0) && detail::are_normal(lower + upper + down.high, lower, upper))) [[unlikely]]
      return detail::quotient_at_the_edge(up, down, lower, upper);
    return {detail::below(lower), detail::above(upper)};
  }
  // With a plain number, by name, as of Dual.
  template <detail::PlainNumber N>
  JML_INLINE friend Interval operator+(const Interval& a, N b) {
    return a + Interval(b);
  }
  template <detail::PlainNumber N>
  JML_INLINE friend Interval operator+(N a, const Interval& b) {
    return Interval(a) + b;
  }
  template <detail::PlainNumber N>
  JML_INLINE friend Interval operator-(const Interval& a, N b) {
    return a - Interval(b);
  }
  template <detail::PlainNumber N>
  JML_INLINE friend Interval operator-(N a, const Interval& b) {
    return Interval(a) - b;
  }
  template <detail::PlainNumber N>
  JML_INLINE friend Interval operator*(const Interval& a, N b) {
    return a * Interval(b);
  }
  template <detail::PlainNumber N>
  JML_INLINE friend Interval operator*(N a, const Interval& b) {
    return Interval(a) * b;
  }
  template <detail::PlainNumber N>
  JML_INLINE friend Interval operator/(const Interval& a, N b) {
    return a / Interval(b);
  }
  template <detail::PlainNumber N>
  JML_INLINE friend Interval operator/(N a, const Interval& b) {
    return Interval(a) / b;
  }
  Interval& operator+=(const Interval& b) { return *this = *this + b; }
  Interval& operator-=(const Interval& b) { return *this = *this - b; }
  Interval& operator*=(const Interval& b) { return *this = *this * b; }
  Interval& operator/=(const Interval& b) { return *this = *this / b; }
  /// @}

  /// Refused at compile time: two intervals have no order. Ask centre() or contains().
  /// @{
  template <typename Other>
  friend std::partial_ordering operator<=>(const Interval&, const Other&) {
    return detail::refuse_comparison<Other>(std::partial_ordering::unordered);
  }
  template <typename Other>
  friend bool operator==(const Interval&, const Other&) {
    return detail::refuse_comparison<Other>(false);
  }
  /// @}

  /// [0, 0]. By ==, which has to think of NaN too, a fifth of a guaranteed step went into this question.
  JML_INLINE friend bool is_zero(const Interval& a) { return a.low >= Base(0) && a.high <= Base(0); }
  friend bool isnan(const Interval& a) { return std::isunordered(a.low, a.high); }  ///< undefined
  /// Both ends are.
  friend bool isfinite(const Interval& a) { return std::isfinite(a.low) && std::isfinite(a.high); }
  friend bool contains_zero(const Interval& a) { return a.low <= Base(0) && Base(0) <= a.high; }  ///< 0 in it
  friend bool is_positive(const Interval& a) { return a.low > Base(0); }   ///< every number inside is
  friend bool is_negative(const Interval& a) { return a.high < Base(0); }  ///< every number inside is
  /// The largest, the smallest absolute value inside.
  friend Base mag(const Interval& a) { return std::max(-a.low, a.high); }
  friend Base mig(const Interval& a) { return std::max(Base(0), std::max(a.low, -a.high)); }  ///< see mag()

  /// a², never negative.
  JML_INLINE friend Interval square(const Interval& a) {
    const Base least = mig(a), most = mag(a), lower = least * least, upper = most * most;
    if (detail::are_normal(a.low + a.high + upper, least == Base(0) ? upper : lower, upper)) [[likely]]
      return {detail::below(lower), detail::above(upper)};
    const Interval any = detail::product_at_the_edge(a, a);
    return {any.low < Base(0) ? Base(0) : any.low, any.high};
  }
  /// The smallest interval that contains both.
  friend Interval hull(const Interval& a, const Interval& b) {
    if (isnan(a) || isnan(b)) return undefined();
    return {std::min(a.low, b.low), std::max(a.high, b.high)};
  }
  /// What a and b have in common. False, and `common` as it was, where that is nothing.
  [[nodiscard]] friend bool intersect(const Interval& a, const Interval& b, Interval& common) {
    const bool meet = a.low <= b.high && b.low <= a.high;
    if (meet) common = {std::max(a.low, b.low), std::min(a.high, b.high)};
    return meet;
  }
};

}  // namespace jml

namespace Eigen {

template <typename Base>
struct NumTraits<jml::Interval<Base>> : NumTraits<Base> {
  using Real = jml::Interval<Base>;
  using NonInteger = Real;
  using Nested = Real;
  using Literal = Real;
  enum { RequireInitialization = 1, ReadCost = 2, AddCost = 6, MulCost = 16 };
};

template <typename Base, std::floating_point Number, typename BinaryOp>
struct ScalarBinaryOpTraits<jml::Interval<Base>, Number, BinaryOp> {
  using ReturnType = jml::Interval<Base>;
};
template <typename Base, std::floating_point Number, typename BinaryOp>
struct ScalarBinaryOpTraits<Number, jml::Interval<Base>, BinaryOp> {
  using ReturnType = jml::Interval<Base>;
};

}  // namespace Eigen
#include <jml/warnings_end.hpp>
