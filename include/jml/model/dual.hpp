// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Dual numbers a + Σ b_i ε_i, ε_i ε_j = 0: forward-mode derivatives of a model's own code, without heap.
///
/// They nest: Dual<Dual<double, n>, 1> gives the directional derivative of a Jacobian. Their elementary
/// functions: model/dual_functions.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <Eigen/Core>
#include <compare>
#include <concepts>
#include <jml/attributes.hpp>
#include <jml/model/plain_number.hpp>
#include <utility>

namespace jml {

namespace detail {

/// The compiler knows that it is 0: the derivative of a constant, along a state that does not occur. A sum or
/// a product with it would stay, as it may be of an infinity or a -0.
template <typename Number>
JML_INLINE constexpr bool surely_zero([[maybe_unused]] const Number& number) {
#if JML_GNU
  if constexpr (std::is_floating_point_v<Number>) return __builtin_constant_p(number) && number == Number(0);
#endif
  return false;
}

}  // namespace detail

/// value + Σ partial[i] ε_i, in place of a number of the type Base. n: derivatives.
template <typename Base, int n>
struct Dual {
  Base value;       ///< the number
  Base partial[n];  ///< its derivatives

  Dual() = default;  // as of double: T() is zero, and T x; is not set
  // Part by part: copied whole, it is a call of memcpy, which costs more than its few numbers.
  /// Part by part.
  /// @{
  constexpr Dual(const Dual& other) : value(other.value) {
    each([&](int i) JML_INLINE { partial[i] = other.partial[i]; });
  }
  constexpr Dual& operator=(const Dual& other) {
    value = other.value;
    each([&](int i) JML_INLINE { partial[i] = other.partial[i]; });
    return *this;
  }
  /// @}
  /// A constant: derivatives of zero.
  template <typename Number>
    requires std::convertible_to<Number, Base>
  constexpr Dual(const Number& number)  // NOLINT(google-explicit-constructor): a constant is a dual
      : value(static_cast<Base>(number)), partial{} {}

  /// Never: here end std::sin(x), which finds no other way in than by long double, and
  /// static_cast<double>(x).
  template <typename Number>
    requires std::is_arithmetic_v<Number>
  explicit(!std::same_as<Number, long double>) constexpr operator Number() const {
    static_assert(detail::refuse_plain_function_of_dual<Base>());
    return {};
  }

  /// Its derivatives are written before they are read: zeros first would cost as much as the rest.
  struct Bare {};
  constexpr Dual(Bare, const Base& number) : value(number) {}  ///< derivatives not set

  /// The same derivatives of another value.
  constexpr Dual with(const Base& other) const {
    Dual out = *this;
    out.value = other;
    return out;
  }
  /// f(value) with the chain rule's slope f'(value).
  constexpr Dual chain(const Base& function, const Base& slope) const {
    Dual out(Bare{}, function);
    each([&](int i) JML_INLINE { out.partial[i] = slope * partial[i]; });
    return out;
  }

