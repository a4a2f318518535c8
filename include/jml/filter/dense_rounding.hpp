// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether a dense matrix can hold a P = U D Uᵀ in twice the digits: not by its condition, which bounds what
/// rounding could make of it, but by what rounding makes of it.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/extended_step.hpp>

namespace jml::detail {

/// The most that rounding P to Scalar changes it in any direction, relative: the Frobenius norm of
/// D^-½ U⁻¹ (P rounded - P) U⁻ᵀ D^-½, and what P may have lost as a matrix in twice the digits already. A
/// zero in D counts for nothing; no number where a D is infinite.
template <int n, typename Scalar>
[[nodiscard]] JML_RARE Scalar dense_rounding(const ExtendedStep<Scalar>& two) {
  using T = Extended<Scalar>;
  T E[n * n];
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) E[i + j * n] = T(in_two<Scalar>(two.P(i, j)).low);
  }
  Scalar sum = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = n - 1; i >= 0; --i) {  // U⁻¹ E
      for (int k = i + 1; k < n; ++k) E[i + j * n] = E[i + j * n] - two.U(i, k) * E[k + j * n];
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = n - 1; j >= 0; --j) {  // U⁻¹ E U⁻ᵀ
      for (int k = j + 1; k < n; ++k) E[i + j * n] = E[i + j * n] - two.U(j, k) * E[i + k * n];
      const Scalar d = in_two<Scalar>(two.D(i)).high, other = in_two<Scalar>(two.D(j)).high;
      const Scalar share = in_two<Scalar>(E[i + j * n]).high / std::sqrt(d) / std::sqrt(other);
      if (d != Scalar(0) && other != Scalar(0)) sum += share * share;
    }
  }
  const Scalar magnification = two.magnification_of_now();
  return std::sqrt(sum) + Scalar(n) * extended_epsilon<Scalar> * magnification * magnification;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
