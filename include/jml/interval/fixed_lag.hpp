// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Joint maximum likelihood of depth L for real time: each step re-optimises the last L steps.
///
/// The exact recursion (Rusnak 2015, eq. (9)) re-smooths ever further back; it stops after one step. Here the
/// criterion J (5) of a window is minimised, its earlier data summed up in an arrival cost. L = 1 has the
/// root of the iterated rule from the same prior; L = the whole interval is the batch answer; on a linear
/// system every L is the Kalman filter and its smoother.
#pragma once

#include <jml/interval/minimise.hpp>
#include <jml/interval/window.hpp>

namespace jml {

/// How a window is re-optimised at each step.
struct LagOptions {
  int sweeps = 2;           ///< backward and forward passes at most: the bound on a step's time
  double tolerance = 1e-6;  ///< stop where the next sweep would move less, see BatchOptions
  Loss loss{};              ///< of the measurements
  bool newton = true;       ///< second derivatives of f and m in the sweeps, see BatchOptions
};

/// What a step of a FixedLag answers.
template <typename Scalar, int p>
struct LagReport {
  /// ok: at the tolerance. accepted_at_limit: all sweeps were made, the usual case; where none of them
  /// lowered J the trajectory is the predicted one, and the next step goes on from there.
  /// accepted_at_rounding. not_converged: no trial had a finite J.
  Status status = Status::ok;
  Verdict gate = Verdict::off;
  Vector<Scalar, p> innovation = kernel::zeros<Vector<Scalar, p>>();  ///< y - m(prediction), units of y
  Scalar nis = std::numeric_limits<Scalar>::quiet_NaN();              ///< with a gate only
  int sweeps = 0;
  Scalar cost = std::numeric_limits<Scalar>::quiet_NaN();  ///< J of the window, arrival cost included
};

/// The fixed-lag estimator.
///
///     jml::FixedLag filter{jml::lag<20>, VanDerPol{}, jml::sensors<SaturatingPosition>, estimate};
///     const auto report = filter.step(SaturatingPosition{}, y);  // filter.x(), filter.x(age)
///     const auto late = filter.late(radar, y, 7);                // taken seven steps ago, arrived now
///
/// Ages count steps back from the newest state, 0 … depth(). Every refusal leaves the window as it was.
/// Static memory, no heap, no exceptions. State-dependent G, Q and R are frozen where a step was
/// predicted.
template <typename Window, typename D, typename List, typename Scalar = double>
class FixedLag {
  using Traits = DynamicsTraits<D>;
  using Memory = detail::WindowMemory<Window, D, List, Scalar>;
  static_assert(detail::require_discrete<D>());

 public:
  static constexpr int states = Traits::states;
  using State = Vector<Scalar, states>;
  using Covariance = Matrix<Scalar, states, states>;
  using Control = Argument<Scalar, Traits::controls>;
  using At = StepContext<Scalar, Traits::controls>;
  template <typename S>
  using Report = LagReport<Scalar, measurements_of<S>>;
  template <typename S>
  using Measurement = Argument<Scalar, measurements_of<S>>;

  /// As Filter's. `List`: jml::sensors<…>, the types of all sensors.
  FixedLag(Window, D dynamics, List, const Estimate<Scalar, states>& initial, double time = 0)
      : memory_(std::move(dynamics)) {
    reset(initial, time);
  }

  LagOptions options;
  /// Innovation gate for step() and update(), off by default; with one a step also propagates P through the
  /// window.
  Gate gate;

  /// Starts again from another estimate.
  Status reset(const Estimate<Scalar, states>& estimate, double time) {
    return status_ = memory_.reset(estimate, time);
  }

  /// Predict over dt, measure y at its end, re-optimise. Arguments as Filter::step.
  template <typename S>
  [[nodiscard]] Report<S> step(const S& sensor, const Measurement<S>& y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    Report<S> report;
    report.status = grow(At{time(), dt, control});
    if (report.status != Status::ok) return report;
    measure(sensor, y, 0, true, report);
    if (!usable(report.status)) memory_.take_back();
    return report;
  }
  template <typename S>
  [[nodiscard]] Report<S> step(const S& sensor, const Measurement<S>& y) {
    static_assert(!Memory::reads_contexts,
                  "jml: this model reads time, dt or control: pass dt, step(sensor, y, dt)");
    return step(sensor, y, Scalar(0));
  }
  template <typename S>
    requires(measurements_of<S> <= 1)  // 0: said nowhere, which step() puts into words
  [[nodiscard]] Report<S> step(const S& sensor, Scalar y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    return step(sensor, kernel::filled<Measurement<S>>(y), dt, control);
  }
  template <typename S>
    requires(measurements_of<S> <= 1)
  [[nodiscard]] Report<S> step(const S& sensor, Scalar y) {
    return step(sensor, kernel::filled<Measurement<S>>(y));
  }

  /// A step without a measurement.
  [[nodiscard]] Status predict(Scalar dt, const Control& control = kernel::zeros<Control>()) {
    return grow(At{time(), dt, control});
  }
  [[nodiscard]] Status predict() {
    static_assert(!reads_context<Scalar, D>(),
                  "jml: this model reads time, dt or control: pass dt, predict(dt)");
    return predict(Scalar(0));
  }

