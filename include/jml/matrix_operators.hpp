// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sums and products of fixed-size matrices as values.
///
/// Inside the library a + b of two matrices of one fixed size is a matrix, made by a loop, and not an Eigen
/// expression: each new type of expression costs the compiler as much as a page of plain code, and a filter
/// met a hundred of them. A user's own code, outside namespace jml, keeps Eigen's operators.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/matrix.hpp>
#include <jml/written_out.hpp>
#include <type_traits>

namespace jml {

namespace kernel {

/// A size that is known at compile time.
template <int rows, int cols>
inline constexpr bool fixed = rows != Eigen::Dynamic && cols != Eigen::Dynamic;

/// A number that may scale a matrix of `Scalar`: no expression that could turn into one.
template <typename Number, typename Scalar>
concept NumberFor = std::is_same_v<Number, Scalar> || std::is_arithmetic_v<Number>;

}  // namespace kernel

/// Sums and products as values, for two matrices of one fixed type; a mixture with an Eigen expression stays
/// Eigen's. Not found by argument-dependent lookup: a model's own code keeps Eigen's operators, with dual
/// numbers too. `using namespace jml::operators;` brings them into a file of one's own: less to compile.
namespace operators {

/// As Eigen's, as values.
/// @{
template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator+(
    const Eigen::Matrix<Scalar, rows, cols, options>& a,
    const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] + b.data()[i])
  return out;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator-(
    const Eigen::Matrix<Scalar, rows, cols, options>& a,
    const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] - b.data()[i])
  return out;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator-(
    const Eigen::Matrix<Scalar, rows, cols, options>& a) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = -a.data()[i])
  return out;
}

template <typename Scalar, int rows, int cols, int options, kernel::NumberFor<Scalar> Number>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator*(
    const Number& factor, const Eigen::Matrix<Scalar, rows, cols, options>& a) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = Scalar(factor) * a.data()[i])
  return out;
}

template <typename Scalar, int rows, int cols, int options, kernel::NumberFor<Scalar> Number>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator*(
    const Eigen::Matrix<Scalar, rows, cols, options>& a, const Number& factor) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] * Scalar(factor))
  return out;
}

template <typename Scalar, int rows, int cols, int options, kernel::NumberFor<Scalar> Number>
  requires kernel::fixed<rows, cols>
[[nodiscard]] JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options> operator/(
    const Eigen::Matrix<Scalar, rows, cols, options>& a, const Number& divisor) {
  Eigen::Matrix<Scalar, rows, cols, options> out;
  JML_EACH(i, rows * cols, out.data()[i] = a.data()[i] / Scalar(divisor))
  return out;
}

template <typename Scalar, int rows, int inner, int cols, int left, int right>
  requires(kernel::fixed<rows, cols> && inner != Eigen::Dynamic)
[[nodiscard]] JML_INLINE inline Matrix<Scalar, rows, cols> operator*(
    const Eigen::Matrix<Scalar, rows, inner, left>& a, const Eigen::Matrix<Scalar, inner, cols, right>& b) {
  Matrix<Scalar, rows, cols> out;
  if constexpr (rows * inner * cols <= 27) {
    JML_WRITTEN_OUT for (int j = 0; j < cols; ++j) {
      JML_WRITTEN_OUT for (int i = 0; i < rows; ++i) {
        Scalar sum(0);
        JML_WRITTEN_OUT for (int k = 0; k < inner; ++k) sum += a(i, k) * b(k, j);
        out(i, j) = sum;
      }
    }
  } else {
    for (int j = 0; j < cols; ++j) {
      Scalar column[rows] = {};  // of the product: in registers, whatever `out` may share its memory with
      for (int k = 0; k < inner; ++k) {
        const Scalar factor = b(k, j);
        for (int i = 0; i < rows; ++i) column[i] += a(i, k) * factor;
      }
      for (int i = 0; i < rows; ++i) out(i, j) = column[i];
    }
  }
  return out;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options>& operator+=(
    Eigen::Matrix<Scalar, rows, cols, options>& a, const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  JML_EACH(i, rows * cols, a.data()[i] += b.data()[i])
  return a;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options>& operator-=(
    Eigen::Matrix<Scalar, rows, cols, options>& a, const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  JML_EACH(i, rows * cols, a.data()[i] -= b.data()[i])
  return a;
}

template <typename Scalar, int rows, int cols, int options, kernel::NumberFor<Scalar> Number>
  requires kernel::fixed<rows, cols>
JML_INLINE inline Eigen::Matrix<Scalar, rows, cols, options>& operator*=(
    Eigen::Matrix<Scalar, rows, cols, options>& a, const Number& factor) {
  JML_EACH(i, rows * cols, a.data()[i] *= Scalar(factor))
  return a;
}

template <typename Scalar, int rows, int cols, int options>
  requires kernel::fixed<rows, cols>
[[nodiscard]] inline bool operator==(const Eigen::Matrix<Scalar, rows, cols, options>& a,
                                     const Eigen::Matrix<Scalar, rows, cols, options>& b) {
  for (int i = 0; i < rows * cols; ++i) {
    if (!(a.data()[i] == b.data()[i])) return false;
  }
  return true;
}
/// @}

}  // namespace operators

using namespace operators;

}  // namespace jml
#include <jml/warnings_end.hpp>
