// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filter in continuous time: a rule of Table 1 over ẋ = f(x) + G w, moved from sample to sample by an
/// integrator (Rusnak 2018, eqs. (17)-(19)), or, with discrete measurements, between them.
#pragma once

#include <jml/continuous/signal.hpp>
#include <jml/riccati/difference.hpp>
#include <jml/riccati/differential.hpp>
#include <jml/solve/runge_kutta.hpp>
#include <utility>

namespace jml {

namespace detail {

struct NoSignal {
  Vector<double, 0> operator()(double) const { return {}; }
};

/// What moves (x, P): the integrator itself, or what it keeps for one filter.
template <typename Integrator, typename Scalar, int n>
struct EngineOf {
  using type = Integrator;
};
template <typename Integrator, typename Scalar, int n>
  requires requires { typename Integrator::template Engine<Scalar, n>; }
struct EngineOf<Integrator, Scalar, n> {
  using type = typename Integrator::template Engine<Scalar, n>;
};

}  // namespace detail

/// A recursive estimator for a model in continuous time.
///
///     jml::ContinuousFilter filter{jml::Rnls{}, Oscillator{}, jml::Estimate{x0, P0}, jml::DavisonMaki{}};
///     const auto report = filter.step(sensor, y, dt);                  // y held over dt
///     const auto report = filter.step(sensor, jml::Line{y0, y1}, dt);  // y interpolated over dt
///
/// Rule: Kalman (Kalman-Bucy), Ekf, Sddre, Rnls. Integrator: RungeKutta4, DavisonMaki
/// (riccati/davison_maki.hpp) or Cvode (continuous/cvode.hpp). A sensor that has noise_spectral_density()
/// measures all the time; one that has noise_covariance() gives samples: step() then propagates over dt and
/// corrects with the sample at its end by the difference recursion. Every refusal leaves estimate and time as
/// they were. No heap, but Cvode's.
template <typename Rule, typename D, typename Integrator = RungeKutta4, typename Scalar = double>
class ContinuousFilter {
  using Traits = DynamicsTraits<D>;
  static_assert(detail::require_continuous<D>());
  static_assert(detail::require_linear_if_kalman<Rule, Traits::linear>());
  static_assert(OnePassRule<Rule>,
                "jml: an iterated rule has no meaning in continuous time: take Ekf, Sddre, Rnls or Kalman");

 public:
  static constexpr int states = Traits::states;
  using State = Vector<Scalar, states>;
  using Covariance = Matrix<Scalar, states, states>;
  using Control = Argument<Scalar, Traits::controls>;
  using At = StepContext<Scalar, Traits::controls>;
  template <typename S>
  using Measurement = Argument<Scalar, measurements_of<S>>;

  /// `initial.P`: symmetric positive semidefinite; of a nonsymmetric rule its symmetric part. `time`: s, of
  /// `initial`. A bad one does not throw: status() names it, and every step answers it until reset().
  ContinuousFilter(Rule rule, D dynamics, const Estimate<Scalar, states>& initial, Integrator integrator = {},
                   double time = 0)
      : rule_(std::move(rule)),
        dynamics_(std::move(dynamics)),
        process_noise_(dynamics_),
        engine_(std::move(integrator)) {
    reset(initial, time);
  }
  template <typename Other, int n>
    requires(n != states)
  ContinuousFilter(Rule rule, D dynamics, const Estimate<Other, n>&, Integrator integrator = {},
                   double time = 0)
      : ContinuousFilter(std::move(rule), std::move(dynamics), Estimate<Scalar, states>{},
                         std::move(integrator), time) {
    static_assert(n == states, "jml: the estimate has not as many states as the dynamics");
  }

  /// Innovation gate for samples (sensors with a covariance); off by default.
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

