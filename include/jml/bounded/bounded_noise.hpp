// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The bounded-noise estimator: disturbances and noise of which only bounds are known.
///
/// x⁺ = f(x) + G (w̄ + w), |w| ≤ ū; y = m(x) + v, |v| ≤ b, by component. All that is known of x is a box: the
/// states that can be reached, met with those that can have been measured. Were the density uniform in it,
/// its centre would be the conditional mean, eq. (2.31), and (d - c)²/12 the variance of its error, (2.34).
/// Source: bounded-noise dissertation, chapters II and III.
#pragma once

#include <jml/bounded/guaranteed_box.hpp>
#include <jml/bounded/linearised_box.hpp>

namespace jml {

/// A recursive estimator that carries a box.
///
///     jml::BoundedNoise filter{jml::Guaranteed{}, Pendulum{}, jml::Box{lower, upper}};
///     const auto report = filter.step(AngleSensor{}, y);
///
/// Rule: Linearised (the source's) or Guaranteed. The model states disturbance_bound() and noise_bound().
/// A measurement that contradicts the bounds is reported and not used: report.violation, and the predicted
/// box stays. Every refusal leaves box and time as they were. Fixed size, no heap, no exceptions.
template <typename Rule, typename D, typename Scalar = double>
class BoundedNoise {
  using Traits = DynamicsTraits<D>;
  static_assert(detail::require_discrete<D>());

 public:
  static constexpr int states = Traits::states;
  using State = Vector<Scalar, states>;
  using Control = Argument<Scalar, Traits::controls>;
  using At = StepContext<Scalar, Traits::controls>;
  template <typename S>
  using Report = BoundedReport<Scalar, measurements_of<S>>;
  template <typename S>
  using Measurement = Argument<Scalar, measurements_of<S>>;

  /// `initial`: a state without a bound is infinite on that side; it must be measured with update(), or no
  /// step is possible. A bad box does not throw: status() names it, and every step answers it until reset().
  /// `time`: s, of `initial`.
  BoundedNoise(Rule rule, D dynamics, const Box<Scalar, states>& initial, double time = 0)
      : rule_(std::move(rule)), dynamics_(std::move(dynamics)) {
    reset(initial, time);
  }
  /// No prior box: the first measurements make it, eqs. (2.13) and (2.16).
  BoundedNoise(Rule rule, D dynamics) : BoundedNoise(std::move(rule), std::move(dynamics), {}) {}

  template <typename Other, int n>
    requires(n != states)
  BoundedNoise(Rule rule, D dynamics, const Box<Other, n>&, double = 0)
      : BoundedNoise(std::move(rule), std::move(dynamics)) {
    static_assert(n == states, "jml: the box has not as many states as the dynamics");
  }

  /// Starts again from another box.
  Status reset(const Box<Scalar, states>& box, double time) {
    now_ = {box, {}};
    time_ = time;
    kernel::set_zero(control_);
    status_ = !std::isfinite(time) ? Status::invalid_time_step
              : box.valid()        ? Status::ok
                                   : Status::invalid_box;
    return status_;
  }

  /// Predict over dt and correct with y, the measurement at its end. dt: s, zero or positive; a model that
  /// reads neither dt nor time may leave it out. control: held over the step.
  template <typename S>
  [[nodiscard]] Report<S> step(const S& sensor, const Measurement<S>& y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    Report<S> report;
    Knowledge next = now_;
    report.status = all_finite(y) ? advance(next, dt, control) : Status::invalid_measurement;
    if (status_ != Status::ok) report.status = status_;
    if (!usable(report.status)) return report;
    const Knowledge predicted = next;
    correct(sensor, y, At{time_ + static_cast<double>(dt), dt, control}, next, report);
    if (!usable(report.status)) return report;
    now_ = report.status == Status::accepted_without_measurement ? predicted : next;
    time_ += static_cast<double>(dt);
    control_ = control;
    return report;
  }
  template <typename S>
  [[nodiscard]] Report<S> step(const S& sensor, const Measurement<S>& y) {
    static_assert(!reads_context<Scalar, D>() && !sensor_reads_context<S, State, At>(),
                  "jml: this model reads time, dt or control: pass dt, step(sensor, y, dt)");
    return step(sensor, y, Scalar(0));
  }
  /// A single measurement as a plain number.
  template <typename S>
    requires(measurements_of<S> == 1)
  [[nodiscard]] Report<S> step(const S& sensor, Scalar y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    return step(sensor, kernel::filled<Measurement<S>>(y), dt, control);
  }
  template <typename S>
    requires(measurements_of<S> == 1)
  [[nodiscard]] Report<S> step(const S& sensor, Scalar y) {
    return step(sensor, kernel::filled<Measurement<S>>(y));
  }

