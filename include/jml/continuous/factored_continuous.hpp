// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The factored form of a filter in continuous time: `jml::Factored{jml::Continuous{jml::Ekf{}}}`.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/continuous.hpp>
#include <jml/continuous/flow_element.hpp>
#include <jml/filter/factored.hpp>

namespace jml {

/// The factored form of a symmetric rule in continuous time, moved by RungeKutta4: x and P as of
/// Continuous{rule, RungeKutta4{substeps}}, to the fourth order of h = dt / substeps, and P = U D Uᵀ positive
/// whatever h is. Samples are taken as by Factored{rule}, with R of any rank; P_0 as there, infinite
/// variances too, of which samples alone can make finite ones.
///
/// Between samples P is right to the method's order; rounding adds what Factored{rule} says. A step takes the
/// model's functions twice at each stage, a Gram-Schmidt of n×(n + 4q) and, under a measurement that is there
/// all the time, 4p rows. Refused beside what Continuous refuses: such a measurement of a state of which
/// nothing is known yet (step_too_long).
template <typename Rule_>
struct Factored<Continuous<Rule_, RungeKutta4>> {
  static_assert(
      Rule_::symmetric,
      "jml: a factored form belongs to the symmetric rules Kalman, Ekf and Sddre: P of another rule "
      "is no covariance and has no factors U D Uᵀ");
  /// What filter/method.hpp asks of a method.
  /// @{
  using Rule = Continuous<Rule_, RungeKutta4>;
  static constexpr bool symmetric = true, optimal_on_linear = true;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = FactoredBelief<Scalar, states_of<D>>;
  template <typename Scalar, typename D>
  using Model = NoisyDynamics<Scalar, D>;
  template <typename Scalar, typename D, typename S>
  using Report =
      std::conditional_t<detail::measures_always<S, Vector<Scalar, states_of<D>>,
                                                 StepContext<Scalar, DynamicsTraits<D>::controls>>(),
                         FlowReport<Scalar, states_of<D>, measurements_of<S>>,
                         FactoredReport<Scalar, states_of<D>, measurements_of<S>>>;

  Factored() = default;
  explicit Factored(const Rule& of) : rule(of) {}  ///< the plain form

  [[no_unique_address]] Rule rule;  ///< the plain form, with its options

  template <typename D>
  static consteval bool accepts() {
    return detail::require_flat<D>() && Rule::template accepts<D>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return Rule::template accepts_sensor<S>();
  }

  template <typename Model, typename Start, typename Belief>
  [[nodiscard]] Status start(const Model& model, const Start& given, Belief& belief) const {
    return samples().start(model, given, belief);
  }
  template <typename Model, typename Belief, typename At>
  [[nodiscard]] Status predict(const Model& model, const Belief& prior, const At& at, Belief& next) const {
    FlowRecord<typename Belief::Scalar, Belief::states, 0> record;
    StepReport<typename Belief::Scalar, Belief::states, 1> report;
    return flow(model, detail::NoSensor{}, detail::NoSignal{}, prior, at, next, record, report);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
               Report& report) const {
    samples().correct(model, prior, sample, next, report);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
            Report& report) const {
    using Scalar = typename Belief::Scalar;
    using S = std::remove_cvref_t<decltype(sample.sensor)>;
    using At = std::remove_cvref_t<decltype(sample.at)>;
    constexpr int n = Belief::states, p = Sample::measurements;
    if constexpr (detail::measures_always<S, Vector<Scalar, n>, At>()) {
      detail::with_signal<p, Scalar>(
          sample.sensor, sample.y, sample.at.time, static_cast<double>(sample.at.dt),
          [&](const auto& signal) {
            FlowRecord<Scalar, n, p> record;
            report.status = flow(model, sample.sensor, signal, prior, sample.at, next, record, report);
            if (report.status != Status::ok) return;
            report.innovation = record.innovation;
            report.gain = record.gain;
            report.steps = record.steps;
            report.evaluations = record.evaluations;
          },
          [&] { report.status = Status::invalid_measurement; });
    } else {
      Belief predicted;
      report.status = predict(model, prior, sample.at, predicted);
      if (report.status != Status::ok) return;
      const At end = end_of(sample.at);
      correct(model, predicted, jml::Sample{sample.sensor, sample.y, end, sample.gate}, next, report);
    }
  }
  /// @}

