// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Jacobians of a model's own code by dual numbers.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/linear_algebra.hpp>
#include <jml/model/dual_functions.hpp>

namespace jml {

/// x with one ε per component.
template <typename Scalar, int n>
Vector<Dual<Scalar, n>, n> seed(const Vector<Scalar, n>& x) {
  Vector<Dual<Scalar, n>, n> out;
  for (int i = 0; i < n; ++i) {
    out(i) = Dual<Scalar, n>(x(i));
    out(i).partial[i] = Scalar(1);
  }
  return out;
}

/// ∂function/∂x at x, rows×n, exact to rounding. `function` must accept a Vector of Dual numbers.
template <int rows, typename Scalar, int n, typename Function>
Matrix<Scalar, rows, n> derive_jacobian(const Function& function, const Vector<Scalar, n>& x) {
  const Vector<Dual<Scalar, n>, rows> value = function(seed(x));
  Matrix<Scalar, rows, n> out;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < n; ++j) out(i, j) = value(i).partial[j];
  }
  return out;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
