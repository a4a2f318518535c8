// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Joint maximum likelihood of depth L for real time: each step re-optimises the last L steps.
///
/// The exact recursion (Rusnak 2015, eq. (9)) re-smooths ever further back; it stops after one step. Here the
/// criterion J (5) of a window is minimised, its earlier data summed up in an arrival cost. L = 1 has the
/// root of the iterated rule from the same prior; L = the whole interval is the batch answer; on a linear
/// system every L is the Kalman filter and its smoother.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass.hpp>
#include <jml/filter/when.hpp>
#include <jml/interval/fineness.hpp>
#include <jml/interval/minimise_window.hpp>
#include <jml/interval/window.hpp>

namespace jml {

namespace detail {
/// A window whose states keep within bounds, and that minimises J itself.
template <typename Belief>
concept KeepsWithin = requires(Belief& window, const BatchOptions& how) { window.minimise(how); };
}  // namespace detail

/// How a window is re-optimised at each step.
struct LagOptions {
  /// Backward and forward passes at most: the bound on a step's time. Where f and every m are linear, up to
  /// six more, if the second still moves x by more than `tolerance`: rounding alone can.
  int sweeps = 2;
  double tolerance = 1e-7;  ///< stop where the next sweep would move less, see BatchOptions
  Loss loss{};              ///< of the measurements
  bool newton = true;       ///< second derivatives of f and m in the sweeps, see BatchOptions
  /// Report the innovation matrix, and with it NIS and log-likelihood, without a gate too. It needs P at the
  /// prediction, a pass through the window: a third of a step's time more.
  bool judge = false;
};

/// What a fixed-lag estimator reports. innovation_matrix: with a gate or LagOptions::judge only.
/// status:
///   ok                     at the tolerance
///   accepted_at_limit      all sweeps were made, and J is lower: the usual case
///   accepted_at_prediction no sweep lowered J: the trajectory is the predicted one; the measurement is in
///                          the window, and the next step goes on from there
///   accepted_at_rounding   J and its gradient are at the rounding of the states
///   not_converged          no trial had a finite J: refused
template <typename Scalar, int p>
struct LagReport : Report<Scalar, p> {
  int sweeps = 0;                                          ///< backward and forward passes made
  Scalar cost = std::numeric_limits<Scalar>::quiet_NaN();  ///< J of the window, arrival cost included
};

/// The fixed-lag method.
///
///     jml::Filter filter{jml::FixedLag<20>{}, VanDerPol{}, jml::sensors<SaturatingPosition>, estimate};
///     const auto report = filter.step(SaturatingPosition{}, y);     // filter.x(), .x(age), .P(age)
///     const auto late = filter.update(radar, y, jml::at_time(t));   // or jml::age(7): taken then, here now
///
/// Of a linear model x is right to 1e-6 of a deviation and 64 ε of the largest state of the window, also
/// where P is singular and there is no deviation to compare with. Each is f of the one before, in the digits
/// of Scalar; where the window begins with a state that is known better than they say, in twice the digits,
/// and swept to 1e-7 of a deviation whatever `sweeps` is, or refused: accuracy_not_met.
///
/// length: steps in the window. measurements: room for that many of each sensor type at each node. Ages count
/// steps back from the newest state, 0 … filter.depth(). Static memory, no heap, no exceptions.
/// State-dependent G, Q and R are frozen where a step was predicted.
///
/// A late measurement takes its place at the node of its time, and the window is re-optimised:
/// older_than_window where that has left, memory_full where the node has no room. A gate asks of it what it
/// asks of one in time, with the P that its node has by now. Between two nodes a state is inserted, which
/// shortens the window by one step: where dynamics and noise read dt, else invalid_time_step, as the model
/// does not say what a part of a step is. (By f from the node before: no state, but the disturbance lost.)
template <int length, int measurements = 1, typename List = void>
struct FixedLag {
  static constexpr bool rolls_back = true;         ///< a window is too large to copy
  static constexpr bool optimal_on_linear = true;  ///< asked by check_method()
  static constexpr bool symmetric = true;          ///< P is a covariance
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;  ///< dual numbers
  using SensorList = List;         ///< see jml::sensors
  template <typename Sensors>
  using With = FixedLag<length, measurements, Sensors>;  ///< with the list that a filter names
  template <typename Scalar, typename D>
  using Belief = detail::WindowMemory<length, measurements, D, List, Scalar>;  ///< the window
  template <typename Scalar, typename D, typename S>
  using Report = LagReport<Scalar, measurements_of<S>>;  ///< what a measurement by S is answered with