 private:
  Factored<Rule_> samples() const { return Factored<Rule_>(rule.rule); }

  template <typename Model, typename S, typename Signal, typename Scalar, int n, typename At, typename Record,
            typename Report>
  [[nodiscard]] Status flow(const Model& model, const S& sensor, const Signal& signal,
                            const FactoredBelief<Scalar, n>& prior, const At& at,
                            FactoredBelief<Scalar, n>& next, Record& record, Report& report) const {
    using D = std::remove_cvref_t<decltype(model.dynamics)>;
    constexpr int q = DynamicsTraits<D>::disturbances, p = SensorTraits<S>::measurements;
    detail::commit(next, prior);
    const int substeps = rule.integrator.substeps;
    if (substeps < 1) return Status::invalid_option;
    if (at.dt == Scalar(0)) return Status::ok;
    Flow<Rule_, D, S, Scalar, Signal> flow(rule.rule, model.dynamics, model.noise, sensor, signal,
                                           at.control);
    if (const Status status = flow.prepare(at.time, prior.x); status != Status::ok) return status;
    const Scalar h = at.dt / Scalar(substeps);
    Status status = Status::ok;
    for (int step = 0; step < substeps && status == Status::ok; ++step) {
      if constexpr (p > 0) {
        if (!all_finite(next.variances)) return Status::step_too_long;
      }
      detail::FlowElement<Scalar, n, 4 * q, 4 * p> element;
      Vector<Scalar, n> x = next.x;
      const Matrix<Scalar, n, n> P = p > 0 ? next.P() : kernel::zeros<Matrix<Scalar, n, n>>();
      status = detail::walk(rule.rule, flow, model.dynamics, sensor, at.time + static_cast<double>(h) * step,
                            h, x, P, element, step == 0 ? &record : nullptr);
      if (status == Status::ok) status = move(element, x, next, report);
    }
    record.steps = substeps;
    record.evaluations = 4L * substeps;
    if (status != Status::dynamics_not_finite) return status;
    Matrix<Scalar, n, n> P = prior.P();  // which of the inputs was it?
    for (int i = 0; i < n; ++i) P(i, i) = std::isinf(P(i, i)) ? Scalar(1) : P(i, i);
    return rule.diagnose(model, sensor, signal, Estimate<Scalar, n>{prior.x, P}, at, true);
  }

  /// P of `belief` by the element, and x.
  template <typename Scalar, int n, int q, int p, typename Report>
  [[nodiscard]] Status move(const detail::FlowElement<Scalar, n, q, p>& element, const Vector<Scalar, n>& x,
                            FactoredBelief<Scalar, n>& belief, Report& report) const {
    const StepContext<Scalar, 0> at{};
    const Factored<Ekf<>> discrete;
    FactoredBelief<Scalar, n> next;
    if constexpr (p > 0) {
      const detail::ElementRows<Scalar, n, q, p> rows{element};
      const Vector<Scalar, p> nothing = kernel::zeros<Vector<Scalar, p>>();
      const Gate open;
      FactoredReport<Scalar, n, p> found;
      discrete.correct(Unobserved{}, belief, jml::Sample{rows, nothing, at, open}, next, found);
      if (!usable(found.status)) return found.status;
      report.redone = report.redone || found.redone;
      detail::commit(belief, next);
    }
    const detail::FactoredDynamics<Scalar, detail::ElementDynamics<Scalar, n, q, p>> model({element, x});
    const Status status = discrete.predict(model, belief, at, next);
    if (status != Status::ok) return status;
    detail::commit(belief, next);
    belief.x = x;
    belief.x_low = kernel::zeros<Vector<Scalar, n>>();
    return Status::ok;
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
