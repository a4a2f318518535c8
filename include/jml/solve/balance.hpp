// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Diagonal scaling of a small square matrix, so that its entries say what its eigenvalues and its
/// exponential see, and not the units of the components.
///
/// D⁻¹ H D with the D that makes the sums of row i and column i off the diagonal agree, one i after the other
/// (Osborne 1960; Parlett and Reinsch 1969). D is made of powers of two: nothing is rounded.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/linear_algebra.hpp>

namespace jml::kernel {

/// H becomes D⁻¹ H D; the answer is the diagonal of D. A vector v in the new coordinates is D v in the old.
/// An index whose row or column is zero off the diagonal keeps its scale; so does H that is not finite.
template <typename Scalar, int n>
inline Vector<Scalar, n> balance(Matrix<Scalar, n, n>& H, int sweeps = 6) {
  constexpr int widest = std::numeric_limits<Scalar>::max_exponent / 4;  // no scale may overflow
  Vector<Scalar, n> scale = kernel::filled<Vector<Scalar, n>>(1);
  bool changed = true;
  for (int sweep = 0; sweep < sweeps && changed; ++sweep) {
    changed = false;
    for (int i = 0; i < n; ++i) {
      Scalar row = 0, column = 0;
      for (int j = 0; j < n; ++j) {
        if (j == i) continue;
        row += std::abs(H(i, j));
        column += std::abs(H(j, i));
      }
      const bool near = row <= Scalar(4) * column && column <= Scalar(4) * row;
      if (near || !(row > Scalar(0)) || !(column > Scalar(0)) || !std::isfinite(row + column)) continue;
      const int half = (std::ilogb(row) - std::ilogb(column)) / 2;
      const int exponent = half > widest ? widest : half < -widest ? -widest : half;
      const Scalar up = std::ldexp(Scalar(1), exponent), down = std::ldexp(Scalar(1), -exponent);
      const Scalar next = scale(i) * up;
      if (!std::isfinite(next) || !(next >= std::numeric_limits<Scalar>::min())) continue;
      for (int j = 0; j < n; ++j) H(i, j) *= down;
      for (int j = 0; j < n; ++j) H(j, i) *= up;
      scale(i) = next;
      changed = true;
    }
  }
  return scale;
}

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
