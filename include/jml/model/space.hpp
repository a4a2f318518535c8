// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The space a state lives in: how a tangent vector moves a state, plus(x, δ), and which one leads from b to
/// a, minus(a, b), with plus(b, minus(a, b)) = a.
///
/// A dynamics struct says `using Space = jml::Product<jml::SO3, jml::Euclidean<12>>;`, or gives the two
/// functions itself, static, with `static constexpr int tangent`. One that says nothing lives in ℝⁿ. A group
/// of another library comes in by a specialisation of SpaceTraits. Perturbations are on the right (in the
/// body's axes): x ⊞ δ = x Exp(δ).
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <concepts>
#include <jml/linear_algebra.hpp>
#include <jml/model/jacobian.hpp>

namespace jml {

/// What an estimator asks of a space. Specialise it for a type that cannot be edited.
///   numbers   of a state
///   tangent   degrees of freedom: the size of δ, of P, of a correction
///   plus(x, δ), minus(a, b)   in any scalar, dual numbers too
///   contains(x)   optional: x is a state to the digits of its scalar, as a unit quaternion has the length 1
///   origin<T>()   optional: the state that the SDC matrices are about; zeros
template <typename Space>
struct SpaceTraits {
  /// See above.
  /// @{
  static constexpr int numbers = Space::numbers, tangent = Space::tangent;
  template <typename T>
  static Vector<T, numbers> plus(const Vector<T, numbers>& x, const Vector<T, tangent>& delta) {
    return Space::plus(x, delta);
  }
  template <typename T>
  static Vector<T, tangent> minus(const Vector<T, numbers>& a, const Vector<T, numbers>& b) {
    return Space::minus(a, b);
  }
  /// @}
};

namespace detail {

/// The traits of a space with what a space may leave out.
template <typename Space>
struct WholeSpace : SpaceTraits<Space> {
  using Traits = SpaceTraits<Space>;
  static constexpr int numbers = Traits::numbers, tangent = Traits::tangent;
  using Traits::minus;
  using Traits::plus;

  template <typename T>
  static bool contains(const Vector<T, numbers>& x) {
    if constexpr (requires { Traits::contains(x); })
      return Traits::contains(x);
    else if constexpr (requires { Space::contains(x); })
      return Space::contains(x);
    else
      return true;
  }
  template <typename T>
  static Vector<T, numbers> origin() {
    if constexpr (requires { Traits::template origin<T>(); })
      return Traits::template origin<T>();
    else if constexpr (requires { Space::template origin<T>(); })
      return Space::template origin<T>();
    else
      return kernel::zeros<Vector<T, numbers>>();
  }

