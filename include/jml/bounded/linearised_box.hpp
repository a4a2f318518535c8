// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The box of the bounded-noise dissertation: bounds carried along the Jacobian at the estimate.
///
/// Prediction, eqs. (3.7)-(3.8) with |A| Δ for A⁺Δ - A⁻Δ (the sign before A⁻ in the scan of (2.33) is a
/// misprint, (3.31) has it right) and |G| ū for G ū, so that G may have entries of either sign. Correction,
/// eqs. (2.13)-(2.30), here for any linear combination of the states and, linearised, any m.
/// Exact for linear models; for others an approximation: the truth may leave the box.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/bounded_report.hpp>
#include <jml/bounded/bounds.hpp>
#include <jml/bounded/box.hpp>
#include <jml/bounded/contraction.hpp>

namespace jml {

/// A rule for a box: the source's own.
struct Linearised {
  /// cut() touches the box only where it is used.
  static constexpr bool contradiction_changes_nothing = true;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;  ///< the Jacobians are derived by dual numbers

  /// Nothing is carried beside the box.
  template <typename Scalar, int n>
  struct Memory {};

  /// Moves the box over at.dt, eqs. (2.5)-(2.34). state_unbounded: a state has no bound yet;
  /// invalid_disturbance_bound; dynamics_not_finite.
  template <typename D, typename Scalar, int n, typename At>
  [[nodiscard]] static Status move(const D& d, Box<Scalar, n>& box, Memory<Scalar, n>&, const At& at) {
    constexpr int q = DynamicsTraits<D>::disturbances;
    if (!box.bounded()) return Status::state_unbounded;
    const Vector<Scalar, n> x = box.centre(), reach = box.width() / Scalar(2);
    const Vector<Scalar, n> next = predicted_state(d, x, at);
    const Matrix<Scalar, n, n> A = dynamics_jacobian(d, x, at);
    // Outward by the rounding of these lines and of a linear model's own F x + G w, so that its box stays a
    // guarantee.
    constexpr Scalar rounding = Scalar(n + q + 8) / 2 * std::numeric_limits<Scalar>::epsilon();
    Vector<Scalar, n> reach_next = rounding * kernel::absolute(next);
    kernel::repeat<n>([&](int j) JML_INLINE {
      const Scalar wide = reach(j) + rounding * (reach(j) + std::abs(x(j)));
      for (int i = 0; i < n; ++i) reach_next(i) += std::abs(A(i, j)) * wide;
    });
    Status diagnose = Status::dynamics_not_finite;
    if constexpr (q > 0) {
      const Vector<Scalar, q> bound = disturbance_bound(d, x, at);
      const Matrix<Scalar, n, q> G = disturbance_input(d, x, at);
      if (!is_bound(bound)) return Status::invalid_disturbance_bound;
      if (!all_finite(G)) diagnose = Status::invalid_disturbance_bound;
      kernel::repeat<q>([&](int j) JML_INLINE {
        const Scalar wide = bound(j) + rounding * bound(j);
        for (int i = 0; i < n; ++i) reach_next(i) += std::abs(G(i, j)) * wide;
      });
    }
    for (int i = 0; i < n; ++i) {
      box.lower(i) = next(i) - reach_next(i);
      box.upper(i) = next(i) + reach_next(i);
    }
    return box.bounded() ? Status::ok : diagnose;  // a NaN or an infinity anywhere above ends up in it
  }

  /// Cuts the box by a measurement, eqs. (3.7)-(3.31): report.status, report.violation.
  template <typename S, typename Scalar, int n, int p, typename At>
  static void cut(const S& s, Box<Scalar, n>& box, Memory<Scalar, n>&, const Vector<Scalar, p>& y,
                  const At& at, BoundedReport<Scalar, p>& report) {
    Vector<Scalar, n> x = box.centre();
    if (!all_finite(x)) {
      // Without a prior box there is no point to linearise at: any serves a linear sensor.
      if (!SensorTraits<S>::linear) {
        report.status = Status::state_unbounded;
        return;
      }
      x = detail::point_in(box);
    }
    const Matrix<Scalar, p, n> H = measurement_jacobian(s, x, at);
    const Vector<Scalar, p> predicted = measurement(s, x, at), bound = noise_bound(s, x, at);
    if (!is_bound(bound)) {
      report.status = Status::invalid_noise_bound;
      return;
    }
    report.innovation = measurement_residual(s, y, predicted);
    if (!all_finite(H) || !all_finite(report.innovation)) {
      report.status = Status::sensor_not_finite;
      return;
    }
    // What these lines round widens the target: a bound met exactly is no violation, and the box of a linear
    // model stays certain. A state's own width is not in what is taken from the target to cut it.
    constexpr Scalar rounding = Scalar(n + 4) * std::numeric_limits<Scalar>::epsilon();
    detail::Span<Scalar> offset[n];
    kernel::repeat<n>([&](int i) JML_INLINE { offset[i] = {box.lower(i) - x(i), box.upper(i) - x(i)}; });
    for (int row = 0; row < p; ++row) {
      Scalar size[n], total = std::abs(y(row)) + std::abs(predicted(row)) + bound(row);
      kernel::repeat<n>([&](int j) JML_INLINE {
        const Scalar width = std::abs(H(row, j)) * (offset[j].high - offset[j].low);
        size[j] = width <= std::numeric_limits<Scalar>::max() ? width : Scalar(0);
        total += size[j] + std::abs(H(row, j) * x(j));
      });
      const auto target = [&](int j) JML_INLINE {
        const Scalar half = bound(row) + rounding * (j < 0 ? total : total - size[j]);
        return detail::Span<Scalar>(report.innovation(row) - half, report.innovation(row) + half);
      };
      const Scalar gap = detail::contract(H, row, offset, target);
      if (gap > Scalar(0)) {
        report.status = Status::accepted_without_measurement;
        report.violation = {row, -1, gap};
        return;
      }
    }
    kernel::repeat<n>([&](int i) JML_INLINE {
      if (offset[i].low > box.lower(i) - x(i)) box.lower(i) = x(i) + offset[i].low;
      if (offset[i].high < box.upper(i) - x(i)) box.upper(i) = x(i) + offset[i].high;
    });
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