  explicit FixedLag(const LagOptions& how = {}) : options(how) {}  ///< `how`: sweeps, tolerance, loss
  /// With another list.
  template <typename Other>
  explicit FixedLag(const FixedLag<length, measurements, Other>& other) : options(other.options) {}

  LagOptions options;  ///< invalid_option of a step: any of them outside its range

  /// Discrete dynamics, and a list of sensors.
  template <typename D>
  static consteval bool accepts() {
    static_assert(
        !std::is_void_v<List>,
        "jml: a fixed lag makes room for measurements: name the sensors, Filter{FixedLag<20>{}, dynamics, "
        "jml::sensors<…>, estimate}");
    return detail::require_discrete<D>();
  }
  /// A sensor of the list.
  template <typename S>
  static consteval bool accepts_sensor() {
    return detail::require_sensor<S>() && detail::require_listed<List, S>();
  }

  /// As of Factored: an Estimate, with infinite variances of states of which nothing is known, or a
  /// FactoredEstimate.
  template <typename Belief, typename Given>
  [[nodiscard]] Status start(Belief& window, const Given& given, double time) const {
    static_assert(Given::states == states_of<typename Belief::Dynamics>,
                  "jml: the estimate has not as many states as the dynamics");
    return window.reset(given, time);
  }

  /// Adds a node at the prediction; see advance().
  template <typename Belief, typename At>
  [[nodiscard]] Status predict(Belief& window, const At& at) const {
    const Status status = advance(window, at);
    if constexpr (detail::KeepsWithin<Belief>) {
      if (status == Status::ok) return settle(window);
    }
    return status;
  }
  /// A measurement of the present.
  template <typename Belief, typename Sample, typename Report>
  void correct(Belief& window, const Sample& sample, Report& report) const {
    window.keep();
    measure(window, window.depth(), sample.sensor, sample.y, sample.gate, report);
    if (!usable(report.status)) window.restore();
  }
  /// A node, and its measurement.
  template <typename Belief, typename Sample, typename Report>
  void step(Belief& window, const Sample& sample, Report& report) const {
    report.status = advance(window, sample.at);
    if (report.status != Status::ok) return;
    correct(window, sample, report);
    if (!usable(report.status)) window.take_back();
    if constexpr (detail::KeepsWithin<Belief>) {
      if (usable(report.status) && report.gate == Verdict::rejected) report.status = settle(window);
    }
  }
  /// A measurement of a time before the present, see above.
  template <typename Belief, typename S, typename Y, typename Report>
  void correct_late(Belief& window, const S& sensor, const Y& y, const Lateness& late, Report& report) const {
    int node = window.depth() - late.steps;
    double ahead = 0;  // of the node
    if (late.timed) {
      const double rounding = 8 * std::numeric_limits<double>::epsilon() * std::abs(late.time);
      for (node = window.depth(); node > 0 && window.time_of(node) - late.time > rounding;) --node;
      ahead = late.time - window.time_of(node);
      if (ahead < -rounding) node = -1;
      if (ahead <= rounding) ahead = 0;
    }
    if (node < 0) {
      report.status = Status::older_than_window;
    } else if (ahead == 0) {
      window.keep();
      measure(window, node, sensor, y, late.gate, report);
      if (!usable(report.status)) window.restore();
    } else {
      between(window, node, ahead, sensor, y, late.gate, report);
    }
  }

 private:
  /// Adds a node at the prediction.
  template <typename Belief, typename At>
  [[nodiscard]] Status advance(Belief& window, const At& at) const {
    if (!valid()) return Status::invalid_option;
    window.weigh_by(options.loss);
    Status status = window.slide(options.loss) ? Status::ok : Status::covariance_lost;
    if (status == Status::ok) status = window.append(at);
    if (status != Status::ok) window.take_back();
    return status;
  }
  [[nodiscard]] BatchOptions effort() const {
    return {options.sweeps, options.tolerance, options.loss, options.newton, true};
  }
  /// A node that was added without a measurement, where states have bounds; or it is taken back.
  template <typename Belief>
  [[nodiscard]] Status settle(Belief& window) const {
    window.keep();
    const Status status = window.minimise(effort()).status;
    if (usable(status)) return status;
    window.restore();
    window.take_back();
    return status;
  }
  template <typename Belief>
  [[nodiscard]] auto minimise(Belief& window) const {
    if constexpr (detail::KeepsWithin<Belief>)
      return window.minimise(effort());
    else
      return detail::minimise_window(window, effort(), once<Belief>());
  }
  /// Noise is frozen where it was first met; in charts as long as it moves, for it may enter in any way.
  template <typename Belief>
  static constexpr bool once() {
    return !detail::InCharts<Belief>;
  }
  [[nodiscard]] bool valid() const {
    return options.sweeps > 0 && options.tolerance >= 0 && options.tolerance < 1 && options.loss.valid();
  }