  /// A measurement of the present time.
  template <typename S>
  [[nodiscard]] Report<S> update(const S& sensor, const Measurement<S>& y) {
    Report<S> report;
    measure(sensor, y, 0, false, report);
    return report;
  }
  template <typename S>
    requires(measurements_of<S> <= 1)
  [[nodiscard]] Report<S> update(const S& sensor, Scalar y) {
    return update(sensor, kernel::filled<Measurement<S>>(y));
  }

  /// A measurement that was taken `age` steps ago: it takes its place there, and the window is re-optimised.
  /// older_than_window where that state has left, memory_full where the node has no room. No gate.
  template <typename S>
  [[nodiscard]] Report<S> late(const S& sensor, const Measurement<S>& y, int age) {
    Report<S> report;
    if (age < 0)
      report.status = Status::invalid_option;
    else if (age > depth())
      report.status = Status::older_than_window;
    else
      measure(sensor, y, age, false, report);
    return report;
  }
  template <typename S>
    requires(measurements_of<S> <= 1)
  [[nodiscard]] Report<S> late(const S& sensor, Scalar y, int age) {
    return late(sensor, kernel::filled<Measurement<S>>(y), age);
  }

  [[nodiscard]] Status status() const { return status_; }  ///< of the estimate and the constants of the model
  [[nodiscard]] int depth() const { return memory_.last(); }  ///< steps in the window
  [[nodiscard]] const State& x(int age = 0) const { return memory_.node(depth() - age).x[memory_.now()]; }
  [[nodiscard]] double time(int age = 0) const { return memory_.time_of(depth() - age); }  ///< s
  /// To first order about the window's trajectory (Laplace); NaN where it is lost. A pass through the window.
  [[nodiscard]] Covariance covariance(int age = 0) const {
    return memory_.covariance(depth() - age, options.loss);
  }
  [[nodiscard]] Estimate<Scalar, states> estimate() const { return {x(), covariance()}; }
  [[nodiscard]] const D& dynamics() const { return memory_.dynamics(); }

 private:
  /// Adds a node at the prediction, or says why not and changes nothing.
  Status grow(const At& at) {
    if (status_ != Status::ok) return status_;
    if (const Status status = detail::check_context(at); status != Status::ok) return status;
    if (!options_valid()) return Status::invalid_option;
    if (!memory_.slide(options.loss)) {
      memory_.take_back();
      return Status::covariance_lost;
    }
    const Status status = memory_.append(at);
    if (status != Status::ok) memory_.take_back();
    return status;
  }

  template <typename S>
  void measure(const S& sensor, const Measurement<S>& y, int age, bool fresh, Report<S>& report) {
    static_assert(detail::require_listed<List, S>());
    const auto answer = [&report](Status status) { report.status = status; };
    if (status_ != Status::ok) return answer(status_);
    if (!options_valid()) return answer(Status::invalid_option);
    if (!all_finite(y)) return answer(Status::invalid_measurement);
    const int node = depth() - age;
    const auto at_y = detail::at_sample(memory_.node(node).at());
    report.innovation = measurement_residual(sensor, y, measurement(sensor, x(age), at_y));
    const auto m_x = measurement_jacobian(sensor, x(age), at_y);
    if (!all_finite(report.innovation) || !all_finite(m_x)) return answer(Status::sensor_not_finite);
    if (age == 0 && !gate.off()) {
      if (!gate.valid()) return answer(Status::invalid_option);
      const auto R = noise_covariance(sensor, x(), at_y);
      if (!is_noise_covariance(R)) return answer(Status::invalid_noise_covariance);
      kernel::SymmetricFactor<Scalar, measurements_of<S>> factor;
      if (!factor.factor(R + m_x * covariance() * kernel::transposed(m_x)))
        return answer(Status::singular_innovation);
      report.nis = factor.squared_norm(report.innovation);
      report.gate = gate.passes(report.nis, measurements_of<S>) ? Verdict::accepted : Verdict::rejected;
      if (report.gate == Verdict::rejected) return;
    }
    if (const Status status = memory_.add(node, sensor, y); status != Status::ok) return answer(status);
    const auto found = detail::minimise(
        memory_, {options.sweeps, options.tolerance, options.loss, options.newton, true}, true, true);
    report.status = found.status;
    report.sweeps = found.iterations;
    report.cost = found.cost;
    if (!usable(report.status) && !fresh) memory_.template remove_newest<S>(node);
  }

  [[nodiscard]] bool options_valid() const {
    return options.sweeps > 0 && options.tolerance >= 0 && options.tolerance < 1 && options.loss.valid();
  }

  Memory memory_;
  Status status_ = Status::ok;
};

template <typename Window, typename D, typename... S, typename Scalar, int n>
FixedLag(Window, D, Sensors<S...>, const Estimate<Scalar, n>&, double = 0)
    -> FixedLag<Window, D, Sensors<S...>, Scalar>;

}  // namespace jml
