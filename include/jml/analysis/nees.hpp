// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The normalised estimation error squared.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>

namespace jml {

/// eᵀ sym(P)⁻¹ e, the normalised estimation error squared: n degrees of freedom. NaN where sym(P) is not
/// positive definite, which the P of a nonsymmetric rule need not be. Blocks and differences of Eigen will
/// do: nees(truth - filter.x(), filter.P()).
template <typename Error, typename Covariance>
[[nodiscard]] typename Error::Scalar nees(const Eigen::MatrixBase<Error>& error,
                                          const Eigen::MatrixBase<Covariance>& P) {
  using Scalar = typename Error::Scalar;
  constexpr int n = Error::RowsAtCompileTime;
  static_assert(n > 0 && Error::ColsAtCompileTime == 1, "jml: the error is a vector of fixed size");
  static_assert(Covariance::RowsAtCompileTime == n && Covariance::ColsAtCompileTime == n,
                "jml: P has another size than the error");
  const Matrix<Scalar, n, n> given = P;
  const Matrix<Scalar, n, n> symmetric_part = kernel::symmetric_part(given);
  kernel::SymmetricFactor<Scalar, n> factor;
  if (!factor.factor(symmetric_part)) return std::numeric_limits<Scalar>::quiet_NaN();
  return factor.squared_norm(Vector<Scalar, n>(error));
}

}  // namespace jml
#include <jml/warnings_end.hpp>
