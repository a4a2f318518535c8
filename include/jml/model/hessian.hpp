// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Second derivatives contracted with weights: Σ_k weight_k ∇²f_k, what Newton's method needs of a model.
#include <jml/warnings_begin.hpp>
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
  Matrix<Scalar, n, n> out = kernel::zeros<Matrix<Scalar, n, n>>();
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

/// The Jacobian and the same sum, its lower triangle mirrored, from one evaluation with all directions at
/// once: for few states, where the numbers stay in registers.
template <int rows, typename Scalar, int n, typename Jacobian>
JML_INLINE inline void jacobian_and_hessian_by_duals(const Jacobian& jacobian, const Vector<Scalar, n>& x,
                                                     const Vector<Scalar, rows>& weights,
                                                     Matrix<Scalar, rows, n>& J,
                                                     Matrix<Scalar, n, n>& hessian) {
  using Wide = Dual<Scalar, n>;
  Vector<Wide, n> z;
  kernel::repeat<n>([&](int j) JML_INLINE {
    z(j) = Wide(x(j));
    z(j).partial[j] = Scalar(1);
  });
  const Matrix<Wide, rows, n> wide = jacobian(z);
  kernel::repeat<n>([&](int i) JML_INLINE {
    kernel::repeat<rows>([&](int k) JML_INLINE { J(k, i) = wide(k, i).value; });
    kernel::repeat<n>([&](int j) JML_INLINE {
      if (j > i) return;
      Scalar sum = 0;
      kernel::repeat<rows>([&](int k) JML_INLINE {
        const Scalar second = wide(k, i).partial[j];
        if (!surely_zero(second)) sum += weights(k) * second;
      });
      hessian(i, j) = sum;
      hessian(j, i) = sum;
    });
  });
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
    for (int i = 0; i < n; ++i) {
      const Vector<Scalar, rows> change = kernel::column_of(above, i) - kernel::column_of(below, i);
      out(i, j) = kernel::dot(change, weights) / (Scalar(2) * h);
    }
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
  if constexpr (detail::Generic<detail::HookOf<detail::hooks::DynamicsJacobian, D>, Vector<Along, n>, At> ||
                detail::Generic<detail::HookOf<detail::hooks::Dynamics, D>, Vector<Dual<Along, n>, n>, At>) {
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
  if constexpr (detail::Generic<detail::HookOf<detail::hooks::MeasurementJacobian, S>, Vector<Along, n>,
                                At> ||
                detail::Generic<detail::HookOf<detail::hooks::Measurement, S>, Vector<Dual<Along, n>, n>,
                                At>) {
    return detail::hessian_by_duals<p>(jacobian, x, weights);
  } else {
    return detail::hessian_by_differences<p>(jacobian, x, weights);
  }
}

/// f_x and Σ_k weight_k ∇²f_k at once.
template <typename Scalar, int n, typename D, typename At>
JML_INLINE inline void dynamics_jacobian_and_hessian(const D& d, const Vector<Scalar, n>& x,
                                                     const Vector<Scalar, n>& weights, const At& at,
                                                     Matrix<Scalar, n, n>& J, Matrix<Scalar, n, n>& hessian) {
  using Wide = Dual<Scalar, n>;
  const auto jacobian = [&](const auto& z) JML_INLINE { return dynamics_jacobian(d, z, at); };
  if constexpr (n <= 3 &&
                (detail::Generic<detail::HookOf<detail::hooks::DynamicsJacobian, D>, Vector<Wide, n>, At> ||
                 detail::Generic<detail::HookOf<detail::hooks::Dynamics, D>, Vector<Dual<Wide, n>, n>, At>)) {
    detail::jacobian_and_hessian_by_duals<n>(jacobian, x, weights, J, hessian);
  } else {
    J = dynamics_jacobian(d, x, at);
    hessian = kernel::symmetric_part(dynamics_hessian(d, x, weights, at));
  }
}

/// m_x and Σ_k weight_k ∇²m_k at once.
template <typename Scalar, int n, int p, typename S, typename At>
JML_INLINE inline void measurement_jacobian_and_hessian(const S& s, const Vector<Scalar, n>& x,
                                                        const Vector<Scalar, p>& weights, const At& at,
                                                        Matrix<Scalar, p, n>& J,
                                                        Matrix<Scalar, n, n>& hessian) {
  using Wide = Dual<Scalar, n>;
  const auto jacobian = [&](const auto& z) JML_INLINE { return measurement_jacobian(s, z, at); };
  if constexpr (n <= 3 && (detail::Generic<detail::HookOf<detail::hooks::MeasurementJacobian, S>,
                                           Vector<Wide, n>, At> ||
                           detail::Generic<detail::HookOf<detail::hooks::Measurement, S>,
                                           Vector<Dual<Wide, n>, n>, At>)) {
    detail::jacobian_and_hessian_by_duals<p>(jacobian, x, weights, J, hessian);
  } else {
    J = measurement_jacobian(s, x, at);
    hessian = kernel::symmetric_part(measurement_hessian(s, x, weights, at));
  }
}

}  // namespace jml
#include <jml/warnings_end.hpp>
