// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What jml::Filter owns, and how a method's verbs are run on it: commit where the answer is usable, else
/// keep all.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/clock.hpp>
#include <jml/filter/method.hpp>
#include <jml/filter/require_start.hpp>
#include <jml/filter/when.hpp>

namespace jml::detail {

/// The belief becomes `next`. Part by part: what was just stored in pieces is slow to load back as a whole.
template <typename Scalar, int n>
JML_INLINE inline void commit(Estimate<Scalar, n>& belief, const Estimate<Scalar, n>& next) {
  kernel::assign(belief.x, next.x);
  kernel::assign(belief.P, next.P);
}
template <typename Belief>
JML_INLINE inline void commit(Belief& belief, const Belief& next) {
  if constexpr (requires { belief.take(next); })
    belief.take(next);
  else
    belief = next;
}

/// Method, model, belief, clock, control, status.
template <typename M, typename D, typename Scalar>
class FilterCore {
 public:
  using Method = typename MethodFor<M, D>::type;
  using Belief = BeliefOf<M, D, Scalar>;
  using Control = Argument<Scalar, DynamicsTraits<D>::controls>;
  using At = StepContext<Scalar, DynamicsTraits<D>::controls>;
  template <typename S>
  using Report = jml::ReportOf<M, D, S, Scalar>;
  template <typename S>
  using Measurement = MeasurementOf<S, Scalar>;
  static constexpr bool rolls_back = detail::rolls_back<Method>();

  FilterCore(M how, const D& dynamics)
      : method(std::move(how)), model(make_model(method, dynamics)), belief(make_belief(dynamics)) {}

  [[no_unique_address]] Method method;

 private:
  struct NoModel {
    explicit NoModel(const D&) {}
  };
  using Model = typename std::conditional_t<rolls_back, std::type_identity<NoModel>,
                                            detail::ModelOf<Method, Scalar, D>>::type;

 public:
  [[no_unique_address]] Model model;
  Belief belief;
  Control control = kernel::zeros<Control>();  // of the last step, for a sensor that reads it
  Clock clock;
  Status status = Status::ok;

  template <typename Start>
  void start(const Start& start, double time) {
    clock = Clock(time);
    kernel::set_zero(control);
    if constexpr (!require_start<Method, Start, typename StartOf<Method, Scalar, D>::type>())
      status = Status::invalid_state;
    else if constexpr (rolls_back)
      status = method.start(belief, start, time);
    else
      status = method.start(model, start, belief);
    if (!std::isfinite(time)) status = Status::invalid_time_step;
  }

  /// Other dynamics under the same belief, or why not. A window begins anew at the present.
  [[nodiscard]] Status retune(const D& dynamics) {
    if constexpr (rolls_back) {
      const Estimate<Scalar, DynamicsTraits<D>::states, degrees_of<D>> present{belief.x(), belief.P()};
      if (!all_finite(present.x) || !all_finite(present.P)) return Status::covariance_lost;
      const D before = belief.dynamics();
      const auto held = belief.last_control();
      Status answer = belief.replace(dynamics);
      if (answer != Status::ok) return answer;
      answer = method.start(belief, present, clock.time());
      if (answer == Status::ok)
        belief.last_control() = held;
      else
        static_cast<void>(belief.replace(before));
      return answer;
    } else {
      Model other = make_model(method, dynamics);
      if constexpr (requires { other.status(); }) {
        if (const Status answer = other.status(); answer != Status::ok) return answer;
      }
      model = std::move(other);
      return Status::ok;
    }
  }

  /// s: what the caller gave for dt.
  template <typename Step>
  [[nodiscard]] JML_INLINE Scalar length(const Step& dt) const {
    if constexpr (std::is_same_v<Step, NoTime>)
      return Scalar(0);
    else if constexpr (std::is_same_v<Step, AtTime>)
      return static_cast<Scalar>(clock.until(dt.time));
    else if constexpr (require_time<Scalar, Step>())
      return static_cast<Scalar>(dt);
    else
      return Scalar(0);
  }

  /// y as a method gets it: what was not measured is no NaN.
  template <typename S>
  [[nodiscard]] JML_INLINE static decltype(auto) measured(const S& sensor, const Measurement<S>& y) {
    if constexpr (is_part<S>) {
      Measurement<S> kept = y;
      for (int i = 0; i < SensorTraits<S>::measurements; ++i) {
        if (!sensor.rows.has(i)) kept(i) = Scalar(0);
      }
      return kept;
    } else {
      static_cast<void>(sensor);
      return (y);
    }
  }

  /// A step over dt with y at its end. `Of`: the sensor of which `sensor` may be a part.
  template <typename Of, typename S, typename Y>
  [[nodiscard]] JML_INLINE Report<Of> step(const S& sensor, const Y& y, Scalar dt, const Control& over,
                                           const Gate& gate) {
    if constexpr (requires(Belief& next, Report<Of>& report, const At& at) {
                    method.attempt(model, belief, Sample{sensor, y, at, gate}, next, report);
                  }) {
      Report<Of> report = begin<Report<Of>>(sensor);
      const At at{clock.time(), dt, over};
      if (report.status == Status::ok && check_context(at) == Status::ok) {
        Belief next = fresh();
        if (method.attempt(model, belief, Sample{sensor, y, at, gate}, next, report)) {
          commit(belief, next);
          move_on(at);
          return report;
        }
      }
      return whole_step<Of>(sensor, y, dt, over, gate);
    } else {
      return any_step<Of>(sensor, y, dt, over, gate);
    }
  }