  /// Moves the estimate over dt under the measurement: a Vector of p (or a number, p = 1) that is held, a
  /// Line, or any function double → Vector of p of the absolute time, smooth over the interval. dt: s, zero
  /// or positive. With a sensor of samples: predict(dt), then update with the Vector; refused as a whole.
  /// Answers a FlowReport, or the StepReport of the correction.
  template <typename S, typename Signal>
  [[nodiscard]] auto step(const S& sensor, const Signal& y, Scalar dt,
                          const Control& control = kernel::zeros<Control>()) {
    static_assert(detail::require_sensor<S>());
    constexpr int p = measurements_of<S>;
    if constexpr (detail::measures_always<S, State, At>()) {
      FlowReport<Scalar, states, p> report;
      detail::with_signal<p, Scalar>(
          sensor, y, time_, static_cast<double>(dt),
          [&](const auto& signal) { report = move(sensor, signal, dt, control); },
          [&] { report.status = Status::invalid_measurement; });
      return report;
    } else {
      return sample(sensor, detail::as_measurement<p, Scalar>(y), dt, control);
    }
  }

  /// Moves the estimate over dt without a measurement: Ṗ = A P + P Bᵀ + G Q Gᵀ.
  [[nodiscard]] Status predict(Scalar dt, const Control& control = kernel::zeros<Control>()) {
    return move(detail::NoSensor{}, detail::NoSignal{}, dt, control).status;
  }

  /// Corrects with a sample of the present time, by the difference recursion.
  template <typename S>
  [[nodiscard]] StepReport<Scalar, states, measurements_of<S>> update(const S& sensor,
                                                                      const Measurement<S>& y) {
    StepReport<Scalar, states, measurements_of<S>> report;
    report.status = status_;
    if (status_ != Status::ok) return report;
    const auto result = jml::update(rule_, sensor, estimate_, y, At{time_, Scalar(0), control_}, gate);
    if (usable(result.report.status)) estimate_ = result.estimate;
    return result.report;
  }
  template <typename S>
    requires(measurements_of<S> <= 1)
  [[nodiscard]] StepReport<Scalar, states, measurements_of<S>> update(const S& sensor, Scalar y) {
    return update(sensor, Measurement<S>(kernel::filled<Measurement<S>>(y)));
  }

  [[nodiscard]] Status status() const { return status_; }  ///< of the estimate and the constants of the model
  [[nodiscard]] const State& x() const { return estimate_.x; }
  [[nodiscard]] const Covariance& P() const { return estimate_.P; }
  [[nodiscard]] const Estimate<Scalar, states>& estimate() const { return estimate_; }
  [[nodiscard]] double time() const { return time_; }  ///< s
  [[nodiscard]] const D& dynamics() const { return dynamics_; }
  [[nodiscard]] const Rule& rule() const { return rule_; }

 private:
  template <typename S, typename Signal>
  FlowReport<Scalar, states, SensorTraits<S>::measurements> move(const S& sensor, const Signal& signal,
                                                                 Scalar dt, const Control& control) {
    FlowReport<Scalar, states, SensorTraits<S>::measurements> report;
    report.status = status_;
    if (status_ != Status::ok) return report;
    State x;
    Covariance P;
    kernel::assign(x, estimate_.x);
    kernel::assign(P, estimate_.P);
    report.status = flow(sensor, signal, dt, control, x, P, report);
    if (report.status != Status::ok) return report;
    kernel::assign(estimate_.x, x);
    kernel::assign(estimate_.P, P);
    time_ += static_cast<double>(dt);
    control_ = control;
    return report;
  }

  /// x and P are touched on refusal too.
  template <typename S, typename Signal, typename Report>
  JML_INLINE inline Status flow(const S& sensor, const Signal& signal, Scalar dt,
                                            const Control& control, State& x, Covariance& P, Report& report) {
    static_assert(detail::require_linear_if_kalman<Rule, SensorTraits<S>::linear ||
                                                             SensorTraits<S>::measurements == 0>());
    if (const Status status = detail::check_context(At{time_, dt, control}); status != Status::ok)
      return status;
    if (dt == Scalar(0)) return Status::ok;
    Flow<Rule, D, S, Scalar, Signal> flow(rule_, dynamics_, process_noise_, sensor, signal, control);
    if (const Status status = flow.prepare(time_, x); status != Status::ok) return status;
    const Status status = advance(engine_, flow, time_, dt, x, P, report);
    if (status == Status::dynamics_not_finite ||
        (status == Status::ok && !(detail::is_valid<Rule::symmetric>(P) && all_finite(x))))
      return diagnose(sensor, signal, dt, control, all_finite(x));
    return status;
  }

