// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The few questions the estimators ask of fixed-size matrices: finite, symmetric, definite, a covariance.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/matrix_operators.hpp>
#include <limits>
#include <utility>

namespace jml {

/// Definiteness asked of a symmetric matrix.
enum class Definite { positive, positive_or_zero };

/// True if every entry is finite. 0·v is zero exactly where v is finite: four sums and no branch.
template <typename Scalar, int rows, int cols, int options>
[[nodiscard]] JML_INLINE inline bool all_finite(const Eigen::Matrix<Scalar, rows, cols, options>& a) {
  constexpr int size = rows * cols, fours = size / 4;
  const Scalar* v = a.data();
  Scalar sum[4] = {};
  kernel::repeat<fours, 2>([&](int i) JML_INLINE {
    sum[0] += Scalar(0) * v[4 * i];
    sum[1] += Scalar(0) * v[4 * i + 1];
    sum[2] += Scalar(0) * v[4 * i + 2];
    sum[3] += Scalar(0) * v[4 * i + 3];
  });
  kernel::repeat<size - 4 * fours>([&](int i) JML_INLINE { sum[i] += Scalar(0) * v[4 * fours + i]; });
  return (sum[0] + sum[1]) + (sum[2] + sum[3]) == Scalar(0);
}

/// True if a(i,j) and a(j,i) agree to rounding, relative to the diagonal's scale of that entry.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool is_symmetric(const Matrix<Scalar, n, n>& a) {
  constexpr Scalar slack = Scalar(64) * std::numeric_limits<Scalar>::epsilon();
  for (int j = 0; j < n; ++j) {
    for (int i = j + 1; i < n; ++i) {
      const Scalar scale =
          std::abs(a(i, j)) + std::abs(a(j, i)) + std::sqrt(std::abs(a(i, i))) * std::sqrt(std::abs(a(j, j)));
      if (!(std::abs(a(i, j) - a(j, i)) <= slack * scale)) return false;
    }
  }
  return true;
}

/// True if every entry on the diagonal is positive (or zero, if that is asked).
template <Definite wanted, typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool diagonal_is(const Matrix<Scalar, n, n>& a) {
  bool positive = true;
  for (int i = 0; i < n; ++i)
    positive &= wanted == Definite::positive ? a(i, i) > Scalar(0) : a(i, i) >= Scalar(0);
  return positive;
}

/// True if every entry off the diagonal is zero.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool is_diagonal(const Matrix<Scalar, n, n>& a) {
  bool zero = true;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) zero &= i == j || a(i, j) == Scalar(0);
  }
  return zero;
}

/// True if the symmetric matrix `a`, of which the lower triangle is read, is positive definite.
///
/// LDLᵀ without pivoting or roots. A pivot counts as zero when it is below the rounding of the diagonal
/// entry that it came from, so the answer does not depend on the units of the components.
template <Definite wanted, typename Scalar, int n>
  requires(wanted == Definite::positive)
[[nodiscard]] bool is_definite(const Matrix<Scalar, n, n>& a) {
  constexpr Scalar slack = Scalar(8 * (n > 0 ? n : 1)) * std::numeric_limits<Scalar>::epsilon();
  Matrix<Scalar, n, n> w = a;
  for (int k = 0; k < n; ++k) {
    const Scalar pivot = w(k, k);
    const Scalar zero = slack * std::abs(a(k, k));
    if (!(pivot > zero)) return false;
    if (k + 1 == n) break;
    const Scalar inverse = Scalar(1) / pivot;
    for (int j = k + 1; j < n; ++j) {
      const Scalar factor = w(j, k) * inverse;
      for (int i = j; i < n; ++i) w(i, j) -= w(i, k) * factor;
    }
  }
  return true;
}

/// True if the symmetric matrix `a`, of which the lower triangle is read, is positive semidefinite to
/// rounding, of whatever rank.
///
/// LDLᵀ of the correlation matrix (unit diagonal, so that units do not matter), the largest remaining
/// diagonal entry first. Where none rises above 256 ε, every entry that is left must be within 512 ε of zero:
/// then no eigenvalue of the correlation matrix is below -512 n ε.
template <Definite wanted, typename Scalar, int n>
  requires(wanted == Definite::positive_or_zero)
[[nodiscard]] bool is_definite(const Matrix<Scalar, n, n>& a) {
  constexpr Scalar slack = Scalar(256) * std::numeric_limits<Scalar>::epsilon();
  Matrix<Scalar, n, n> w;
  Vector<Scalar, n> unit;
  for (int j = 0; j < n; ++j) {
    // Without a variance, whatever is not zero in that row becomes infinite, and is refused.
    unit(j) = a(j, j) > Scalar(0) ? Scalar(1) / std::sqrt(a(j, j)) : std::numeric_limits<Scalar>::infinity();
    for (int i = 0; i <= j; ++i) w(j, i) = a(j, i) == Scalar(0) ? Scalar(0) : a(j, i) * unit(j) * unit(i);
  }
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i) best = w(i, i) > w(best, best) ? i : best;
    if (!(w(best, best) > slack)) {
      for (int j = k; j < n; ++j) {
        for (int i = j; i < n; ++i) {
          if (!(std::abs(w(i, j)) <= Scalar(2) * slack)) return false;
        }
      }
      return true;
    }
    if (best != k) {
      std::swap(w(k, k), w(best, best));
      for (int i = k + 1; i < n; ++i) {
        if (i != best) std::swap(w(i, k), i < best ? w(best, i) : w(i, best));
      }
    }
    const Scalar inverse = Scalar(1) / w(k, k);
    for (int j = k + 1; j < n; ++j) {
      const Scalar factor = w(j, k) * inverse;
      for (int i = j; i < n; ++i) w(i, j) -= w(i, k) * factor;
    }
  }
  return true;
}

/// Q is finite, symmetric, positive semidefinite.
template <typename Scalar, int q>
[[nodiscard]] bool is_covariance(const Matrix<Scalar, q, q>& Q) {
  if (is_diagonal(Q)) return diagonal_is<Definite::positive_or_zero>(Q) && all_finite(Q);
  return all_finite(Q) && is_symmetric(Q) && is_definite<Definite::positive_or_zero>(Q);
}

/// R is finite, symmetric, positive definite.
template <typename Scalar, int p>
[[nodiscard]] JML_INLINE inline bool is_noise_covariance(const Matrix<Scalar, p, p>& R) {
  if (is_diagonal(R)) return diagonal_is<Definite::positive>(R) && all_finite(R);
  return all_finite(R) && is_symmetric(R) && is_definite<Definite::positive>(R);
}

}  // namespace jml
#include <jml/warnings_end.hpp>
