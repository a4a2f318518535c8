// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What every step reports beside the estimate.
#pragma once

#include <cstdint>
#include <jml/estimate.hpp>
#include <jml/factors.hpp>
#include <jml/gate.hpp>
#include <jml/status.hpp>

namespace jml {

/// The gate's verdict on the measurement.
enum class Verdict : std::uint8_t {
  off,       ///< no gate was asked for; the measurement was used
  accepted,  ///< it passed and was used
  rejected,  ///< it did not pass: the estimate is the prediction
};

/// One correction, accepted or not.
template <typename Scalar, int n, int p>
struct StepReport {
  Status status = Status::ok;
  Verdict gate = Verdict::off;
  Vector<Scalar, p> innovation = kernel::zeros<Vector<Scalar, p>>();  ///< y - m(prediction), units of y
  Matrix<Scalar, p, p> innovation_matrix =
      kernel::zeros<Matrix<Scalar, p, p>>();  ///< S = R + E N Dᵀ of the correction; an iterated rule: the
                                              ///< EKF\'s, at the prediction
  Matrix<Scalar, n, p> gain = kernel::zeros<Matrix<Scalar, n, p>>();  ///< K = P⁺ Dᵀ R⁻¹
  // Of an iterated rule only:
  Solver solver = Solver::none;
  int iterations = 0;  ///< sweeps or steps of all solvers together
  Scalar residual =
      0;  ///< of the two ground-truth lines over the state scale; accepted_at_limit: before the last sweep
  Scalar cost = 0;  ///< one-step criterion (11) at the root; may be negative where sym(P) is indefinite
  Vector<Scalar, n> smoothed =
      kernel::zeros<Vector<Scalar, n>>();  ///< x_{i/i+1}: the previous state, seen from here;
                                           ///< of a correction alone x itself

  /// Normalised innovation squared, innovationᵀ sym(S)⁻¹ innovation. NaN where sym(S) is not positive
  /// definite, which a nonsymmetric rule may give.
  [[nodiscard]] Scalar nis() const {
    kernel::SymmetricFactor<Scalar, p> factor;
    const Matrix<Scalar, p, p> symmetric_part = kernel::symmetric_part(innovation_matrix);
    if (!factor.factor(symmetric_part)) return std::numeric_limits<Scalar>::quiet_NaN();
    return factor.squared_norm(innovation);
  }
};

/// The gate's word on a report whose innovation and S are known. False where NIS is undefined.
template <typename Scalar, int n, int p>
[[nodiscard]] JML_INLINE inline bool judge(const Gate& gate, StepReport<Scalar, n, p>& report) {
  if (gate.off()) return true;
  const Scalar nis = report.nis();
  if (!(nis >= Scalar(0))) return false;
  report.gate = gate.passes(nis, p) ? Verdict::accepted : Verdict::rejected;
  return true;
}

/// A step's answer. On refusal `estimate` is the prior, bit by bit.
template <typename Scalar, int n, int p>
struct StepResult {
  Estimate<Scalar, n> estimate;
  StepReport<Scalar, n, p> report;
};

/// A prediction's answer. On refusal `estimate` is the prior, bit by bit.
template <typename Scalar, int n>
struct PredictResult {
  Estimate<Scalar, n> estimate;
  Status status = Status::ok;
};

}  // namespace jml
