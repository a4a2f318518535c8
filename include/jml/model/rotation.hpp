// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// SO(3), as a unit quaternion or as a matrix: spaces of attitudes.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/quaternion.hpp>
#include <jml/model/space.hpp>

namespace jml {

/// J_r(z): Exp(z + δ) is Exp(z) Exp(J_r(z) δ) to first order.
template <typename T>
[[nodiscard]] Matrix<T, 3, 3> right_jacobian(const Vector<T, 3>& z) {
  const T square = kernel::squared_norm(z);
  T first, second;  // (1 - cos θ)/θ², (θ - sin θ)/θ³
  if (square < T(1e-2)) {
    first = T(0.5) - square / T(24) * (T(1) - square / T(30) * (T(1) - square / T(56)));
    second = (T(1) - square / T(20) * (T(1) - square / T(42) * (T(1) - square / T(72)))) / T(6);
  } else {
    const T angle = std::sqrt(square), half = std::sin(angle / T(2));
    first = T(2) * half * half / square;
    second = (angle - std::sin(angle)) / (square * angle);
  }
  Matrix<T, 3, 3> out;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    out(i, i) = T(1) - second * (z(j) * z(j) + z(k) * z(k));
    out(i, j) = first * z(k) + second * z(i) * z(j);
    out(i, k) = -first * z(j) + second * z(i) * z(k);
  }
  return out;
}

/// A rotation as a unit quaternion (w, x, y, z); δ in the body's axes, rad.
struct SO3 {
  /// What model/space.hpp asks of a space; contains: of length 1 to half the digits.
  /// @{
  static constexpr int numbers = 4, tangent = 3;
  template <typename T>
  static Vector<T, 4> plus(const Vector<T, 4>& x, const Vector<T, 3>& delta) {
    Vector<T, 4> out = quaternion_product(x, exp_quaternion(delta));
    if constexpr (std::is_floating_point_v<T>) detail::near_unit(out);  // stays of length 1
    return out;
  }
  template <typename T>
  static Vector<T, 3> minus(const Vector<T, 4>& a, const Vector<T, 4>& b) {
    return log_quaternion(quaternion_product(conjugate(b), a));
  }
  template <typename T>
  static bool contains(const Vector<T, 4>& x) {
    return std::abs(kernel::squared_norm(x) - T(1)) <= std::sqrt(std::numeric_limits<T>::epsilon());
  }
  template <typename T>
  static Vector<T, 4> origin() {
    Vector<T, 4> out = kernel::zeros<Vector<T, 4>>();
    out(0) = T(1);
    return out;
  }
  template <typename T>
  static Matrix<T, 3, 3> chart_slope(const Vector<T, 4>&, const Vector<T, 3>& z) {
    return right_jacobian(z);
  }
  /// @}
  /// ½ x (0, e_j) in the column of δ_j.
  template <int m, typename T>
    requires std::is_floating_point_v<T>
  static Vector<Dual<T, m>, 4> seed_at(const Vector<T, 4>& x, int first) {
    Vector<Dual<T, m>, 4> out;
    for (int i = 0; i < 4; ++i) out(i) = x(i);
    for (int j = 0; j < 3; ++j) {
      const int k = (j + 1) % 3, l = (j + 2) % 3;
      if (first + j < 0 || first + j >= m) continue;
      out(0).partial[first + j] = -x(1 + j) / T(2);
      out(1 + j).partial[first + j] = x(0) / T(2);
      out(1 + k).partial[first + j] = x(1 + l) / T(2);
      out(1 + l).partial[first + j] = -x(1 + k) / T(2);
    }
    return out;
  }
  /// At a = b that is twice the vector part of b⁻¹ da.
  template <typename T, int m>
    requires std::is_floating_point_v<T>
  static Matrix<T, 3, m> slope_of_minus(const Vector<Dual<T, m>, 4>& a, const Vector<T, 4>& b) {
    T off = 0;
    for (int i = 0; i < 4; ++i) off = std::max(off, std::abs(plain_value(a(i)) - b(i)));
    Matrix<T, 3, m> out;
    if (off <= T(8) * std::numeric_limits<T>::epsilon()) {
      for (int i = 0; i < 3; ++i) {
        const int k = (i + 1) % 3, l = (i + 2) % 3;
        for (int j = 0; j < m; ++j)
          out(i, j) = T(2) * (b(0) * a(1 + i).partial[j] - b(1 + i) * a(0).partial[j] -
                              b(1 + k) * a(1 + l).partial[j] + b(1 + l) * a(1 + k).partial[j]);
      }
    } else {
      Vector<Dual<T, m>, 4> wide;
      for (int i = 0; i < 4; ++i) wide(i) = b(i);
      const Vector<Dual<T, m>, 3> d = minus(a, wide);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < m; ++j) out(i, j) = d(i).partial[j];
      }
    }
    return out;
  }
};

