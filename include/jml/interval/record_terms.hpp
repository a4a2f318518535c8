// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What one measurement adds to the backward pass: value, slope and curvature of ½ ρ(rᵀR⁻¹r).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/costate.hpp>
#include <jml/interval/loss.hpp>
#include <jml/model/hessian.hpp>

namespace jml::detail {

/// What the backward pass takes for the curvature of f and m: none, or their second derivatives (Newton),
/// where the quadratic model may turn out to have no minimum.
enum class Curvature { none, full };
/// A linear model, of `Traits`, has none.
template <Curvature curvature, typename Traits>
inline constexpr bool bends = curvature == Curvature::full && !Traits::linear;

/// a += b, of which the lower triangle is read.
template <typename Scalar, int n>
JML_INLINE inline void add_symmetric(Matrix<Scalar, n, n>& a, const Matrix<Scalar, n, n>& b) {
  kernel::repeat<n>([&](int j) JML_INLINE {
    a(j, j) += b(j, j);
    for (int i = j + 1; i < n; ++i) {
      a(i, j) += b(i, j);
      a(j, i) = a(i, j);
    }
  });
}

/// Of a robust loss. (Apart, and by value: what the usual pass works on stays in registers, where its address
/// is never taken; a tenth of the time of a pass at n = 2.)
template <typename Scalar>
[[nodiscard]] JML_NOINLINE typename Loss::template Value<Scalar> loss_apart(const Loss& loss, Scalar s) {
  return loss(s);
}

/// `bent`: with the loss's own curvature, which may leave none along an outlier. Without it a plain pass
/// takes shorter steps that lower J.
template <Curvature curvature, bool bent, typename Record, typename Scalar, int n, typename At>
JML_INLINE inline void add_record(const Record& record, const Loss& loss, const Vector<Scalar, n>& x,
                                  const At& at, PassSums<Scalar>& sums, CostToGo<Scalar, n>& v) {
  constexpr int p = Record::p;
  const Vector<Scalar, p> residual =
      measurement_residual(record.sensor, record.y, measurement(record.sensor, x, at));
  const Scalar s = record.R.squared_norm(residual);
  const bool robust = loss.kind != Loss::Kind::none;
  Scalar rho = s, slope = Scalar(1), bent_by = Scalar(0);
  if (robust) {
    const auto value = loss_apart(loss, s);
    rho = value.rho;
    slope = value.slope;
    if (bent) bent_by = value.bend;
  }
  Matrix<Scalar, p, n> m_x;
  if constexpr (bends<curvature, SensorTraits<decltype(record.sensor)>>) {
    Vector<Scalar, p> weights;
    kernel::scale(weights, -slope, record.R.solve(residual));  // -ρ' R⁻¹ r
    Matrix<Scalar, n, n> bend;
    measurement_jacobian_and_hessian(record.sensor, x, weights, at, m_x, bend);
    add_symmetric(v.information, bend);
  } else {
    kernel::assign(m_x, measurement_jacobian(record.sensor, x, at));
  }
  if constexpr (curvature == Curvature::none) sums.cost += rho / Scalar(2);
  if (robust) {
    const CostToGo<Scalar, n> added = robust_measurement(m_x, record.R, residual, slope, bent_by);
    kernel::add_scaled(v.information, v.information, Scalar(1), added.information);
    kernel::add_scaled(v.slope, v.slope, Scalar(1), added.slope);
  } else {
    add_measurement(m_x, record.R, residual, v);
  }
}

/// ½ ρ(rᵀR⁻¹r) alone.
template <typename Record, typename Scalar, int n, typename At>
[[nodiscard]] JML_INLINE inline Scalar record_cost(const Record& record, const Loss& loss,
                                                   const Vector<Scalar, n>& x, const At& at) {
  const auto residual = measurement_residual(record.sensor, record.y, measurement(record.sensor, x, at));
  return loss(record.R.squared_norm(residual)).rho / Scalar(2);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
