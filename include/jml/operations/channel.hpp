// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One physical sensor in operation, beside a filter of any method: used, shut or forced; its own gate, in
/// blocks if wanted; its counts; the way out of a gate that has shut; and a watch on its innovations.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <jml/filter/filter.hpp>
#include <jml/filter/way_out.hpp>
#include <jml/operations/lockout.hpp>
#include <jml/operations/monitor.hpp>
#include <jml/operations/tally.hpp>
#include <jml/operations/underweighted.hpp>
#include <jml/operations/with_gate.hpp>

namespace jml {
/// The rows that are judged together: `jml::blocks(jml::only(0), jml::only(1, 2))`.
template <typename... R>
[[nodiscard]] constexpr std::array<Rows, sizeof...(R)> blocks(const R&... rows) {
  return {rows...};
}

/// A sensor in operation.
///
///     jml::Channel radar{Radar{}};
///     radar.gate = {0.999};
///     const auto report = radar.step(filter, y, dt);          // in place of filter.step(Radar{}, y, dt)
///     if (radar.alarms().any()) radar.use = jml::Use::inhibit;
///
///     jml::Channel gnss{Gnss{}, jml::Lockout<6>{.after = 20, .recovery = …, .variances = v}};
///     jml::Channel fix{Radar{}, jml::Lockout{}, jml::blocks(jml::only(0), jml::only(1))};
///
/// One object per sensor: it holds numbers, no filter. Blocks are judged each by its own χ² at the
/// prediction, and those that pass are used: the step predicts, looks, and corrects, which of an exact rule
/// is the correction from its prediction, not its joint step; a Lockout does not offer the others again. A
/// FixedLag takes parts of a sensor that stands in its list as jml::Part<S>.
template <Sensor S, int n = 0, std::size_t groups = 0>
class Channel {
  static constexpr int p = measurements_of<S>;
  /// Else it measures all the time: no measurement of the present can be judged again.
  template <typename F>
  static constexpr bool gives_samples = !has_noise_spectral_density<S, typename F::State, typename F::At>();
  static constexpr bool looks = groups > 0 || detail::is_underweighted<S>;

 public:
  /// As the members of these names.
  explicit Channel(S of, const Lockout<n>& way_out = {}, const std::array<Rows, groups>& judged_together = {})
      : sensor(std::move(of)), lockout(way_out), blocks(judged_together) {}

  S sensor;               ///< the model of it; change it by retune()
  Use use = Use::accept;  ///< what is done with its measurements
  Gate gate;              ///< of this sensor; the filter's own is not read
  Lockout<n> lockout;     ///< when the gate counts as shut, and what is done then
  [[no_unique_address]] std::array<Rows, groups> blocks;  ///< rows that are judged together; none: all
  InnovationMonitor<p> monitor;                           ///< its options: off at first

  [[nodiscard]] const Tally& tally() const { return tally_; }  ///< what became of the measurements
  [[nodiscard]] const Alarms& alarms() const { return monitor.alarms(); }  ///< of the monitor
  /// Measurements in a row that were rejected, or refused for what the filter is.
  [[nodiscard]] int rejected_in_a_row() const { return in_a_row_; }
  /// The gate has been shut for as long as the Lockout says, and its recoveries are used up, or it has none.
  [[nodiscard]] bool shut() const { return shut_; }
  /// A measurement has come.
  [[nodiscard]] bool offered() const { return started_; }
  /// s: since the last measurement that was accepted, or the first that was offered; 0 before.
  [[nodiscard]] double since_accepted(double now) const { return started_ ? now - accepted_at_ : 0; }

  /// Other parameters of the sensor; its R is asked at the filter's state and time, with no control.
  /// invalid_noise_covariance (invalid_option of an Underweighted), and the old ones stay.
  template <typename F>
  [[nodiscard]] Status retune(const S& other, const F& filter) {
    const typename F::At at{filter.time(), 0, kernel::zeros<typename F::Control>()};
    const typename F::State x = filter.x();
    if constexpr (detail::is_underweighted<S>) {
      if (!other.valid()) return Status::invalid_option;
    }
    if constexpr (has_noise_covariance<S, typename F::State, typename F::At>()) {
      if (!is_noise_covariance(noise_covariance(other, x, at))) return Status::invalid_noise_covariance;
    } else if constexpr (has_noise_spectral_density<S, typename F::State, typename F::At>()) {
      if (!is_noise_covariance(noise_spectral_density(other, x, at))) return Status::invalid_noise_covariance;
    }
    sensor = other;
    return Status::ok;
  }
  /// Another gate: invalid_option, and the old one stays.
  [[nodiscard]] Status retune(const Gate& other) {
    if (!other.valid()) return Status::invalid_option;
    gate = other;
    return Status::ok;
  }