  template <typename Belief, typename S, typename Y, typename Report>
  void between(Belief& window, int node, double ahead, const S& sensor, const Y& y, const Gate& gate,
               Report& report) const {
    using D = typename Belief::Dynamics;
    if constexpr (!detail::splits<typename Belief::Scalar, D>) {
      report.status = Status::invalid_time_step;
    } else {
      const bool full = window.depth() == Belief::longest;
      if (full && node == 0) {
        report.status = Status::older_than_window;
        return;
      }
      if (!window.slide(options.loss)) {
        window.take_back();
        report.status = Status::covariance_lost;
        return;
      }
      if (full) --node;
      window.keep();
      window.insert(node, ahead);
      if (detail::roll_out(window, node))
        measure(window, node + 1, sensor, y, gate, report);
      else
        report.status = Status::dynamics_not_finite;
      if (usable(report.status) && report.gate != Verdict::rejected) return;
      window.join(node);
      window.restore();
      window.take_back();
    }
  }

  /// Stores y at a node and re-optimises. On refusal it is not there, and the trajectory anywhere.
  template <typename Belief, typename S, typename Y, typename Report>
  void measure(Belief& window, int node, const S& sensor, const Y& y, const Gate& gate,
               Report& report) const {
    if constexpr (detail::listed_as_part<List, S>) {
      measure(window, node, part(sensor, first(64)), y, gate, report);
    } else {
      using Scalar = typename Belief::Scalar;
      constexpr int p = measurements_of<S>;
      const auto answer = [&report](Status status) { report.status = status; };
      if (!valid()) return answer(Status::invalid_option);
      window.weigh_by(options.loss);
      if (!all_finite(y)) return answer(Status::invalid_measurement);
      const auto at = end_of(window.node(node).at());
      const auto& x = window.x(window.depth() - node);
      report.innovation = measurement_residual(sensor, y, measurement(sensor, x, at));
      const Matrix<Scalar, p, states_of<typename Belief::Dynamics>> m_x = measurement_jacobian(sensor, x, at);
      if (!all_finite(report.innovation) || !all_finite(m_x)) return answer(Status::sensor_not_finite);
      if (detail::too_fine(sensor, x, y, at)) return answer(Status::accuracy_not_met);
      if (options.judge || !gate.off()) {
        if (!gate.valid()) return answer(Status::invalid_option);
        const auto R = noise_covariance(sensor, x, at);
        if (!is_noise_covariance(R)) return answer(Status::invalid_noise_covariance);
        report.innovation_matrix = R + m_x * window.P(window.depth() - node) * kernel::transposed(m_x);
        if (!judge(gate, report)) return answer(Status::singular_innovation);
        if (report.gate == Verdict::rejected) return;
      }
      if (const Status status = window.add(node, sensor, y); status != Status::ok) return answer(status);
      const auto found = minimise(window);
      report.status = found.status;
      report.sweeps = found.iterations;
      report.cost = found.cost;
      if (usable(report.status) && detail::too_fine(sensor, window.x(window.depth() - node), y, at))
        report.status = Status::accuracy_not_met;
      if (!usable(report.status)) window.template remove_newest<S>(node);
    }
  }
};

/// Another spelling of FixedLag, whose arrival cost and covariances are in factors of themselves.
template <int length, int measurements, typename List>
struct Factored<FixedLag<length, measurements, List>> : FixedLag<length, measurements, List> {
  /// As of FixedLag.
  /// @{
  using Base = FixedLag<length, measurements, List>;
  template <typename Sensors>
  using With = Factored<FixedLag<length, measurements, Sensors>>;
  explicit Factored(const Base& of) : Base(of) {}
  template <typename Other>
  explicit Factored(const Factored<FixedLag<length, measurements, Other>>& other) : Base(other) {}
  /// @}
};

template <int length, int measurements, typename List>
struct PartsOf<FixedLag<length, measurements, List>> {
  static auto each(auto& method, auto&& f) { return f(method.options); }
};
template <int length, int measurements, typename List>
struct PartsOf<Factored<FixedLag<length, measurements, List>>>
    : PartsOfBase<Factored<FixedLag<length, measurements, List>>, FixedLag<length, measurements, List>> {};

}  // namespace jml
#include <jml/warnings_end.hpp>
