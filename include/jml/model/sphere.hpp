// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// S²: the space of directions.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/quaternion.hpp>
#include <jml/model/space.hpp>

namespace jml {

/// A direction: a unit vector. δ: along two axes normal to it, of which only that they are two is promised.
struct S2 {
  /// What model/space.hpp asks of a space; contains: of length 1 to half the digits.
  /// @{
  static constexpr int numbers = 3, tangent = 2;
  template <typename T>
  static Vector<T, 3> plus(const Vector<T, 3>& x, const Vector<T, 2>& delta) {
    Vector<T, 3> turn;
    turn(0) = delta(0);
    turn(1) = delta(1);
    turn(2) = T(0);
    // The point that δ leads to from the pole, and what takes the pole to x.
    const Vector<T, 4> q = exp_quaternion(turn);
    Vector<T, 3> pole = kernel::zeros<Vector<T, 3>>();
    pole(2) = T(1);
    Vector<T, 3> out = reflected(x, rotate(q, pole));
    if constexpr (std::is_floating_point_v<T>) detail::near_unit(out);
    return out;
  }
  template <typename T>
  static Vector<T, 2> minus(const Vector<T, 3>& a, const Vector<T, 3>& b) {
    using Plain = decltype(plain_value(a(0)));
    const Vector<T, 3> there = reflected(b, a);  // seen with b at the pole
    // The quaternion from the pole: (1 + z, -y, x, 0), not of length 1.
    using std::atan2, std::sqrt;
    const T square = there(0) * there(0) + there(1) * there(1);
    T factor;
    if (plain_value(square) < Plain(1e-4) && plain_value(there(2)) > Plain(0)) {
      const T t = square / (there(2) * there(2));  // tan²θ
      T sum = T(Plain(1) / Plain(13));
      for (int k = 11; k > 0; k -= 2) sum = Plain(1) / Plain(k) - t * sum;
      factor = sum / there(2);
    } else if (plain_value(square) == Plain(0)) {  // the antipode: every way leads there
      Vector<T, 2> out;
      out(0) = T(Plain(3.14159265358979323846L));
      out(1) = T(0);
      return out;
    } else {
      const T size = sqrt(square);
      factor = atan2(size, there(2)) / size;
    }
    Vector<T, 2> out;
    out(0) = -(factor * there(1));
    out(1) = factor * there(0);
    return out;
  }
  template <typename T>
  static bool contains(const Vector<T, 3>& x) {
    return std::abs(kernel::squared_norm(x) - T(1)) <= std::sqrt(std::numeric_limits<T>::epsilon());
  }
  template <typename T>
  static Vector<T, 3> origin() {
    Vector<T, 3> out = kernel::zeros<Vector<T, 3>>();
    out(2) = T(1);
    return out;
  }
  /// @}

 private:
  /// v in the reflection that exchanges the pole (0, 0, 1), or where x is nearer to it the other one, with x:
  /// its own inverse.
  template <typename T>
  static Vector<T, 3> reflected(const Vector<T, 3>& x, const Vector<T, 3>& v) {
    using Plain = decltype(plain_value(x(2)));
    const bool near = plain_value(x(2)) > Plain(0);
    Vector<T, 3> h = x, out;
    const T sign = T(near ? -1 : 1);
    // near: v → -(I - 2 h hᵀ/hᵀh) with h = x + pole, which takes the pole to x; else h = x - pole.
    h(2) = near ? x(2) + Plain(1) : x(2) - Plain(1);
    const T along =
        Plain(2) * (h(0) * v(0) + h(1) * v(1) + h(2) * v(2)) / (h(0) * h(0) + h(1) * h(1) + h(2) * h(2));
    for (int i = 0; i < 3; ++i) out(i) = sign * (v(i) - along * h(i));
    return out;
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
