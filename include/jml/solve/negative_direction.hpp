// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Along which direction a quadratic form is negative, if it is along any.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/kernels.hpp>
#include <jml/matrix.hpp>

namespace jml::detail {

/// A unit d with dᵀ A d < 0 of a symmetric A, or false where there is none to `rounding`, what that may have
/// made of each diagonal entry. By A = L D Lᵀ with the largest pivots first.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE bool negative_direction(Matrix<Scalar, n, n> A, const Vector<Scalar, n>& rounding,
                                                   Vector<Scalar, n>& d) {
  Matrix<Scalar, n, n> L = kernel::zeros<Matrix<Scalar, n, n>>();  // column of each pivot, by its index
  int order[n], pivots = 0;
  bool done[n] = {};
  kernel::set_zero(d);
  for (; pivots < n; ++pivots) {
    int best = -1;
    for (int i = 0; i < n; ++i) {
      if (!done[i] && A(i, i) > rounding(i) && (best < 0 || A(i, i) > A(best, best))) best = i;
    }
    if (best < 0) break;
    done[best] = true;
    order[pivots] = best;
    for (int i = 0; i < n; ++i) {
      if (!done[i]) L(i, best) = A(i, best) / A(best, best);
    }
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        if (!done[i] && !done[j]) A(i, j) -= L(i, best) * A(j, best);
      }
    }
  }
  bool found = false;
  for (int i = 0; i < n && !found; ++i) {
    if (done[i]) continue;
    found = A(i, i) < -rounding(i);
    d(i) = Scalar(1);
    for (int j = 0; j < i && !found; ++j) {  // two that are nothing alone
      found = !done[j] && std::abs(A(i, j)) > rounding(i) + rounding(j);
      if (found) d(j) = A(i, j) > Scalar(0) ? Scalar(-1) : Scalar(1);
    }
    if (!found) d(i) = Scalar(0);
  }
  if (!found) return false;
  for (int k = pivots - 1; k >= 0; --k) {  // L⁻ᵀ
    const int j = order[k];
    for (int i = 0; i < n; ++i) {
      if (i != j) d(j) -= L(i, j) * d(i);
    }
  }
  const Scalar length = std::sqrt(kernel::dot(d, d));
  for (int i = 0; i < n; ++i) d(i) /= length;
  return true;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
