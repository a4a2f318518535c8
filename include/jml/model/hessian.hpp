// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Second derivatives contracted with weights: Σ_k weight_k ∇²f_k, what Newton's method needs of a model.
#pragma once

#include <jml/model/functions.hpp>

namespace jml {

namespace detail {

/// Column j is (∂J/∂x_j)ᵀ weights, J being the Jacobian; from one directional derivative of J per state, so a
/// number on the stack never holds more than 2(n+1) scalars.
template <int rows, typename Scalar, int n, typename Jacobian>
Matrix<Scalar, n, n> hessian_by_duals(const Jacobian& jacobian, const Vector<Scalar, n>& x,
                                      const Vector<Scalar, rows>& weights) {
  using Along = Dual<Scalar, 1>;
  Matrix<Scalar, n, n> out = Matrix<Scalar, n, n>::Zero();
  Vector<Along, n> z = x.template cast<Along>();
  for (int j = 0; j < n; ++j) {
    z(j).partial[0] = Scalar(1);
    const Matrix<Along, rows, n> J = jacobian(z);
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < rows; ++k) out(i, j) += weights(k) * J(k, i).partial[0];
    }
    z(j).partial[0] = Scalar(0);
  }
  return out;
}

/// The same by central differences, for a model that is not generic in its scalar.
template <int rows, typename Scalar, int n, typename Jacobian>
Matrix<Scalar, n, n> hessian_by_differences(const Jacobian& jacobian, const Vector<Scalar, n>& x,
                                            const Vector<Scalar, rows>& weights) {
  const Scalar relative = std::cbrt(std::numeric_limits<Scalar>::epsilon());
  Matrix<Scalar, n, n> out;
  Vector<Scalar, n> z = x;
  for (int j = 0; j < n; ++j) {
    const Scalar size = std::abs(x(j));
    const Scalar h = relative * (size > Scalar(0) ? size : Scalar(1));
    z(j) = x(j) + h;
    const Matrix<Scalar, rows, n> above = jacobian(z);
    z(j) = x(j) - h;
    const Matrix<Scalar, rows, n> below = jacobian(z);
    z(j) = x(j);
    for (int i = 0; i < n; ++i) out(i, j) = (above.col(i) - below.col(i)).dot(weights) / (Scalar(2) * h);
  }
  return out;
}

}  // namespace detail

/// Σ_k weight_k ∇²f_k(x), n×n.
template <typename Scalar, int n, typename D, typename At>
Matrix<Scalar, n, n> dynamics_hessian(const D& d, const Vector<Scalar, n>& x,
                                      const Vector<Scalar, n>& weights, const At& at) {
  using Along = Dual<Scalar, 1>;
  const auto jacobian = [&](const auto& z) { return dynamics_jacobian(d, z, at); };
  if constexpr (detail::Generic<decltype(detail::jacobian_of(d)), Vector<Along, n>, At> ||
                detail::Generic<decltype(detail::dynamics_of(d)), Vector<Dual<Along, n>, n>, At>) {
    return detail::hessian_by_duals<n>(jacobian, x, weights);
  } else {
    return detail::hessian_by_differences<n>(jacobian, x, weights);
  }
}

/// Σ_k weight_k ∇²m_k(x), n×n.
template <typename Scalar, int n, int p, typename S, typename At>
Matrix<Scalar, n, n> measurement_hessian(const S& s, const Vector<Scalar, n>& x,
                                         const Vector<Scalar, p>& weights, const At& at) {
  using Along = Dual<Scalar, 1>;
  const auto jacobian = [&](const auto& z) { return measurement_jacobian(s, z, at); };
  if constexpr (detail::Generic<decltype(detail::sensor_jacobian_of(s)), Vector<Along, n>, At> ||
                detail::Generic<decltype(detail::measurement_of(s)), Vector<Dual<Along, n>, n>, At>) {
    return detail::hessian_by_duals<p>(jacobian, x, weights);
  } else {
    return detail::hessian_by_differences<p>(jacobian, x, weights);
  }
}

}  // namespace jml
