// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filter in continuous time over states in a space.
///
/// dynamics(x) answers with the tangent velocity. Over an interval the chart sits at the estimate at its
/// start: (z, P) is moved there as in ℝⁿ (continuous/chart_dynamics.hpp), and at the end the state is x ⊞ z,
/// in its space, and P ← J P Jᵀ with the slope of the chart. An integrator that chooses its steps goes on in
/// another chart where one ends; of a fixed one a turn beyond its chart (2.7 rad of an attitude, 1.9 of a
/// direction) is refused, step_too_long.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/continuous/chart_dynamics.hpp>
#include <jml/continuous/signal.hpp>
#include <jml/filter/local_method.hpp>
#include <jml/riccati/differential.hpp>

namespace jml {

template <typename Rule, typename IntegratorType>
class Continuous;  // continuous/continuous.hpp
template <typename Scalar, int n, int p>
struct FlowReport;
struct DavisonMaki;  // riccati/davison_maki.hpp

namespace detail {

template <typename Rule, typename I, typename D>
struct ContinuousInSpace : LocalMethod<Continuous<Rule, I>, D> {
  using Inner = Continuous<Rule, I>;
  using Base = LocalMethod<Inner, D>;
  using Local = ChartDynamics<D>;
  template <typename Scalar, typename>
  using Model = typename Inner::template Model<Scalar, Local>;
  template <typename Scalar, typename>
  struct BeliefType : LocalBelief<Scalar, D, Estimate<Scalar, Local::states>> {
    using Dynamics = D;
  };
  template <typename Scalar, typename Of>
  using Belief = BeliefType<Scalar, Of>;
  template <typename Scalar, typename S>
  static constexpr bool always =
      measures_always<S, Vector<Scalar, Local::numbers>, StepContext<Scalar, Local::controls>>();
  template <typename Scalar, typename, typename S>
  using Report = std::conditional_t<always<Scalar, S>, FlowReport<Scalar, Local::states, measurements_of<S>>,
                                    StepReport<Scalar, Local::states, measurements_of<S>>>;

  using Base::Base;

  template <typename Model, typename Belief, typename At>
  [[nodiscard]] Status predict(Model& model, const Belief& prior, const At& at, Belief& next) const {
    FlowRecord<typename Belief::Scalar, Local::states, 0> record;
    return move(model, NoSensor{}, NoSignal{}, prior, at, next, record);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(Model& model, const Belief& prior, const Sample& sample, Belief& next, Report& report) const {
    using Scalar = typename Belief::Scalar;
    using S = std::remove_cvref_t<decltype(sample.sensor)>;
    using At = std::remove_cvref_t<decltype(sample.at)>;
    if constexpr (always<Scalar, S>) {
      static_assert(
          !std::is_same_v<I, DavisonMaki>,
          "jml: over states in a space a sensor that measures all the time takes RungeKutta4 or Cvode");
      with_signal<Sample::measurements, Scalar>(
          sample.sensor, sample.y, sample.at.time, static_cast<double>(sample.at.dt),
          [&](const auto& signal) {
            const ChartSensor<S, D, Scalar> sensor{local_sensor<D, Scalar>(sample.sensor)};
            FlowRecord<Scalar, Local::states, Sample::measurements> record;
            report.status = move(model, sensor, signal, prior, sample.at, next, record);
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
      this->correct(model, predicted, jml::Sample{sample.sensor, sample.y, end, sample.gate}, next, report);
    }
  }

 private:
  using On = SpaceOf<D>;
  static constexpr bool goes_on = requires { requires I::adaptive; };
  static constexpr int most_charts = 10000;

  /// From chart to chart; `record` is of the first, its counts of all.
  template <typename Model, typename S, typename Signal, typename Belief, typename At, typename Record>
  [[nodiscard]] Status move(Model& model, const S& sensor, const Signal& signal, const Belief& prior,
                            const At& at, Belief& next, Record& record) const {
    using Scalar = typename Belief::Scalar;
    const Inner& inner = *this;
    next = prior;
    Scalar done = 0, length = 0;  // length: of the next chart, 0 where it is to be found
    for (int chart = 0; done < at.dt; ++chart) {
      if (chart == most_charts) return Status::step_too_long;
      LocalContext<Scalar, D> there(at);
      there.from = there.to = next.x;
      there.time += static_cast<double>(done);
      there.dt = at.dt - done;
      const Scalar left = there.dt;
      if constexpr (goes_on) {
        if (length == Scalar(0)) length = reach(model, there);
        there.dt = std::min(there.dt, length);
      }
      auto from = next.local;
      Record of;
      const Status status = inner.flow(model, sensor, signal, from, there, next.local, of);
      if (goes_on && status == Status::step_too_long && there.dt > Scalar(1e-6) * at.dt) {
        next.local = from;
        length = there.dt / Scalar(2);
        continue;
      }
      if (status != Status::ok) return status;
      const long steps = record.steps + of.steps, evaluations = record.evaluations + of.evaluations;
      if (done == Scalar(0)) record = of;
      record.steps = steps;
      record.evaluations = evaluations;
      if constexpr (!goes_on) {
        if (!chart_reaches<On>(there.from, next.local.x)) return Status::step_too_long;
      }
      if (const Status end = settle_at(next, there.from); end != Status::ok) return end;
      kernel::mirror(next.local.P);
      if (!On::contains(next.x)) return Status::outside_space;
      done = there.dt == left ? at.dt : done + there.dt;
      length = 0;
    }
    return Status::ok;
  }

  /// How long the present velocity keeps well inside the chart, at most there.dt.
  template <typename Model, typename Scalar>
  [[nodiscard]] static Scalar reach(const Model& model, const LocalContext<Scalar, D>& there) {
    using Z = Vector<Scalar, Local::states>;
    const Z velocity = model.dynamics.dynamics(Z(kernel::zeros<Z>()), there);
    int pieces = 1;
    while (pieces < most_charts / 2 &&
           !chart_reaches<On>(there.from, Z((there.dt / Scalar(pieces)) * velocity), Scalar(0.9)))
      pieces *= 2;
    return there.dt / Scalar(pieces);
  }
};

template <typename Rule, typename I, typename D>
struct LocalFor<Continuous<Rule, I>, D> {
  using type = ContinuousInSpace<Rule, I, D>;
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