  /// Predict over dt and correct with y, as filter.step(). A measurement that is refused leaves the
  /// prediction, and so does one of a channel that is shut: time goes on, unless the prediction is refused.
  template <typename F, typename Step = NoTime>
  typename F::template Report<S> step(
      F& filter, const typename F::template Measurement<S>& y, const Step& dt = {},
      const typename F::Control& control = kernel::zeros<typename F::Control>()) {
    typename F::template Report<S> report;
    if (use == Use::inhibit) return inhibited(report, filter.predict(dt, control));
    report.status = checked();
    if (report.status != Status::ok) return report;
    begin(filter.time());
    bool moved = true;  // to the time of y
    if constexpr (looks) {
      report.status = filter.predict(dt, control);
      moved = usable(report.status);
      if (moved) report = used(filter, y, wanted());
    } else {
      const detail::WithGate with(filter, wanted());
      report = filter.step(sensor, y, dt, control);
      if (!usable(report.status)) moved = usable(filter.predict(dt, control));
    }
    return judged(filter, y, report, moved);
  }

  /// Correct with y, as filter.update(): of the present, or of before where `when` says so (at_time(t),
  /// age(k)), and then without a recovery.
  template <typename F, typename... When>
  typename F::template Report<S> update(F& filter, const typename F::template Measurement<S>& y,
                                        const When&... when) {
    typename F::template Report<S> report;
    if (use == Use::inhibit) return inhibited(report, Status::ok);
    report.status = checked();
    if (report.status != Status::ok) return report;
    begin(filter.time());
    report = used(filter, y, wanted(), when...);
    return judged(filter, y, report, sizeof...(When) == 0);
  }

  /// What changes in operation, for jml::save(); not the sensor and the options.
  auto each_part(auto&& f) {
    constexpr int most = std::numeric_limits<int>::max();
    return f(use, tally_, monitor, in_range(in_a_row_, 0, most), in_range(recoveries_, 0, most), accepted_at_,
             waits_since_, started_, shut_);
  }

 private:
  [[nodiscard]] Status checked() const {
    bool good = gate.valid() && lockout.valid() && monitor.options.valid(p);
    if constexpr (detail::is_underweighted<S>) good = good && sensor.valid();
    Rows seen;
    for (const Rows& block : blocks) {
      good = good && block.mask != 0 && block.within(p) && (block.mask & seen.mask) == 0;
      seen.mask |= block.mask;
    }
    return good ? Status::ok : Status::invalid_option;
  }
  [[nodiscard]] Gate wanted() const { return use == Use::force ? Gate::open() : gate; }
  template <typename Report>
  Report inhibited(Report& report, Status status) {
    report.status = status;
    report.gate = Verdict::inhibited;
    ++tally_.inhibited;
    return report;
  }
  void begin(double now) {
    if (!started_) accepted_at_ = waits_since_ = now;
    started_ = true;
  }

  /// Judged and used; in blocks, or with less weight, as the channel is made.
  template <typename F, typename... When>
  auto used(F& filter, const typename F::template Measurement<S>& y, const Gate& by, const When&... when) {
    if constexpr (looks) {
      static_assert(
          detail::HasRiccati<typename F::Belief>,
          "jml: a channel in blocks, or underweighted, needs a filter with an innovation matrix: of a box a "
          "measurement that contradicts is not used anyway");
      if constexpr (detail::is_underweighted<S>) {
        static_assert(!detail::NoisySensorIn<S, typename F::State::Scalar, F::states, typename F::At>,
                      "jml: what an Underweighted sensor adds to R is in units of y: its noise is additive");
        kernel::set_zero(sensor.added);
      }
      const auto look = [&] {
        const detail::WithGate with(filter, Gate::closed());
        return filter.update(sensor, y, when...);
      };
      auto report = look();
      if (report.gate != Verdict::rejected) return report;  // refused, or used: some read no gate
      if constexpr (detail::is_underweighted<S>) sensor.weigh(report.innovation_matrix);
      if constexpr (groups > 0) {
        const Rows passing = rows_that_pass(report, by);
        report.gate = by.off() ? Verdict::off : Verdict::accepted;
        if (passing.count() < judged_rows().count()) report.gate = Verdict::rejected;
        if (passing.count() == 0) return report;
        auto of_all = report;
        const detail::WithGate with(filter, use == Use::force ? Gate::open() : Gate{});
        report = filter.update(sensor, y, passing, when...);
        report.gate = of_all.gate;
        report.innovation = detail::kept(of_all.innovation, judged_rows());
        report.innovation_matrix = detail::decoupled(of_all.innovation_matrix, judged_rows());
        report.degrees = static_cast<std::int16_t>(judged_rows().count());
        partial_ = report.gate == Verdict::rejected && usable(report.status);
        return report;
      } else {
        const detail::WithGate with(filter, by);
        return filter.update(sensor, y, when...);
      }
    } else {
      const detail::WithGate with(filter, by);
      return filter.update(sensor, y, when...);
    }
  }
  [[nodiscard]] Rows judged_rows() const {
    Rows all;
    for (const Rows& block : blocks) all.mask |= block.mask;
    return all;
  }
  template <typename Report>
  [[nodiscard]] Rows rows_that_pass(const Report& report, const Gate& by) const {
    using Scalar = std::decay_t<decltype(report.innovation(0))>;
    Rows passing;
    for (const Rows& block : blocks) {
      jml::Report<Scalar, p> alone;
      alone.innovation = detail::kept(report.innovation, block);
      alone.innovation_matrix = detail::decoupled(report.innovation_matrix, block);
      if (by.off() || by.passes(alone.nis(), block.count())) passing.mask |= block.mask;
    }
    return passing;
  }

