// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Fixed-size vectors and matrices (Eigen's), and the few questions the estimators ask of them.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <type_traits>

namespace jml {

template <typename Scalar, int rows, int cols>
using Matrix = Eigen::Matrix<Scalar, rows, cols>;

template <typename Scalar, int rows>
using Vector = Eigen::Matrix<Scalar, rows, 1>;

/// True if every entry is finite. 0·v is zero exactly where v is finite: four sums and no branch.
template <typename Scalar, int rows, int cols, int options>
[[nodiscard, gnu::always_inline]] inline bool all_finite(const Eigen::Matrix<Scalar, rows, cols, options>& a) {
  constexpr int size = rows * cols, whole = size / 4 * 4;
  const Scalar* v = a.data();
  Scalar sum[4] = {};
  for (int i = 0; i < whole; i += 4) {
    sum[0] += Scalar(0) * v[i];
    sum[1] += Scalar(0) * v[i + 1];
    sum[2] += Scalar(0) * v[i + 2];
    sum[3] += Scalar(0) * v[i + 3];
  }
  for (int i = whole; i < size; ++i) sum[0] += Scalar(0) * v[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]) == Scalar(0);
}

/// True if a(i,j) and a(j,i) agree to rounding, relative to the diagonal's scale of that entry.
template <typename Scalar, int n>
[[nodiscard]] bool is_symmetric(const Matrix<Scalar, n, n>& a) {
  constexpr Scalar slack = Scalar(64) * std::numeric_limits<Scalar>::epsilon();
  for (int j = 0; j < n; ++j) {
    for (int i = j + 1; i < n; ++i) {
      const Scalar scale = std::abs(a(i, j)) + std::abs(a(j, i)) + std::sqrt(std::abs(a(i, i) * a(j, j)));
      if (!(std::abs(a(i, j) - a(j, i)) <= slack * scale)) return false;
    }
  }
  return true;
}

/// True if every entry off the diagonal is zero.
template <typename Scalar, int n>
[[nodiscard, gnu::always_inline]] inline bool is_diagonal(const Matrix<Scalar, n, n>& a) {
  bool zero = true;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) zero &= i == j || a(i, j) == Scalar(0);
  }
  return zero;
}

/// Definiteness asked of a symmetric matrix.
enum class Definite { positive, positive_or_zero };

/// True if the symmetric part of `a` is positive (semi)definite.
///
/// LDLᵀ without pivoting or roots. A pivot counts as zero when it is below the rounding of the diagonal
/// entry that it came from, so the answer does not depend on the units of the components. In the
/// semidefinite case the rest of a zero pivot's column must vanish to rounding too.
template <Definite wanted, typename Scalar, int n>
[[nodiscard]] bool is_definite(const Matrix<Scalar, n, n>& a) {
  constexpr Scalar slack = Scalar(8 * (n > 0 ? n : 1)) * std::numeric_limits<Scalar>::epsilon();
  Matrix<Scalar, n, n> w = a;
  for (int k = 0; k < n; ++k) {
    const Scalar pivot = w(k, k);
    const Scalar zero = slack * std::abs(a(k, k));
    if constexpr (wanted == Definite::positive) {
      if (!(pivot > zero)) return false;
    } else {
      if (!(pivot >= -zero)) return false;
      if (!(pivot > zero)) {
        for (int i = k + 1; i < n; ++i) {
          const Scalar bound = std::sqrt(slack * std::abs(a(k, k)) * std::abs(a(i, i)));
          if (!(std::abs(w(i, k)) <= bound)) return false;
        }
        continue;
      }
    }
    if (k + 1 == n) break;
    const Scalar inverse = Scalar(1) / pivot;
    for (int j = k + 1; j < n; ++j) {
      const Scalar factor = w(j, k) * inverse;
      for (int i = j; i < n; ++i) w(i, j) -= w(i, k) * factor;
    }
  }
  return true;
}

}  // namespace jml