  [[nodiscard]] JML_INLINE Status predict(Scalar dt, const Control& over) {
    if (status != Status::ok) return status;
    const At at{clock.time(), dt, over};
    Status answer = check_context(at);
    if (answer != Status::ok) return answer;
    if constexpr (rolls_back) {
      answer = method.predict(belief, at);
    } else {
      Belief next = fresh();
      answer = method.predict(model, belief, at, next);
      if (usable(answer)) commit(belief, next);
    }
    if (usable(answer)) move_on(at);
    return answer;
  }

  /// A correction with y of the present, or of before, as `which` says.
  template <typename Of, typename S, typename... Which>
  [[nodiscard]] JML_INLINE Report<Of> correct(const S& sensor, const Measurement<Of>& given, const Gate& gate,
                                              const Which&... which) {
    Report<Of> report = begin<Report<Of>>(sensor);
    if (report.status != Status::ok) return report;
    const auto& y = measured(sensor, given);
    Lateness late = lateness(clock, which...);
    if (late.status != Status::ok) {
      report.status = late.status;
    } else if (late.now()) {
      const At at{clock.time(), Scalar(0), control};
      const auto sample = Sample{sensor, y, at, gate};
      if constexpr (rolls_back) {
        method.correct(belief, sample, report);
      } else {
        Belief next = fresh();
        method.correct(model, belief, sample, next, report);
        if (usable(report.status)) commit(belief, next);
      }
    } else if constexpr (requires { method.correct_late(belief, sensor, y, late, report); }) {
      late.gate = gate;
      method.correct_late(belief, sensor, y, late, report);
    } else {
      report.status = Status::older_than_window;
    }
    return report;
  }

  auto each_part(auto&& f) { return f(method, belief, control, clock, status); }
  /// The model's own verdict is that of this program.
  void restored() {
    if constexpr (requires { model.restart(); }) model.restart();
    if constexpr (requires { model.status(); }) {
      if (model.status() != Status::ok) status = model.status();
    }
  }

 private:
  /// Out of the way of attempt(): no address of what that works on is handed over, so it lives in registers.
  template <typename Of, typename S, typename Y>
  [[nodiscard]] JML_RARE Report<Of> whole_step(const S& sensor, const Y& y, Scalar dt, const Control& over,
                                               const Gate& gate) {
    return any_step<Of>(sensor, y, dt, over, gate);
  }
  template <typename Of, typename S, typename Y>
  [[nodiscard]] JML_INLINE Report<Of> any_step(const S& sensor, const Y& y, Scalar dt, const Control& over,
                                               const Gate& gate) {
    Report<Of> report = begin<Report<Of>>(sensor);
    if (report.status != Status::ok) return report;
    const At at{clock.time(), dt, over};
    report.status = check_context(at);
    if (report.status != Status::ok) return report;
    const auto sample = Sample{sensor, y, at, gate};
    if constexpr (rolls_back) {
      method.step(belief, sample, report);
    } else {
      Belief next = fresh();
      if constexpr (requires { method.again(model, belief, sample, next, report); }) {
        method.again(model, belief, sample, next, report);
      } else if constexpr (requires { method.step(model, belief, sample, next, report); }) {
        method.step(model, belief, sample, next, report);
      } else {
        Belief predicted = fresh();
        report.status = method.predict(model, belief, at, predicted);
        if (usable(report.status)) {
          const At end = end_of(at);
          if constexpr (begins_as_prior<Method>()) next = predicted;
          method.correct(model, predicted, Sample{sensor, y, end, gate}, next, report);
        }
      }
      if (usable(report.status)) commit(belief, next);
    }
    if (usable(report.status)) move_on(at);
    return report;
  }

  template <typename Given>
  static Model make_model(const Method& method, const Given& dynamics) {
    if constexpr (!rolls_back && requires { typename Method::Local; } && std::is_same_v<Given, D>)
      return make_model(method, typename Method::Local{dynamics});
    else if constexpr (std::is_constructible_v<Model, Given, Method>)
      return Model(dynamics, method);
    else
      return Model(dynamics);
  }
  static Belief make_belief(const D& dynamics) {
    if constexpr (rolls_back)
      return Belief(dynamics);
    else
      return Belief{};
  }

  /// Where a verb writes.
  [[nodiscard]] JML_INLINE Belief fresh() const {
    if constexpr (begins_as_prior<Method>())
      return belief;
    else if constexpr (std::is_constructible_v<Belief, Scratch>)
      return Belief(Scratch{});
    else
      return Belief{};
  }

  /// A report that knows how many rows were measured, and refuses rows that the sensor has not.
  template <typename R, typename S>
  [[nodiscard]] JML_INLINE R begin(const S& sensor) const {
    R report;
    report.status = status;
    if constexpr (is_part<S>) {
      report.degrees = static_cast<std::int16_t>(sensor.rows.count());
      if (report.status == Status::ok && !sensor.rows.within(SensorTraits<S>::measurements))
        report.status = Status::invalid_measurement;
    } else {
      static_cast<void>(sensor);
    }
    return report;
  }

  JML_INLINE void move_on(const At& at) {
    clock.advance(static_cast<double>(at.dt));
    control = at.control;
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