  /// Counts what became of y, and where the gate has shut, tries again.
  template <typename F, typename Report>
  Report judged(F& filter, const typename F::template Measurement<S>& y, Report report, bool present) {
    using Scalar = typename F::State::Scalar;
    const auto fails = [](const Report& r) {
      return r.gate == Verdict::rejected || r.status == Status::accepted_without_measurement;
    };
    if (usable(report.status)) monitor.take(static_cast<const Vector<Scalar, p>&>(y), report);
    const bool rejected = usable(report.status) && fails(report);
    if (rejected || detail::refused_by_filter(report.status)) {
      in_a_row_ += in_a_row_ < std::numeric_limits<int>::max();
      // What was used in part is not offered again, nor what is not of the present.
      shut_ = is_shut(filter.time());
      if constexpr (gives_samples<F>) {
        if (shut_ && present && !partial_ && may_recover(filter)) {
          const auto second = recover(filter, y);
          if (usable(second.status) && (!fails(second) || partial_)) report = second;
        }
      }
    }
    if (!usable(report.status)) {
      ++tally_.refused;
    } else if (partial_) {
      ++tally_.partial;
    } else if (fails(report)) {
      ++tally_.rejected;
    } else {
      ++tally_.accepted;
      accept(filter.time());
    }
    partial_ = false;
    return report;
  }
  void accept(double now) {
    in_a_row_ = recoveries_ = 0;
    accepted_at_ = waits_since_ = now;
    shut_ = false;
  }
  [[nodiscard]] bool is_shut(double now) const {
    return (lockout.after > 0 && in_a_row_ >= lockout.after) || now - waits_since_ >= lockout.seconds;
  }

  template <typename F>
  [[nodiscard]] bool may_recover(F& filter) {
    shut_ = lockout.recovery == Recovery::report || recoveries_ >= lockout.times ||
            (lockout.recovery == Recovery::inflate && !inflate(filter));
    return !shut_;
  }
  template <typename F>
  [[nodiscard]] bool inflate(F& filter) const {
    if constexpr (n > 0 && detail::Loosens<typename F::Belief, typename F::State::Scalar, F::degrees>) {
      static_assert(n == F::degrees,
                    "jml: the variances of a Lockout have the degrees of freedom of the state");
      using Scalar = typename F::State::Scalar;
      return filter.inflate(Vector<Scalar, n>(lockout.variances.template cast<Scalar>())) == Status::ok;
    } else {
      return false;
    }
  }
  /// The filter stands at its prediction, and the measurement is at hand.
  template <typename F>
  auto recover(F& filter, const typename F::template Measurement<S>& y) {
    ++recoveries_;
    ++tally_.recovered;
    in_a_row_ = 0;
    waits_since_ = filter.time();
    Gate again = wanted();
    if (lockout.recovery == Recovery::widen) again = {lockout.probability};
    if (lockout.recovery == Recovery::accept) again = Gate::open();
    return used(filter, y, again);
  }

  Tally tally_{};
  int in_a_row_ = 0, recoveries_ = 0;
  double accepted_at_ = 0, waits_since_ = 0;  // the latter: of the last accepted one, or recovery
  bool started_ = false, shut_ = false, partial_ = false;
};
}  // namespace jml
#include <jml/warnings_end.hpp>
