// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What an estimator reports of a measurement. Every method's report begins with the same fields; what only
/// one family knows stands in a struct of its own (IteratedReport, LagReport, BoundedReport, FlowReport …).
#include <jml/warnings_begin.hpp>
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
  inhibited  ///< its channel is shut (operations/channel.hpp): the estimate is the prediction
};

/// One measurement of p components, used, rejected or refused.
template <typename Scalar, int p>
struct Report {
  Status status = Status::ok;   ///< what may be used, or why not
  Verdict gate = Verdict::off;  ///< off where no gate was asked for
  std::int16_t degrees = p;     ///< components of y that were measured, see jml::only()
  Vector<Scalar, p> innovation = kernel::zeros<Vector<Scalar, p>>();  ///< y - m(prediction), units of y
  /// S = R + E N Dᵀ of the correction (an iterated rule: the EKF's, at the prediction). Zero where a method
  /// has none.
  Matrix<Scalar, p, p> innovation_matrix = kernel::zeros<Matrix<Scalar, p, p>>();

  /// A report is its status where one is asked for: usable(filter.step(…)).
  constexpr operator Status() const { return status; }  // NOLINT(google-explicit-constructor): the point

  /// Normalised innovation squared, innovationᵀ sym(S)⁻¹ innovation, of a rejected measurement too; χ² of
  /// `degrees` for a filter that is right. NaN where sym(S) is not positive definite: a nonsymmetric rule may
  /// give that, and a method without S.
  [[nodiscard]] Scalar nis() const {
    kernel::SymmetricFactor<Scalar, p> factor;
    if (!factor.factor(kernel::symmetric_part(innovation_matrix)))
      return std::numeric_limits<Scalar>::quiet_NaN();
    return factor.squared_norm(innovation);
  }

  /// log p(y | all before) of a normal innovation: -½ (NIS + log det S + degrees log 2π). NaN where nis() is.
  /// Its sum over a flight is what Q and R are tuned by.
  [[nodiscard]] Scalar log_likelihood() const {
    kernel::SymmetricFactor<Scalar, p> factor;
    if (!factor.factor(kernel::symmetric_part(innovation_matrix)))
      return std::numeric_limits<Scalar>::quiet_NaN();
    Scalar sum = factor.squared_norm(innovation) + Scalar(degrees) * Scalar(1.8378770664093453);
    for (int i = 0; i < p; ++i) sum -= std::log(factor.inverse_diagonal(i));
    return -sum / Scalar(2);
  }
};

/// A correction by a gain.
template <typename Scalar, int n, int p>
struct StepReport : Report<Scalar, p> {
  Matrix<Scalar, n, p> gain = kernel::zeros<Matrix<Scalar, n, p>>();  ///< K = P⁺ Dᵀ R⁻¹
  /// What this correction's rounding may have made of P⁺, relative, in its worst direction: a bound that is
  /// mostly far too large. Of a nonsymmetric rule an estimate, of the entries of P⁺. 0 where nobody asked.
  Scalar rounding = 0;
  /// The step was done over again in twice the digits, as its own did not suffice.
  bool redone = false;
};

/// The gate's verdict, written into the report. False where NIS is not defined and a gate was asked for.
template <typename Scalar, int p>
[[nodiscard]] JML_INLINE inline bool judge(const Gate& gate, Report<Scalar, p>& report) {
  if (gate.off()) return true;
  const Scalar nis = report.nis();
  if (!(nis >= Scalar(0))) return false;
  report.gate = gate.passes(nis, report.degrees) ? Verdict::accepted : Verdict::rejected;
  return true;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