/// A rotation as the nine numbers of its matrix, column by column.
struct SO3Matrix {
  /// What model/space.hpp asks of a space; contains: orthogonal to half the digits, and no reflection.
  /// @{
  static constexpr int numbers = 9, tangent = 3;
  template <typename T>
  static Vector<T, 9> plus(const Vector<T, 9>& x, const Vector<T, 3>& delta) {
    const Vector<T, 4> q = exp_quaternion(delta);
    Vector<T, 9> out;
    for (int j = 0; j < 3; ++j) {  // row by row: (R Exp(δ))ᵀ = Exp(-δ) Rᵀ
      const Vector<T, 3> row = rotate_back(q, Vector<T, 3>(x(j), x(3 + j), x(6 + j)));
      for (int i = 0; i < 3; ++i) out(3 * i + j) = row(i);
    }
    if constexpr (std::is_floating_point_v<T>) {  // stays orthogonal: R (3 I - Rᵀ R) / 2
      Matrix<T, 3, 3> R;
      for (int i = 0; i < 9; ++i) R.data()[i] = out(i);
      const Matrix<T, 3, 3> I = kernel::identity<Matrix<T, 3, 3>>(), off = kernel::transposed(R) * R - I;
      const Matrix<T, 3, 3> near = R * (I - T(0.5) * off);
      for (int i = 0; i < 9 && kernel::largest(off) < T(0.25); ++i) out(i) = near.data()[i];
    }
    return out;
  }
  template <typename T>
  static Vector<T, 3> minus(const Vector<T, 9>& a, const Vector<T, 9>& b) {
    const auto entry = [&](int i, int j) {  // of bᵀ a
      return b(3 * i) * a(3 * j) + b(3 * i + 1) * a(3 * j + 1) + b(3 * i + 2) * a(3 * j + 2);
    };
    const T d[3] = {entry(0, 0), entry(1, 1), entry(2, 2)};
    // The largest of the four numbers of the quaternion first, and the others by it (Shepperd).
    using std::sqrt;
    using Plain = decltype(plain_value(a(0)));
    constexpr Plain one(1), two(2), four(4);
    int most = -1;
    T largest = d[0] + d[1] + d[2];
    for (int i = 0; i < 3; ++i) {
      if (plain_value(d[i]) > plain_value(largest)) largest = d[most = i];
    }
    Vector<T, 4> q;
    if (most < 0) {
      q(0) = sqrt(largest + one) / two;
      for (int i = 0; i < 3; ++i)
        q(i + 1) = (entry((i + 2) % 3, (i + 1) % 3) - entry((i + 1) % 3, (i + 2) % 3)) / (four * q(0));
    } else {
      const int i = most, j = (i + 1) % 3, k = (i + 2) % 3;
      q(i + 1) = sqrt(d[i] - d[j] - d[k] + one) / two;
      q(0) = (entry(k, j) - entry(j, k)) / (four * q(i + 1));
      q(j + 1) = (entry(i, j) + entry(j, i)) / (four * q(i + 1));
      q(k + 1) = (entry(i, k) + entry(k, i)) / (four * q(i + 1));
    }
    return log_quaternion(q);
  }
  template <typename T>
  static bool contains(const Vector<T, 9>& x) {
    Matrix<T, 3, 3> R;
    for (int i = 0; i < 9; ++i) R.data()[i] = x(i);
    const Matrix<T, 3, 3> off = kernel::transposed(R) * R - kernel::identity<Matrix<T, 3, 3>>();
    const T turn = R(0, 0) * (R(1, 1) * R(2, 2) - R(1, 2) * R(2, 1)) -
                   R(0, 1) * (R(1, 0) * R(2, 2) - R(1, 2) * R(2, 0)) +
                   R(0, 2) * (R(1, 0) * R(2, 1) - R(1, 1) * R(2, 0));
    return kernel::largest(off) <= std::sqrt(std::numeric_limits<T>::epsilon()) && turn > T(0);
  }
  template <typename T>
  static Vector<T, 9> origin() {
    Vector<T, 9> out = kernel::zeros<Vector<T, 9>>();
    out(0) = out(4) = out(8) = T(1);
    return out;
  }
  template <typename T>
  static Matrix<T, 3, 3> chart_slope(const Vector<T, 9>&, const Vector<T, 3>& z) {
    return right_jacobian(z);
  }
  /// @}
};

}  // namespace jml
#include <jml/warnings_end.hpp>
