// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How far the differential recursion (19) may go in one step from a point (x, P).
///
/// A nonsymmetric P may escape to infinity in finite time although Q ≥ 0 and R > 0: the quadratic term alone,
/// Ṗ = -P Dᵀ R⁻¹ E P, has its pole where R + τ E P Dᵀ becomes singular. Where the symmetric part of that
/// matrix is positive definite for a τ ahead there is none so near: every integrator's alarm.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/factors.hpp>
#include <jml/status.hpp>

namespace jml {

/// The rates of (19) at the point where the derivative was last asked, n states and p measurements, and what
/// they allow. `symmetric`: P is a covariance, which has no pole.
template <typename Scalar, int n, int p, bool symmetric>
class StepBounds {
 public:
  Matrix<Scalar, p, p> feedback;  ///< E P Dᵀ, p×p; of p > 1
  Scalar rate = 0;                ///< E K, 1/s; of p = 1

  /// The slot A there, n×n.
  JML_INLINE inline void at_slot(const Matrix<Scalar, n, n>& A) { square_ = square_of_rate(A); }

  /// Whether a fixed step of length h, s, may be taken: explicit Runge-Kutta steps are stable while h times
  /// the rates of Ṗ, twice those of E K and of the model, is below 2.78; a pole of P nearer than 2h is an
  /// escape.
  [[nodiscard]] JML_INLINE inline Status permits(Scalar h) const {
    return square_ * h * h > Scalar(1.39 * 1.39) ? Status::step_too_long : Status::ok;
  }
  /// The same with a measurement, of noise density R, p×p.
  [[nodiscard]] JML_INLINE inline Status permits(Scalar h, const Matrix<Scalar, p, p>& R) const {
    if (square_ * h * h > Scalar(1.39 * 1.39)) return Status::step_too_long;
    if constexpr (p == 1) {
      if (!symmetric && rate * h < Scalar(-0.5)) return Status::riccati_escape;
      if (rate * h > Scalar(1.39)) return Status::step_too_long;
    } else {
      if (!all_finite(feedback)) return Status::ok;  // blamed at the end of the interval
      if (!symmetric && pole_within(2 * h, R)) return Status::riccati_escape;
      if (!positive(Scalar(1.39), R, -h)) return Status::step_too_long;
    }
    return Status::ok;
  }

  /// True if P may have a pole within time `ahead`, s.
  [[nodiscard]] bool pole_within(Scalar ahead, const Matrix<Scalar, p, p>& R) const {
    if constexpr (symmetric)
      return false;
    else if constexpr (p == 1)
      return !(Scalar(1) + ahead * rate > Scalar(0));
    else
      return !positive(Scalar(1), R, ahead);
  }

 private:
  /// max |(A²)_ii|, the same in all units: the square of a rate at which states decay, grow or turn.
  [[nodiscard]] JML_INLINE static Scalar square_of_rate(const Matrix<Scalar, n, n>& A) {
    Scalar largest = 0;
    kernel::repeat<n>([&](int i) JML_INLINE {
      Scalar sum = 0;
      kernel::repeat<n>([&](int k) JML_INLINE { sum += A(i, k) * A(k, i); });
      largest = std::abs(sum) > largest ? std::abs(sum) : largest;
    });
    return largest;
  }

  /// a R + b sym(E P Dᵀ) is positive definite.
  [[nodiscard]] bool positive(Scalar a, const Matrix<Scalar, p, p>& R, Scalar b) const {
    const Matrix<Scalar, p, p> sum = a * R + b * kernel::symmetric_part(feedback);
    kernel::SymmetricFactor<Scalar, p> factor;
    return factor.factor(sum);
  }

  Scalar square_ = 0;  // of a rate of the model
};

}  // namespace jml
#include <jml/warnings_end.hpp>
