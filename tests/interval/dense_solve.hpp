// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Dense linear algebra of the tests' oracles, in plain loops: Eigen's own solvers of dynamic size take more
/// time to compile than the tests they would serve.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace batch_tests {

template <typename T>
using Dense = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;

/// Lower triangular L with L Lᵀ = a; the column of a pivot that is zero to rounding is zero.
template <typename T>
Dense<T> lower_root(const Dense<T>& a) {
  const auto size = a.rows();
  Dense<T> L = Dense<T>::Zero(size, size);
  for (Eigen::Index j = 0; j < size; ++j) {
    T pivot = a(j, j);
    for (Eigen::Index k = 0; k < j; ++k) pivot -= L(j, k) * L(j, k);
    if (!(pivot > T(1e-14) * a(j, j))) continue;
    L(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < size; ++i) {
      T sum = a(i, j);
      for (Eigen::Index k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = sum / L(j, j);
    }
  }
  return L;
}

/// X with L X = b, for columns of b in the range of L; zero where a pivot is.
template <typename T>
Dense<T> forward_solve(const Dense<T>& L, Dense<T> b) {
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    for (Eigen::Index i = 0; i < L.rows(); ++i) {
      for (Eigen::Index k = 0; k < i; ++k) b(i, j) -= L(i, k) * b(k, j);
      b(i, j) = L(i, i) > T(0) ? b(i, j) / L(i, i) : T(0);
    }
  }
  return b;
}

/// a b.
template <typename T>
Dense<T> times(const Dense<T>& a, const Dense<T>& b) {
  return a.lazyProduct(b);
}
/// aᵀ b.
template <typename T>
Dense<T> transposed_times(const Dense<T>& a, const Dense<T>& b) {
  return a.transpose().lazyProduct(b);
}

}  // namespace batch_tests