  // For speed alone: what the two functions above answer too, in fewer operations.
  /// plus(x, δ) at δ = 0, δ_j being ε_(first + j) of m where there is one, else 0.
  template <int m, typename T>
  static Vector<Dual<T, m>, numbers> seed_at(const Vector<T, numbers>& x, int first = 0) {
    if constexpr (requires { Space::template seed_at<m>(x, first); }) {
      return Space::template seed_at<m>(x, first);
    } else {
      Vector<Dual<T, m>, numbers> wide;
      Vector<Dual<T, m>, tangent> delta;
      for (int i = 0; i < numbers; ++i) wide(i) = x(i);
      for (int i = 0; i < tangent; ++i) {
        delta(i) = T(0);
        if (first + i >= 0 && first + i < m) delta(i).partial[first + i] = T(1);
      }
      return plus(wide, delta);
    }
  }
  /// The derivatives of minus(a, b), tangent×m.
  template <typename T, int m>
  static Matrix<T, tangent, m> slope_of_minus(const Vector<Dual<T, m>, numbers>& a,
                                              const Vector<T, numbers>& b) {
    if constexpr (requires { Space::slope_of_minus(a, b); }) {
      return Space::slope_of_minus(a, b);
    } else {
      Vector<Dual<T, m>, numbers> wide;
      for (int i = 0; i < numbers; ++i) wide(i) = b(i);
      const Vector<Dual<T, m>, tangent> off = minus(a, wide);
      Matrix<T, tangent, m> out;
      for (int i = 0; i < tangent; ++i) {
        for (int j = 0; j < m; ++j) out(i, j) = off(i).partial[j];
      }
      return out;
    }
  }
  /// How plus(x, z + δ) moves in the tangent where it stands, by δ: J_r(z) of a group.
  template <typename T>
  static Matrix<T, tangent, tangent> chart_slope(const Vector<T, numbers>& x, const Vector<T, tangent>& z) {
    bool still = true;
    for (int i = 0; i < tangent; ++i) still = still && z(i) == T(0);
    if (still) return kernel::identity<Matrix<T, tangent, tangent>>();
    if constexpr (requires { Space::chart_slope(x, z); }) {
      return Space::chart_slope(x, z);
    } else {
      Vector<Dual<T, tangent>, numbers> wide;
      for (int i = 0; i < numbers; ++i) wide(i) = x(i);
      return slope_of_minus(plus(wide, seed(z)), plus(x, z));
    }
  }
};

/// x of length 1, of an x that had it but for rounding. Any other one stays what it is: 2 x would become -x.
template <typename T, int n>
void near_unit(Vector<T, n>& x) {
  const T off = kernel::squared_norm(x) - T(1);
  if (!(std::abs(off) < T(0.25))) return;
  for (int i = 0; i < n; ++i) x(i) *= T(1) - off / T(2);
}

}  // namespace detail

/// ℝⁿ.
template <int n>
struct Euclidean {
  /// What model/space.hpp asks of a space.
  /// @{
  static constexpr int numbers = n, tangent = n;
  template <typename T>
  static Vector<T, n> plus(const Vector<T, n>& x, const Vector<T, n>& delta) {
    return x + delta;
  }
  template <typename T>
  static Vector<T, n> minus(const Vector<T, n>& a, const Vector<T, n>& b) {
    return a - b;
  }
  template <typename T>
  static Matrix<T, n, n> chart_slope(const Vector<T, n>&, const Vector<T, n>&) {
    return kernel::identity<Matrix<T, n, n>>();
  }
  template <int m, typename T>
  static Vector<Dual<T, m>, n> seed_at(const Vector<T, n>& x, int first) {
    Vector<Dual<T, m>, n> out;
    for (int i = 0; i < n; ++i) {
      out(i) = x(i);
      if (first + i >= 0 && first + i < m) out(i).partial[first + i] = T(1);
    }
    return out;
  }
  template <typename T, int m>
  static Matrix<T, n, m> slope_of_minus(const Vector<Dual<T, m>, n>& a, const Vector<T, n>&) {
    Matrix<T, n, m> out;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < m; ++j) out(i, j) = a(i).partial[j];
    }
    return out;
  }
  /// @}
};

/// An angle, rad, kept in [-π, π].
struct SO2 {
  /// What model/space.hpp asks of a space: 1 number, 1 degree of freedom.
  /// @{
  static constexpr int numbers = 1, tangent = 1;
  template <typename T>
  static Vector<T, 1> plus(const Vector<T, 1>& x, const Vector<T, 1>& delta) {
    return Vector<T, 1>(wrapped(x(0) + delta(0)));
  }
  template <typename T>
  static Vector<T, 1> minus(const Vector<T, 1>& a, const Vector<T, 1>& b) {
    return Vector<T, 1>(wrapped(a(0) - b(0)));
  }
  /// @}

 private:
  template <typename T>
  static T wrapped(const T& angle) {
    using Plain = decltype(plain_value(angle));
    constexpr Plain turn = Plain(6.283185307179586476925L);
    return angle - T(turn * std::round(plain_value(angle) / turn));
  }
};

