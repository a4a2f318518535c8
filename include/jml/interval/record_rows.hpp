// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One measurement of an interval as independent rows, for the forms that carry factors.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/costate.hpp>
#include <jml/interval/loss.hpp>

namespace jml::detail {

/// Rows h (columns of H) of variance r, with residual e at the nominal: ½ Σ (e - h δ)² / r. Where a robust
/// loss bends, e is zero and the loss pulls: `pull` = ρ' mᵀR⁻¹r.
template <typename Scalar, int n, int p>
struct RecordRows {
  Matrix<Scalar, n, p> H;
  Vector<Scalar, p> r, e;
  Vector<Scalar, n> pull = kernel::zeros<Vector<Scalar, n>>();
  bool pulls = false;
  Scalar rho = 0;  // its part of 2 J
};

/// Of a robust loss: weight ρ', and along the residual ρ' - β s, which may be zero. The rows are whitened,
/// and what they say along the residual is scaled by the root of the ratio.
template <typename Scalar, int n, int p>
JML_NOINLINE void weigh_rows(Scalar slope, Scalar bend, RecordRows<Scalar, n, p>& rows) {
  if (!(bend > Scalar(0))) {  // rows of variance r / ρ'
    for (int i = 0; i < p; ++i) rows.r(i) /= slope;
    return;
  }
  Scalar s = 0;
  for (int i = 0; i < p; ++i) {
    const Scalar unit = Scalar(1) / std::sqrt(rows.r(i));
    for (int j = 0; j < n; ++j) rows.H(j, i) *= unit;
    rows.e(i) *= unit;
    s += rows.e(i) * rows.e(i);
  }
  kernel::add_product<1>(rows.pull, Matrix<Scalar, n, p>(slope * rows.H), rows.e, rows.pull);
  rows.pulls = true;
  const Scalar left = slope - bend * s;
  const Scalar change = left > Scalar(0) ? std::sqrt(left) - std::sqrt(slope) : -std::sqrt(slope);
  Vector<Scalar, n> along = kernel::zeros<Vector<Scalar, n>>();  // W r / s
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j < n; ++j) along(j) += rows.H(j, i) * rows.e(i) / s;
  }
  for (int i = 0; i < p; ++i) {  // √ρ' W + (√(ρ' - β s) - √ρ') W r rᵀ / s
    for (int j = 0; j < n; ++j)
      rows.H(j, i) = std::sqrt(slope) * rows.H(j, i) + change * along(j) * rows.e(i);
    rows.r(i) = Scalar(1);
    rows.e(i) = Scalar(0);
  }
}

/// L⁻¹ of R = L D Lᵀ to the rows.
template <typename Scalar, int n, int p>
JML_INLINE inline void independent_rows(const kernel::SymmetricFactor<Scalar, p>& R,
                                        RecordRows<Scalar, n, p>& rows) {
  for (int i = 0; i < p; ++i) {
    rows.r(i) = Scalar(1) / R.inverse_diagonal(i);
    for (int k = 0; k < i; ++k) {
      rows.e(i) -= R.lower(i, k) * rows.e(k);
      kernel::subtract_column(rows.H, k, R.lower(i, k), rows.H, i);
    }
  }
}

/// `bent`: with the loss's own curvature.
template <typename Record, typename Scalar, int n, typename At>
[[nodiscard]] auto rows_of(const Record& record, const Loss& loss, bool bent, const Vector<Scalar, n>& x,
                           const At& at) {
  constexpr int p = Record::p;
  RecordRows<Scalar, n, p> rows;
  rows.H = kernel::transposed(measurement_jacobian(record.sensor, x, at));
  rows.e = measurement_residual(record.sensor, record.y, measurement(record.sensor, x, at));
  const Scalar s = record.R.squared_norm(rows.e);
  rows.rho = s;
  independent_rows(record.R, rows);
  if (loss.kind != Loss::Kind::none) {
    const auto value = loss(s);
    rows.rho = value.rho;
    weigh_rows(value.slope, bent ? value.bend : Scalar(0), rows);
  }
  return rows;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
