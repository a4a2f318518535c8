// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The verbs of a method as functions of an estimate, without a filter: for methods whose belief is the
/// Estimate itself, such as every rule of Table 1 and the iterated ones.
///
///     const auto result = jml::step(jml::Ekf{}, dynamics, sensor, estimate, y);  // result.estimate, .report
///
/// On refusal result.estimate is the prior.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/one_pass.hpp>

namespace jml {

/// A correction, with the report of its method.
template <typename Scalar, int n, int p, typename Report = StepReport<Scalar, n, p>>
struct StepResult {
  Estimate<Scalar, n> estimate;  ///< the corrected one; the prior on refusal
  Report report;                 ///< status, innovation, gain, gate
};
/// What correct() and step() answer.
template <typename M, typename Scalar, int n, typename S>
using StepResultOf = StepResult<Scalar, n, measurements_of<S>, ReportOf<M, OfStates<n>, S, Scalar>>;

/// A prediction.
template <typename Scalar, int n>
struct PredictResult {
  Estimate<Scalar, n> estimate;  ///< the predicted one; the prior on refusal
  Status status = Status::ok;    ///< ok, or what was refused
};

/// Propagates an estimate over at.dt.
template <typename M, typename D, typename Scalar, int n>
[[nodiscard]] PredictResult<Scalar, n> predict(const M& rule, const D& d, const Estimate<Scalar, n>& prior,
                                               const ContextOf<D, Scalar>& at = no_context<Scalar, D>()) {
  using Method = typename MethodOf<M>::type;
  static_assert(detail::require_accepted<Method, D>());
  static_assert(detail::look_at_dynamics<Method, Scalar, D>());
  static_assert(states_of<D> == n, "jml: the estimate has not as many states as the dynamics");
  const ModelOf<M, D, Scalar> model(d);
  PredictResult<Scalar, n> out;
  out.status = check_context(at);
  if (out.status == Status::ok) out.status = Method(rule).predict(model, prior, at, out.estimate);
  if (out.status != Status::ok) out.estimate = prior;
  return out;
}

/// Corrects an estimate with a measurement of the same instant. `at`: the time of the sample.
template <typename M, typename S, typename Scalar, int n, int controls = 0>
[[nodiscard]] StepResultOf<M, Scalar, n, S> update(const M& rule, const S& s,
                                                   const Estimate<Scalar, n>& prior,
                                                   const MeasurementOf<S, Scalar>& y,
                                                   const StepContext<Scalar, controls>& at = {},
                                                   const Gate& gate = {}) {
  using Method = typename MethodOf<M>::type;
  static_assert(detail::require_accepted_sensor<Method, S>());
  StepResultOf<M, Scalar, n, S> out;
  out.report.status = check_context(at);
  if (out.report.status == Status::ok)
    Method(rule).correct(Unobserved{}, prior, Sample{s, y, at, gate}, out.estimate, out.report);
  if (!usable(out.report.status)) out.estimate = prior;
  return out;
}

/// One whole step: predict over at.dt, then correct with y of its end.
template <typename M, typename D, typename S, typename Scalar, int n>
[[nodiscard]] StepResultOf<M, Scalar, n, S> step(const M& rule, const D& d, const S& s,
                                                 const Estimate<Scalar, n>& prior,
                                                 const MeasurementOf<S, Scalar>& y,
                                                 const ContextOf<D, Scalar>& at = no_context<Scalar, D>(),
                                                 const Gate& gate = {}) {
  using Method = typename MethodOf<M>::type;
  static_assert(detail::require_accepted<Method, D>() && detail::require_accepted_sensor<Method, S>());
  static_assert(detail::look_at_dynamics<Method, Scalar, D>() &&
                detail::look_at_sensor<Method, Scalar, D, S>());
  static_assert(states_of<D> == n, "jml: the estimate has not as many states as the dynamics");
  const ModelOf<M, D, Scalar> model(d);
  StepResultOf<M, Scalar, n, S> out;
  out.report.status = check_context(at);
  if (out.report.status == Status::ok) {
    const Method method(rule);
    if constexpr (requires { method.step(model, prior, Sample{s, y, at, gate}, out.estimate, out.report); }) {
      method.step(model, prior, Sample{s, y, at, gate}, out.estimate, out.report);
    } else {
      Estimate<Scalar, n> predicted;
      out.report.status = method.predict(model, prior, at, predicted);
      const auto end = end_of(at);
      if (usable(out.report.status))
        method.correct(model, predicted, Sample{s, y, end, gate}, out.estimate, out.report);
    }
  }
  if (usable(out.report.status) && !all_finite(prior.x)) out.report.status = Status::invalid_state;
  if (!usable(out.report.status)) out.estimate = prior;
  return out;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