namespace detail {

/// `size` numbers of x from `first` on.
template <int size, typename T, int n>
Vector<T, size> piece(const Vector<T, n>& x, int first) {
  Vector<T, size> out;
  for (int i = 0; i < size; ++i) out(i) = x(first + i);
  return out;
}
template <typename T, int n, int size>
void set_piece(Vector<T, n>& x, int first, const Vector<T, size>& value) {
  for (int i = 0; i < size; ++i) x(first + i) = value(i);
}

}  // namespace detail

/// Spaces side by side: the numbers of the first, then those of the second, …
template <typename... Spaces>
struct Product {
  /// What model/space.hpp asks of a space, each from its parts.
  /// @{
  static constexpr int numbers = (0 + ... + SpaceTraits<Spaces>::numbers);
  static constexpr int tangent = (0 + ... + SpaceTraits<Spaces>::tangent);

  template <typename T>
  static Vector<T, numbers> plus(const Vector<T, numbers>& x, const Vector<T, tangent>& delta) {
    Vector<T, numbers> out;
    each([&]<typename A>(int at, int along) {
      detail::set_piece(out, at,
                        A::plus(detail::piece<A::numbers>(x, at), detail::piece<A::tangent>(delta, along)));
    });
    return out;
  }
  template <typename T>
  static Vector<T, tangent> minus(const Vector<T, numbers>& a, const Vector<T, numbers>& b) {
    Vector<T, tangent> out;
    each([&]<typename A>(int at, int along) {
      detail::set_piece(out, along,
                        A::minus(detail::piece<A::numbers>(a, at), detail::piece<A::numbers>(b, at)));
    });
    return out;
  }
  template <typename T>
  static bool contains(const Vector<T, numbers>& x) {
    bool all = true;
    each([&]<typename A>(int at, int) { all = all && A::contains(detail::piece<A::numbers>(x, at)); });
    return all;
  }
  template <typename T>
  static Vector<T, numbers> origin() {
    Vector<T, numbers> out;
    each([&]<typename A>(int at, int) { detail::set_piece(out, at, A::template origin<T>()); });
    return out;
  }

  template <int m, typename T>
  static Vector<Dual<T, m>, numbers> seed_at(const Vector<T, numbers>& x, int first) {
    Vector<Dual<T, m>, numbers> out;
    each([&]<typename A>(int at, int along) {
      detail::set_piece(out, at, A::template seed_at<m>(detail::piece<A::numbers>(x, at), first + along));
    });
    return out;
  }
  template <typename T, int m>
  static Matrix<T, tangent, m> slope_of_minus(const Vector<Dual<T, m>, numbers>& a,
                                              const Vector<T, numbers>& b) {
    Matrix<T, tangent, m> out;
    each([&]<typename A>(int at, int along) {
      const Matrix<T, A::tangent, m> rows =
          A::slope_of_minus(detail::piece<A::numbers>(a, at), detail::piece<A::numbers>(b, at));
      for (int j = 0; j < m; ++j) {
        for (int i = 0; i < A::tangent; ++i) out(along + i, j) = rows(i, j);
      }
    });
    return out;
  }
  template <typename T>
  static Matrix<T, tangent, tangent> chart_slope(const Vector<T, numbers>& x, const Vector<T, tangent>& z) {
    Matrix<T, tangent, tangent> out = kernel::zeros<Matrix<T, tangent, tangent>>();
    each([&]<typename A>(int at, int along) {
      kernel::set_block(
          out, along, along,
          A::chart_slope(detail::piece<A::numbers>(x, at), detail::piece<A::tangent>(z, along)));
    });
    return out;
  }
  /// @}

 private:
  /// use<traits of each>(its first number, its first degree of freedom).
  template <typename Use>
  static void each(const Use& use) {
    int at = 0, along = 0;
    const auto one = [&]<typename A>() {
      use.template operator()<A>(at, along);
      at += A::numbers;
      along += A::tangent;
    };
    (one.template operator()<detail::WholeSpace<Spaces>>(), ...);
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
