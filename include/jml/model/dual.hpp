// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Dual numbers a + Σ b_i ε_i, ε_i ε_j = 0: forward-mode derivatives of a model's own code, without heap.
///
/// A model function written as `template <typename T> ... (const jml::Vector<T, n>& x)` with
/// `using std::sin; sin(x(0))` runs on them unchanged. They nest: Dual<Dual<double, n>, 1> gives the
/// directional derivative of a Jacobian.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <concepts>
#include <type_traits>

namespace jml {

template <typename Base, int n>
struct Dual {
  Base value{};
  Base partial[n]{};

  constexpr Dual() = default;
  template <typename Number>
    requires std::convertible_to<Number, Base>
  constexpr Dual(const Number& number) : value(static_cast<Base>(number)) {}  // NOLINT: a constant is a dual

  /// f(value) with the chain rule's slope f'(value).
  constexpr Dual chain(const Base& function, const Base& slope) const {
    Dual out(function);
    for (int i = 0; i < n; ++i) out.partial[i] = slope * partial[i];
    return out;
  }

  friend constexpr Dual operator+(const Dual& a) { return a; }
  friend constexpr Dual operator-(const Dual& a) {
    Dual out(-a.value);
    for (int i = 0; i < n; ++i) out.partial[i] = -a.partial[i];
    return out;
  }
  friend constexpr Dual operator+(const Dual& a, const Dual& b) {
    Dual out(a.value + b.value);
    for (int i = 0; i < n; ++i) out.partial[i] = a.partial[i] + b.partial[i];
    return out;
  }
  friend constexpr Dual operator-(const Dual& a, const Dual& b) {
    Dual out(a.value - b.value);
    for (int i = 0; i < n; ++i) out.partial[i] = a.partial[i] - b.partial[i];
    return out;
  }
  friend constexpr Dual operator*(const Dual& a, const Dual& b) {
    Dual out(a.value * b.value);
    for (int i = 0; i < n; ++i) out.partial[i] = a.partial[i] * b.value + a.value * b.partial[i];
    return out;
  }
  friend constexpr Dual operator/(const Dual& a, const Dual& b) {
    const Base inverse = Base(1) / b.value;
    const Base quotient = a.value * inverse;
    Dual out(a.value / b.value);
    for (int i = 0; i < n; ++i) out.partial[i] = (a.partial[i] - quotient * b.partial[i]) * inverse;
    return out;
  }
  constexpr Dual& operator+=(const Dual& b) { return *this = *this + b; }
  constexpr Dual& operator-=(const Dual& b) { return *this = *this - b; }
  constexpr Dual& operator*=(const Dual& b) { return *this = *this * b; }
  constexpr Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend constexpr bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
  friend constexpr auto operator<=>(const Dual& a, const Dual& b) { return a.value <=> b.value; }
};

/// The plain number inside nested duals.
template <typename Number>
constexpr Number plain_value(const Number& number) {
  return number;
}
template <typename Base, int n>
constexpr auto plain_value(const Dual<Base, n>& number) {
  return plain_value(number.value);
}

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

/// Constant exponent; at a = 0 the slope is p·0^(p-1), finite for p ≥ 1.
template <typename B, int n, typename Exponent>
  requires std::is_arithmetic_v<Exponent>
Dual<B, n> pow(const Dual<B, n>& a, Exponent exponent) {
  using std::pow;
  if (exponent == Exponent(0)) return Dual<B, n>(B(1));
  return a.chain(pow(a.value, exponent), B(exponent) * pow(a.value, exponent - Exponent(1)));
}
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

// With a plain number in the other place.
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
template <typename B, int n>
Dual<B, n> max(const Dual<B, n>& a, const Dual<B, n>& b) {
  return a < b ? b : a;
}
template <typename B, int n, typename N>
  requires std::is_arithmetic_v<N>
Dual<B, n> pow(N a, const Dual<B, n>& b) {
  return pow(Dual<B, n>(a), b);
}
template <typename B, int n, typename N>
  requires std::is_arithmetic_v<N>
Dual<B, n> max(const Dual<B, n>& a, N b) {
  return max(a, Dual<B, n>(b));
}
template <typename B, int n, typename N>
  requires std::is_arithmetic_v<N>
Dual<B, n> min(const Dual<B, n>& a, N b) {
  return min(a, Dual<B, n>(b));
}
template <typename B, int n>
Dual<B, n> log10(const Dual<B, n>& a) {
  using std::log10;
  return a.chain(log10(a.value), B(0.43429448190325182765) / a.value);
}
template <typename B, int n>
Dual<B, n> asinh(const Dual<B, n>& a) {
  using std::asinh, std::sqrt;
  return a.chain(asinh(a.value), B(1) / sqrt(a.value * a.value + B(1)));
}
template <typename B, int n>
Dual<B, n> min(const Dual<B, n>& a, const Dual<B, n>& b) {
  return b < a ? b : a;
}
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
