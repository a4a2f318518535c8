// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cutting a box with a measurement, for certain: the mean-value form of m over the box, y - v = m(x̂) +
/// m_x(box) (x - x̂), row by row and state by state, again while it pays; where a slope has no certain sign,
/// slices.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/bounded/box_ranges.hpp>
#include <jml/bounded/shaving.hpp>

namespace jml::detail {

/// m over a box as a strip for each row: |innovation - M (x - point)| ≤ half, M in an interval matrix.
template <typename Scalar, int n, int p>
struct MeasuredBox {
  Matrix<Interval<Scalar>, p, n> M;
  Vector<Scalar, n> point;
  Ranges<Scalar, n> offset;  ///< box - point
  Vector<Scalar, p> innovation, half;
  bool usable[p];  ///< false: a residual that wraps could have taken y for another turn

  /// Cuts the box. False where it contradicts the measurement, or nothing can be said: report.status.
  template <typename S, typename At>
  [[nodiscard]] bool cut_box(const S& s, Ranges<Scalar, n>& box, const Vector<Scalar, p>& y,
                             const Vector<Scalar, p>& bound, const At& at, BoundedReport<Scalar, p>& report) {
    constexpr int passes = 4;
    for (int pass = 0; pass < passes; ++pass) {
      linearise(s, box, at);
      if (!shave_uncertain(s, box, y, bound, at, report)) return false;
      if (!measure(s, box, y, bound, at)) {
        report.status = Status::sensor_not_finite;
        return false;
      }
      Interval<Scalar> left[n];
      std::copy_n(offset.data(), n, left);
      for (int row = 0; row < p; ++row) {
        if (!usable[row]) continue;
        const Interval<Scalar> target(innovation(row) - half(row), innovation(row) + half(row));
        const Scalar gap = contract_once(M, row, left, target);
        if (gap > Scalar(0)) return contradiction(report, row, gap);
      }
      bool again = false;
      for (int i = 0; i < n; ++i) {
        again |= left[i].high - left[i].low < Scalar(0.9) * (offset(i).high - offset(i).low);
        if (left[i].low == offset(i).low && left[i].high == offset(i).high) continue;
        const Interval<Scalar> cut(below(point(i) + left[i].low), above(point(i) + left[i].high));
        (void)intersect(cut, box(i), box(i));
      }
      if (!again || constant()) break;
    }
    return true;
  }

 private:
  static bool contradiction(BoundedReport<Scalar, p>& report, int row, Scalar excess) {
    report.status = Status::accepted_without_measurement;
    report.violation = {row, -1, excess};
    return false;
  }

  template <typename S, typename At>
  void linearise(const S& s, const Ranges<Scalar, n>& box, const At& at) {
    M = measurement_jacobian(s, box, at);
    for (int i = 0; i < p * n; ++i) known(M.data()[i]);
  }

  /// M has no width: another pass would find the same.
  [[nodiscard]] bool constant() const {
    bool same = true;
    for (int i = 0; i < p * n; ++i) same &= M.data()[i].low == M.data()[i].high;
    return same;
  }

  template <typename S, typename At>
  bool shave_uncertain(const S& s, Ranges<Scalar, n>& box, const Vector<Scalar, p>& y,
                       const Vector<Scalar, p>& bound, const At& at, BoundedReport<Scalar, p>& report) {
    bool uncertain[n] = {}, any = false;
    for (int i = 0; i < p * n; ++i) {
      const Interval<Scalar>& slope = M.data()[i];
      if (contains_zero(slope) && !is_zero(slope)) any = uncertain[i / p] = true;
    }
    if (!any) return true;
    Scalar excess;
    const int row = contradicting_row(s, box, y, bound, at, excess);
    if (row >= 0) return contradiction(report, row, excess);
    for (int i = 0; i < n; ++i) {
      if (uncertain[i]) shave(s, box, i, y, bound, at);
    }
    linearise(s, box, at);
    return true;
  }

  template <typename S, typename At>
  bool measure(const S& s, const Ranges<Scalar, n>& box, const Vector<Scalar, p>& y,
               const Vector<Scalar, p>& bound, const At& at) {
    for (int i = 0; i < n; ++i) point(i) = point_in(box(i).low, box(i).high);
    const Ranges<Scalar, n> here = kernel::cast<Interval<Scalar>>(point);
    const Vector<Interval<Scalar>, p> predicted = measurement(s, here, at);
    for (int i = 0; i < n; ++i) offset(i) = seen_from(point(i), box(i));
    Vector<Scalar, p> middle;
    for (int row = 0; row < p; ++row) middle(row) = predicted(row).centre();
    innovation = measurement_residual(s, y, middle);
    for (int row = 0; row < p; ++row) {
      half(row) = bound(row) + predicted(row).radius() +
                  Scalar(4) * std::numeric_limits<Scalar>::epsilon() *
                      (std::abs(y(row)) + std::abs(middle(row)) + bound(row) + predicted(row).radius());
      const Interval<Scalar> sum = linear_form(Interval<Scalar>(Scalar(0)), M, row, offset.data());
      usable[row] = single_valued(s, middle, row, sum, half(row));
    }
    return all_finite(half) && all_finite(innovation);
  }

  /// `sum`: m(x) - m(point) over the box.
  template <typename S>
  static bool single_valued(const S& s, const Vector<Scalar, p>& middle, int row, const Interval<Scalar>& sum,
                            Scalar reach) {
    if constexpr (requires { SensorTraits<S>::residual(s, middle, middle); }) {
      for (const Scalar end : {sum.low - reach, sum.high + reach}) {
        Vector<Scalar, p> moved = middle;
        moved(row) += end;
        const Scalar seen = measurement_residual(s, moved, middle)(row);
        const Scalar slack =
            Scalar(64) * std::numeric_limits<Scalar>::epsilon() * (std::abs(end) + std::abs(middle(row)));
        if (!(std::abs(seen - end) <= slack)) return false;
      }
    }
    return true;
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
