// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filter: a rule, a model and an estimate that moves from sample to sample.
#pragma once

#include <jml/riccati/difference.hpp>
#include <utility>

namespace jml {

namespace detail {
// Outside the class, whose own names would hide them; a rule's overloads are found by argument-dependent
// lookup.
constexpr auto call_predict = [](const auto&... a) { return predict(a...); };
constexpr auto call_update = [](const auto&... a) { return update(a...); };
}  // namespace detail

/// A recursive estimator.
///
///     jml::Filter filter{jml::Ekf{}, VanDerPol{}, jml::Estimate{x0, P0}};
///     const auto report = filter.step(SaturatingPosition{}, y);
///
/// Rule: Kalman, Ekf, Sddre, Jml, Iekf, IteratedJml. Every refusal leaves estimate and time as they were.
/// Fixed size, no heap, no exceptions; objects are independent of each other.
template <typename Rule, typename D, typename Scalar = double>
class Filter {
  using Traits = DynamicsTraits<D>;
  static_assert(detail::require_discrete<D>());

 public:
  static constexpr int states = Traits::states;
  using State = Vector<Scalar, states>;
  using Covariance = Matrix<Scalar, states, states>;
  using Control = Argument<Scalar, Traits::controls>;
  using At = StepContext<Scalar, Traits::controls>;
  template <typename S>
  using Report = StepReport<Scalar, states, measurements_of<S>>;
  template <typename S>
  using Measurement = Argument<Scalar, measurements_of<S>>;

  /// `initial.P`: symmetric positive semidefinite; zero means x is known exactly. `time`: s, of `initial`.
  /// A bad one does not throw: status() names it, and every step answers it until reset() gives a good one.
  Filter(Rule rule, D dynamics, const Estimate<Scalar, states>& initial, double time = 0)
      : rule_(std::move(rule)), dynamics_(std::move(dynamics)), process_noise_(dynamics_) {
    reset(initial, time);
  }

  template <typename Other, int n>
    requires(n != states)
  Filter(Rule rule, D dynamics, const Estimate<Other, n>&, double time = 0)
      : Filter(std::move(rule), std::move(dynamics), Estimate<Scalar, states>{}, time) {
    static_assert(n == states, "jml: the estimate has not as many states as the dynamics");
  }

  /// Innovation gate for every step and update; off by default.
  Gate gate;

  /// Starts again from another estimate.
  Status reset(const Estimate<Scalar, states>& estimate, double time) {
    estimate_ = estimate;
    time_ = time;
    kernel::set_zero(control_);
    status_ = std::isfinite(time) ? check_estimate(rule_, estimate) : Status::invalid_time_step;
    if (status_ == Status::ok && !process_noise_.valid()) status_ = Status::invalid_disturbance_covariance;
    return status_;
  }

  /// Predict over dt and correct with y, the measurement at its end. dt: s, zero or positive; a model that
  /// reads neither dt nor time may leave it out. control: held over the step. After a refusal the filter
  /// still stands at its old time: predict(dt) to go on without the measurement.
  template <typename S>
  [[nodiscard]] Report<S> step(const S& sensor, const Measurement<S>& y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    Report<S> report;
    report.status = status_;
    if (status_ != Status::ok) return report;
    State x;
    Covariance P;
    kernel::assign(x, estimate_.x);
    kernel::assign(P, estimate_.P);
    const At at{time_, dt, control};
    step_into(rule_, dynamics_, process_noise_, sensor, estimate_, y, at, gate, report, x, P);
    accept(report.status, x, P, dt);
    if (usable(report.status)) control_ = control;
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
    requires(measurements_of<S> <= 1)  // 0: said nowhere, which step() puts into words
  [[nodiscard]] Report<S> step(const S& sensor, Scalar y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    return step(sensor, kernel::filled<Measurement<S>>(y), dt, control);
  }
  template <typename S>
    requires(measurements_of<S> <= 1)  // 0: said nowhere, which step() puts into words
  [[nodiscard]] Report<S> step(const S& sensor, Scalar y) {
    return step(sensor, kernel::filled<Measurement<S>>(y));
  }

  /// A step without a measurement.
  [[nodiscard]] Status predict(Scalar dt, const Control& control = kernel::zeros<Control>()) {
    if (status_ != Status::ok) return status_;
    const auto result =
        jml::detail::call_predict(rule_, dynamics_, process_noise_, estimate_, At{time_, dt, control});
    accept(result.status, result.estimate.x, result.estimate.P, dt);
    if (usable(result.status)) control_ = control;
    return result.status;
  }
  [[nodiscard]] Status predict() {
    static_assert(!reads_context<Scalar, D>(),
                  "jml: this model reads time, dt or control: pass dt, predict(dt)");
    return predict(Scalar(0));
  }

  /// Correct with a measurement of the present time: a second sensor, or after predict(). A sensor that reads
  /// the control sees that of the last step.
  template <typename S>
  [[nodiscard]] Report<S> update(const S& sensor, const Measurement<S>& y) {
    Report<S> report;
    report.status = status_;
    if (status_ != Status::ok) return report;
    const auto result =
        jml::detail::call_update(rule_, sensor, estimate_, y, At{time_, Scalar(0), control_}, gate);
    accept(result.report.status, result.estimate.x, result.estimate.P, Scalar(0));
    return result.report;
  }
  template <typename S>
    requires(measurements_of<S> <= 1)  // 0: said nowhere, which step() puts into words
  [[nodiscard]] Report<S> update(const S& sensor, Scalar y) {
    return update(sensor, kernel::filled<Measurement<S>>(y));
  }

  [[nodiscard]] Status status() const { return status_; }  ///< of the estimate and the constants of the model
  [[nodiscard]] const State& x() const { return estimate_.x; }
  [[nodiscard]] const Covariance& P() const { return estimate_.P; }
  [[nodiscard]] const Estimate<Scalar, states>& estimate() const { return estimate_; }
  [[nodiscard]] double time() const { return time_; }  ///< s
  [[nodiscard]] const D& dynamics() const { return dynamics_; }
  [[nodiscard]] const Rule& rule() const { return rule_; }

 private:
  void accept(Status status, const State& x, const Covariance& P, Scalar dt) {
    if (!usable(status)) return;
    kernel::assign(estimate_.x, x);
    kernel::assign(estimate_.P, P);
    time_ += static_cast<double>(dt);
  }

  [[no_unique_address]] Rule rule_;
  [[no_unique_address]] D dynamics_;
  detail::ProcessNoise<Scalar, D> process_noise_;
  Estimate<Scalar, states> estimate_;
  Control control_ = kernel::zeros<Control>();  // of the last step, for a sensor that reads it
  double time_ = 0;
  Status status_ = Status::ok;
};

template <typename Rule, typename D, typename Scalar, int n>
Filter(Rule, D, const Estimate<Scalar, n>&, double = 0) -> Filter<Rule, D, Scalar>;

}  // namespace jml