  /// A step without a measurement.
  [[nodiscard]] Status predict(Scalar dt, const Control& control = kernel::zeros<Control>()) {
    if (status_ != Status::ok) return status_;
    Knowledge next = now_;
    const Status status = advance(next, dt, control);
    if (!usable(status)) return status;
    now_ = next;
    time_ += static_cast<double>(dt);
    control_ = control;
    return status;
  }
  [[nodiscard]] Status predict() {
    static_assert(!reads_context<Scalar, D>(),
                  "jml: this model reads time, dt or control: pass dt, predict(dt)");
    return predict(Scalar(0));
  }

  /// Correct with a measurement of the present time: the first one, a second sensor, or after predict().
  template <typename S>
  [[nodiscard]] Report<S> update(const S& sensor, const Measurement<S>& y) {
    Report<S> report;
    report.status = all_finite(y) ? status_ : Status::invalid_measurement;
    if (status_ != Status::ok) report.status = status_;
    if (!usable(report.status)) return report;
    Knowledge next = now_;
    correct(sensor, y, At{time_, Scalar(0), control_}, next, report);
    if (usable(report.status) && report.status != Status::accepted_without_measurement) now_ = next;
    return report;
  }
  template <typename S>
    requires(measurements_of<S> == 1)
  [[nodiscard]] Report<S> update(const S& sensor, Scalar y) {
    return update(sensor, kernel::filled<Measurement<S>>(y));
  }

  [[nodiscard]] Status status() const { return status_; }  ///< of the box given
  /// Centre of the box, the conditional mean (2.31). NaN where a bound is missing.
  [[nodiscard]] State x() const { return now_.box.centre(); }
  [[nodiscard]] const Box<Scalar, states>& box() const { return now_.box; }
  /// (d - c)²/12, eq. (2.34): of this estimate, not an average; the units of the states squared.
  [[nodiscard]] State error_variance() const {
    return kernel::by_entry(now_.box.width(), now_.box.width()) / Scalar(12);
  }
  [[nodiscard]] double time() const { return time_; }  ///< s
  [[nodiscard]] const D& dynamics() const { return dynamics_; }
  [[nodiscard]] const Rule& rule() const { return rule_; }

 private:
  struct Knowledge {
    Box<Scalar, states> box;
    [[no_unique_address]] typename Rule::template Memory<Scalar, states> memory;
  };

  Status advance(Knowledge& next, Scalar dt, const Control& control) const {
    if (!(dt >= Scalar(0)) || !std::isfinite(dt)) return Status::invalid_time_step;
    if (!all_finite(control)) return Status::invalid_control;
    return Rule::predict(dynamics_, next.box, next.memory, At{time_, dt, control});
  }
  template <typename S>
  void correct(const S& sensor, const Measurement<S>& y, const At& at, Knowledge& next,
               Report<S>& report) const {
    static_assert(detail::require_sensor<S>());
    Rule::update(sensor, next.box, next.memory, y, at, report);
  }

  [[no_unique_address]] Rule rule_;
  [[no_unique_address]] D dynamics_;
  Knowledge now_;
  Control control_ = kernel::zeros<Control>();  // of the last step, for a sensor that reads it
  double time_ = 0;
  Status status_ = Status::ok;
};

template <typename Rule, typename D, typename Scalar, int n>
BoundedNoise(Rule, D, const Box<Scalar, n>&, double = 0) -> BoundedNoise<Rule, D, Scalar>;
template <typename Rule, typename D>
BoundedNoise(Rule, D) -> BoundedNoise<Rule, D, double>;

}  // namespace jml