  /// Values and derivatives of the operation.
  /// @{
  friend constexpr Dual operator+(const Dual& a) { return a; }
  friend constexpr Dual operator-(const Dual& a) {
    Dual out(Bare{}, -a.value);
    each([&](int i) JML_INLINE { out.partial[i] = -a.partial[i]; });
    return out;
  }
  friend constexpr Dual operator+(const Dual& a, const Dual& b) {
    Dual out(Bare{}, a.value + b.value);
    each([&](int i) JML_INLINE { out.partial[i] = a.partial[i] + b.partial[i]; });
    return out;
  }
  friend constexpr Dual operator-(const Dual& a, const Dual& b) {
    Dual out(Bare{}, a.value - b.value);
    each([&](int i) JML_INLINE { out.partial[i] = a.partial[i] - b.partial[i]; });
    return out;
  }
  friend constexpr Dual operator*(const Dual& a, const Dual& b) {
    Dual out(Bare{}, a.value * b.value);
    each([&](int i) JML_INLINE { out.partial[i] = a.partial[i] * b.value + a.value * b.partial[i]; });
    return out;
  }
  friend constexpr Dual operator/(const Dual& a, const Dual& b) {
    const Base inverse = Base(1) / b.value;
    const Base quotient = a.value * inverse;
    Dual out(Bare{}, a.value / b.value);
    each([&](int i) JML_INLINE { out.partial[i] = (a.partial[i] - quotient * b.partial[i]) * inverse; });
    return out;
  }
  // With a plain number, by name: a compiler may not weigh its own operators against a conversion of Dual.
  template <detail::PlainNumber N>
  friend constexpr Dual operator+(const Dual& a, N b) {
    return a.with(a.value + Base(b));
  }
  template <detail::PlainNumber N>
  friend constexpr Dual operator+(N a, const Dual& b) {
    return b.with(Base(a) + b.value);
  }
  template <detail::PlainNumber N>
  friend constexpr Dual operator-(const Dual& a, N b) {
    return a.with(a.value - Base(b));
  }
  template <detail::PlainNumber N>
  friend constexpr Dual operator-(N a, const Dual& b) {
    return b.chain(Base(a) - b.value, Base(-1));
  }
  template <detail::PlainNumber N>
  friend constexpr Dual operator*(const Dual& a, N b) {
    return a.chain(a.value * Base(b), Base(b));
  }
  template <detail::PlainNumber N>
  friend constexpr Dual operator*(N a, const Dual& b) {
    return b.chain(Base(a) * b.value, Base(a));
  }
  template <detail::PlainNumber N>
  friend constexpr Dual operator/(const Dual& a, N b) {
    return a.chain(a.value / Base(b), Base(1) / Base(b));
  }
  template <detail::PlainNumber N>
  friend constexpr Dual operator/(N a, const Dual& b) {
    return Dual(a) / b;
  }
  constexpr Dual& operator+=(const Dual& b) { return *this = *this + b; }
  constexpr Dual& operator-=(const Dual& b) { return *this = *this - b; }
  constexpr Dual& operator*=(const Dual& b) { return *this = *this * b; }
  constexpr Dual& operator/=(const Dual& b) { return *this = *this / b; }
  /// @}

  /// use(0) … use(n - 1), unrolled where they are few.
  template <typename Use>
  JML_INLINE static constexpr void each(const Use& use) {
    if constexpr (n <= 8) {
      [&]<int... i>(std::integer_sequence<int, i...>)
          JML_INLINE { (use(i), ...); }(std::make_integer_sequence<int, n>());
    } else {
      for (int i = 0; i < n; ++i) use(i);
    }
  }

  /// By the values alone.
  /// @{
  friend constexpr bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
  friend constexpr auto operator<=>(const Dual& a, const Dual& b) { return a.value <=> b.value; }
  template <detail::PlainNumber N>
  friend constexpr bool operator==(const Dual& a, N b) {
    return a == Dual(b);
  }
  template <detail::PlainNumber N>
  friend constexpr auto operator<=>(const Dual& a, N b) {
    return a <=> Dual(b);
  }
  /// @}
};

/// The plain number inside nested duals.
template <typename Number>
constexpr Number plain_value(const Number& number) {
  return number;
}
/// The same, from a dual.
template <typename Base, int n>
constexpr auto plain_value(const Dual<Base, n>& number) {
  return plain_value(number.value);
}

}  // namespace jml

namespace Eigen {

template <typename Base, int n>
struct NumTraits<jml::Dual<Base, n>> : NumTraits<Base> {
  using Real = jml::Dual<Base, n>;
  using NonInteger = jml::Dual<Base, n>;
  using Nested = jml::Dual<Base, n>;
  using Literal = jml::Dual<Base, n>;
  enum { RequireInitialization = 1, ReadCost = 1 + n, AddCost = 1 + n, MulCost = 1 + 2 * n };
};

template <typename Base, int n, typename BinaryOp>
struct ScalarBinaryOpTraits<jml::Dual<Base, n>, double, BinaryOp> {
  using ReturnType = jml::Dual<Base, n>;
};
template <typename Base, int n, typename BinaryOp>
struct ScalarBinaryOpTraits<double, jml::Dual<Base, n>, BinaryOp> {
  using ReturnType = jml::Dual<Base, n>;
};
template <typename Base, int n, typename BinaryOp>
struct ScalarBinaryOpTraits<jml::Dual<Base, n>, float, BinaryOp> {
  using ReturnType = jml::Dual<Base, n>;
};
template <typename Base, int n, typename BinaryOp>
struct ScalarBinaryOpTraits<float, jml::Dual<Base, n>, BinaryOp> {
  using ReturnType = jml::Dual<Base, n>;
};

}  // namespace Eigen
#include <jml/warnings_end.hpp>
