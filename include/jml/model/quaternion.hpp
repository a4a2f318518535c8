// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Unit quaternions (w, x, y, z), Hamilton's product, in any scalar: what a model with an attitude is written
/// with.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>
#include <jml/model/dual_functions.hpp>

namespace jml {

/// A product of quaternions, (w, x, y, z).
template <typename T>
[[nodiscard]] Vector<T, 4> quaternion_product(const Vector<T, 4>& a, const Vector<T, 4>& b) {
  Vector<T, 4> out;
  out(0) = a(0) * b(0) - a(1) * b(1) - a(2) * b(2) - a(3) * b(3);
  out(1) = a(0) * b(1) + a(1) * b(0) + a(2) * b(3) - a(3) * b(2);
  out(2) = a(0) * b(2) - a(1) * b(3) + a(2) * b(0) + a(3) * b(1);
  out(3) = a(0) * b(3) + a(1) * b(2) - a(2) * b(1) + a(3) * b(0);
  return out;
}
/// q⁻¹ of a unit quaternion.
template <typename T>
[[nodiscard]] Vector<T, 4> conjugate(const Vector<T, 4>& q) {
  Vector<T, 4> out;
  out(0) = q(0);
  for (int i = 1; i < 4; ++i) out(i) = -q(i);
  return out;
}
/// The unit quaternion of a rotation vector, rad.
template <typename T>
[[nodiscard]] Vector<T, 4> exp_quaternion(const Vector<T, 3>& delta) {
  using std::cos, std::sin, std::sqrt;
  const T square = delta(0) * delta(0) + delta(1) * delta(1) + delta(2) * delta(2);
  using Plain = decltype(plain_value(square));
  T half_sinc, cosine;  // sin(θ/2)/θ and cos(θ/2); near zero by their series, which has derivatives there
  if (plain_value(square) < Plain(1e-2)) {
    const T s = square / Plain(4);
    cosine =
        Plain(1) -
        s / Plain(2) * (Plain(1) - s / Plain(12) * (Plain(1) - s / Plain(30) * (Plain(1) - s / Plain(56))));
    half_sinc = (Plain(1) -
                 s / Plain(6) *
                     (Plain(1) - s / Plain(20) * (Plain(1) - s / Plain(42) * (Plain(1) - s / Plain(72))))) /
                Plain(2);
  } else {
    const T angle = sqrt(square);
    cosine = cos(angle / Plain(2));
    half_sinc = sin(angle / Plain(2)) / angle;
  }
  Vector<T, 4> out;
  out(0) = cosine;
  for (int i = 0; i < 3; ++i) out(i + 1) = half_sinc * delta(i);
  return out;
}
/// The shortest rotation vector of a unit quaternion, rad, |δ| ≤ π.
template <typename T>
[[nodiscard]] Vector<T, 3> log_quaternion(const Vector<T, 4>& q) {
  using std::atan2, std::sqrt;
  using Plain = decltype(plain_value(q(0)));
  const bool far = plain_value(q(0)) < Plain(0);  // -q is the same rotation
  const T w = far ? -q(0) : q(0);
  const T square = q(1) * q(1) + q(2) * q(2) + q(3) * q(3);
  T factor;  // θ / |v|
  if (plain_value(square) < Plain(1e-3) * plain_value(w) * plain_value(w)) {
    const T t = square / (w * w);
    T sum = T(Plain(1) / Plain(13));
    for (int k = 11; k > 0; k -= 2) sum = Plain(1) / Plain(k) - t * sum;
    factor = Plain(2) * sum / w;
  } else {
    const T size = sqrt(square);
    factor = Plain(2) * atan2(size, w) / size;
  }
  Vector<T, 3> out;
  for (int i = 0; i < 3; ++i) out(i) = far ? -(factor * q(i + 1)) : factor * q(i + 1);
  return out;
}
/// R(q) v: a vector in the body's axes as seen in those that q refers to.
template <typename T>
[[nodiscard]] Vector<T, 3> rotate(const Vector<T, 4>& q, const Vector<T, 3>& v) {
  const auto twice_cross = [&](const Vector<T, 3>& a) {
    Vector<T, 3> out;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      out(i) = q(j + 1) * a(k) - q(k + 1) * a(j);
    }
    return out;
  };
  Vector<T, 3> t = twice_cross(v), out;
  for (int i = 0; i < 3; ++i) t(i) = t(i) + t(i);
  const Vector<T, 3> u = twice_cross(t);
  for (int i = 0; i < 3; ++i) out(i) = v(i) + q(0) * t(i) + u(i);
  return out;
}
/// R(q)ᵀ v: the other way round.
template <typename T>
[[nodiscard]] Vector<T, 3> rotate_back(const Vector<T, 4>& q, const Vector<T, 3>& v) {
  return rotate(conjugate(q), v);
}

}  // namespace jml
#include <jml/warnings_end.hpp>
