// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Gauss-Jordan elimination of compile-time size, real or complex: solve, invert, determinant, null space.
///
/// Half more operations than LU for the matrix itself, none for right-hand sides, and each is a whole column
/// long, a length the compiler knows. For matrices that are well conditioned where all is well; the users of
/// the answer check it by a residual.
#include <jml/warnings_begin.hpp>
#pragma once

#include <Eigen/Core>
#include <complex>
#include <jml/kernels.hpp>
#include <utility>

namespace jml::kernel {

/// to -= from · factor, n numbers: in packets where the scalar has them.
template <typename T, int n>
JML_INLINE inline void subtract_multiple(const Vector<T, n>& from, const T& factor, T* to) {
  if constexpr (std::is_arithmetic_v<T>) {
    column<n, 1, 0, -1, false>(to, to, from.data(), [factor](int) { return factor; });
  } else {
    for (int i = 0; i < n; ++i) to[i] -= from(i) * factor;
  }
}

/// Each `right` becomes M⁻¹ right; M is used up. Exchanges rows for the largest pivot. The answer is the
/// smallest pivot relative to the largest entry of M: near rounding, M is singular; 0 where M is not finite.
template <typename T, int n, int... cols>
JML_NOINLINE typename Eigen::NumTraits<T>::Real eliminate(Matrix<T, n, n>& M, Matrix<T, n, cols>&... right) {
  using Real = typename Eigen::NumTraits<T>::Real;
  using std::abs;
  const Real most = largest(M);
  Real smallest = most;
  for (int k = 0; k < n; ++k) {
    int best = k;
    Real size = abs(M(k, k));
    for (int i = k + 1; i < n; ++i) {
      if (const Real other = abs(M(i, k)); other > size) {
        best = i;
        size = other;
      }
    }
    if (!(size > Real(0)) || !(size <= std::numeric_limits<Real>::max())) return Real(0);
    if (size < smallest) smallest = size;
    if (best != k) {
      swap_rows(M, k, best);
      (swap_rows(right, k, best), ...);
    }
    const Vector<T, n> column = column_of(M, k);
    const T inverse = T(1) / column(k);
    const auto clear = [&](auto& m, int first, int count) {
      for (int j = first; j < count; ++j) {
        const T factor = m(k, j) * inverse;
        subtract_multiple(column, factor, m.data() + j * n);
        m(k, j) = factor;
      }
    };
    clear(M, k + 1, n);
    (clear(right, 0, cols), ...);
  }
  return smallest / most;
}

/// The geometric mean of the moduli of M's eigenvalues, |det M|^(1/n), each pivot taken as at least `least`.
template <typename Scalar, int n>
JML_NOINLINE Scalar mean_modulus(Matrix<Scalar, n, n> M, Scalar least) {
  Scalar log_sum = 0;
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(M(i, k)) > std::abs(M(best, k))) best = i;
    }
    if (best != k) swap_rows(M, k, best);
    const Scalar size = std::abs(M(k, k));
    log_sum += std::log(size > least ? size : least);
    if (!(size > Scalar(0))) continue;
    for (int j = k + 1; j < n; ++j) {
      const Scalar factor = M(k, j) / M(k, k);
      for (int i = k + 1; i < n; ++i) M(i, j) -= M(i, k) * factor;
    }
  }
  return std::exp(log_sum / Scalar(n));
}

/// A basis of the null space of M, not orthogonal, in the first columns of `basis`; the answer is its
/// dimension: how many pivots of a complete exchange are below `slack` times the largest entry.
template <typename T, int n>
JML_NOINLINE int null_space(Matrix<T, n, n> M, typename Eigen::NumTraits<T>::Real slack,
                            Matrix<T, n, n>& basis) {
  using Real = typename Eigen::NumTraits<T>::Real;
  using std::abs;
  int order[n];
  for (int j = 0; j < n; ++j) order[j] = j;
  const Real floor = slack * largest(M);
  int rank = 0;
  for (; rank < n; ++rank) {
    const int k = rank;
    int row = k, col = k;
    for (int j = k; j < n; ++j) {
      for (int i = k; i < n; ++i) {
        if (abs(M(i, j)) > abs(M(row, col))) {
          row = i;
          col = j;
        }
      }
    }
    if (!(abs(M(row, col)) > floor)) break;
    swap_rows(M, k, row);
    swap_columns(M, k, col);
    std::swap(order[k], order[col]);
    const Vector<T, n> column = column_of(M, k);
    for (int j = k + 1; j < n; ++j) {
      const T factor = M(k, j) / column(k);
      for (int i = 0; i < n; ++i) M(i, j) -= column(i) * factor;
      M(k, j) = factor;
    }
  }
  kernel::set_zero(basis);
  for (int j = rank; j < n; ++j) {
    for (int i = 0; i < rank; ++i) basis(order[i], j - rank) = -M(i, j);
    basis(order[j], j - rank) = T(1);
  }
  return n - rank;
}

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