  /// Why an interval ended in numbers that are no estimate, in the order in which they came. A flow of its
  /// own: the address of the other one must not leave its function, or its members live in memory.
  template <typename S, typename Signal>
  JML_NOINLINE Status diagnose(const S& sensor, const Signal& signal, Scalar dt, const Control& control,
                                 bool x_finite) const {
    using F = Flow<Rule, D, S, Scalar, Signal>;
    F flow(rule_, dynamics_, process_noise_, sensor, signal, control);
    State slope_x;
    Covariance slope_P;
    typename F::Report report;
    if constexpr (F::measured) {
      if (!all_finite(flow.measured_at(time_)) ||
          !all_finite(flow.measured_at(time_ + static_cast<double>(dt))))
        return Status::invalid_measurement;
    }
    if (const Status status = flow.prepare(time_, estimate_.x); status != Status::ok) return status;
    if (!all_finite(predicted_state(dynamics_, estimate_.x, flow.at(time_))))
      return Status::dynamics_not_finite;
    const Status status = flow.derivative(time_, estimate_.x, estimate_.P, slope_x, slope_P, &report);
    if (status != Status::ok) return status;
    if constexpr (F::measured) {
      if (!all_finite(report.innovation) || !all_finite(report.gain)) return Status::sensor_not_finite;
      typename F::Coefficients at;
      Vector<Scalar, F::p> innovation;
      if (flow.coefficients(time_, estimate_.x, at, slope_x, innovation) == Status::ok && !all_finite(at.E))
        return Status::sensor_not_finite;
    }
    if (!all_finite(slope_P)) return Status::dynamics_not_finite;
    return Rule::symmetric || !x_finite ? Status::covariance_lost : Status::riccati_escape;
  }

  template <typename S>
  StepReport<Scalar, states, measurements_of<S>> sample(const S& sensor, const Measurement<S>& y, Scalar dt,
                                                        const Control& control) {
    StepReport<Scalar, states, measurements_of<S>> report;
    report.status = status_;
    if (status_ != Status::ok) return report;
    Estimate<Scalar, states> prior = estimate_;
    FlowReport<Scalar, states, 0> propagation;
    report.status = flow(detail::NoSensor{}, detail::NoSignal{}, dt, control, prior.x, prior.P, propagation);
    if (report.status != Status::ok) return report;
    const At end{time_ + static_cast<double>(dt), dt, control};
    const auto result = jml::update(rule_, sensor, prior, y, end, gate);
    if (!usable(result.report.status)) return result.report;
    estimate_ = result.estimate;
    time_ += static_cast<double>(dt);
    control_ = control;
    return result.report;
  }

  [[no_unique_address]] Rule rule_;
  [[no_unique_address]] D dynamics_;
  detail::ProcessNoise<Scalar, D> process_noise_;
  [[no_unique_address]] typename detail::EngineOf<Integrator, Scalar, states>::type engine_;
  Estimate<Scalar, states> estimate_;
  Control control_ = kernel::zeros<Control>();  // of the last interval, for a sensor that reads it
  double time_ = 0;
  Status status_ = Status::ok;
};

template <typename Rule, typename D, typename Scalar, int n>
ContinuousFilter(Rule, D, const Estimate<Scalar, n>&) -> ContinuousFilter<Rule, D, RungeKutta4, Scalar>;
template <typename Rule, typename D, typename Scalar, int n, typename Integrator>
ContinuousFilter(Rule, D, const Estimate<Scalar, n>&, Integrator, double = 0)
    -> ContinuousFilter<Rule, D, Integrator, Scalar>;

}  // namespace jml
