// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One estimator of a campaign flown over one run (component jml::campaign), and what is read from it.
///
/// The filter runs in short legs between two readings of the clock; what is computed from its answers (NEES,
/// NIS, one-step cost) is computed after the leg, outside the filter's time.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <chrono>
#include <jml/campaign/campaign_estimator.hpp>
#include <optional>

namespace jml {

namespace detail {

/// How a run ended for an estimator.
struct RunOutcome {
  int last = 0;                   ///< the last row that is filled
  std::optional<RunFault> fault;  ///< none: the run counts
};

inline void sign(RunFault& fault, std::int64_t run, std::size_t estimator) {
  fault.run = run;
  fault.estimator = static_cast<std::int32_t>(estimator);
}

/// Flies one estimator; one object a thread, reused for every run.
template <typename Scenario, typename E>
class Worker {
 public:
  static constexpr int n = Scenario::states, p = Scenario::measurements;
  using FlightType = FlightOf<Scenario>;
  using Filter = std::decay_t<decltype(std::declval<const E&>().make(std::declval<const FlightType&>()))>;
  using X = std::decay_t<decltype(std::declval<const Filter&>().x())>;
  using Scalar = typename X::Scalar;
  using Y = Vector<Scalar, p>;
  using Control = Vector<Scalar, controls_of_scenario<Scenario>()>;
  using Sensor = std::decay_t<decltype(std::declval<const Scenario&>().sensor)>;
  using Report = decltype(step_with(std::declval<Filter&>(), std::declval<const Sensor&>(),
                                    std::declval<const Y&>(), Scalar(0), std::declval<const Control&>()));
  using Cost = std::decay_t<decltype(std::declval<const E&>().cost)>;
  static_assert(int(X::RowsAtCompileTime) == n, "jml: this estimator has not as many states as the scenario");
  static constexpr bool boxed = requires(const Filter& f) { f.box().lower; };
  static constexpr bool has_P = requires(const Filter& f) { f.P(); };
  static constexpr bool one_step = std::is_same_v<Cost, OneStep>;
  static constexpr bool own_cost = !one_step && !std::is_same_v<Cost, NoCost>;

  std::vector<CampaignRow<n>> rows;                          ///< 0 … steps of the last run
  double inside_ns = 0, covariance_ns = 0, flown_steps = 0;  ///< of all runs, until set to zero

  Worker(const Scenario& scenario, const E& estimator)
      : scenario_(scenario), estimator_(estimator), lost_(lost_bound(scenario)) {
    rows.resize(static_cast<std::size_t>(scenario.steps) + 1);
  }

  RunOutcome fly(const FlightType& flight) {
    Filter filter = estimator_.make(flight);
    RunOutcome outcome;
    take_off(filter, flight, outcome);
    for (int first = 1; first <= flight.steps && !failed(outcome); first += leg_steps) {
      const int done = fly_leg(filter, flight, first, std::min(first + leg_steps - 1, flight.steps));
      for (int k = first; k <= done && !failed(outcome); ++k)
        read(filter, answers_[static_cast<std::size_t>(k - first)], flight, k, outcome);
    }
    return outcome;
  }

 private:
  /// What one step leaves behind, read after the leg.
  struct Answer {
    Report report{};
    Status predicted = Status::ok;
    X x = kernel::zeros<X>();
    Matrix<Scalar, n, n> P = kernel::zeros<Matrix<Scalar, n, n>>();
    Box<Scalar, n> box{};
    double cost = std::numeric_limits<double>::quiet_NaN();
  };
  static constexpr int leg_steps = std::clamp(static_cast<int>(32768 / sizeof(Answer)), 4, 64);

  using Clock = std::chrono::steady_clock;
  static double ns_since(Clock::time_point start) {
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
  }
  static bool failed(const RunOutcome& outcome) {
    return outcome.fault && outcome.fault->kind != RunFault::Kind::lost;
  }

  /// Row 0: the first update where there is one, else the start as it is.
  void take_off(Filter& filter, const FlightType& flight, RunOutcome& outcome) {
    CampaignRow<n>& row = rows[0];
    row.status = Status::ok;
    row.refused = row.rejected = false;
    row.nis = row.cost = std::numeric_limits<double>::quiet_NaN();
    if constexpr (requires(const Y& y) { filter.update(scenario_.sensor, y); }) {
      if (flight.measured_at_start) {
        const Y y = kernel::cast<Scalar>(flight.y[0]);
        const auto start = Clock::now();
        const auto report = filter.update(scenario_.sensor, y);
        inside_ns += ns_since(start);
        read_report(report, row);
      }
    }
    Answer& answer = answers_[0];
    look(filter, answer);
    place(answer, flight.truth[0], row);
    if constexpr (one_step) prior_ = filter.estimate();
    if (flight.measured_at_start) judge(0, outcome);
  }

  /// Steps first … last; the last one that was made, which is the first one that could not be followed.
  int fly_leg(Filter& filter, const FlightType& flight, int first, int last) {
    const Scalar dt = static_cast<Scalar>(flight.dt);
    double covariance = 0;
    int k = first;
    const auto start = Clock::now();
    for (;; ++k) {
      const auto index = static_cast<std::size_t>(k);
      Answer& answer = answers_[static_cast<std::size_t>(k - first)];
      const Y y = kernel::cast<Scalar>(flight.y[index]);
      const Control control = kernel::cast<Scalar>(flight.control[index - 1]);
      answer.report = step_with(filter, scenario_.sensor, y, dt, control);
      answer.predicted = Status::ok;
      if (!usable(answer.report.status))
        answer.predicted = predict_with(filter, answer.report.status, dt, control);
      else if constexpr (own_cost)
        answer.cost = static_cast<double>(estimator_.cost(filter, answer.report));
      covariance += look(filter, answer);
      if (k == last || !usable(answer.predicted)) break;
    }
    inside_ns += ns_since(start) - covariance;
    covariance_ns += covariance;
    flown_steps += k - first + 1;
    return k;
  }

  /// Copies what is to be read later. A P() that must be computed is timed: its ns.
  double look(const Filter& filter, Answer& answer) const {
    answer.x = filter.x();
    if constexpr (boxed) {
      answer.box.lower = filter.box().lower;
      answer.box.upper = filter.box().upper;
    }
    if constexpr (has_P) {
      if constexpr (std::is_reference_v<decltype(filter.P())>) {
        answer.P = filter.P();
      } else {
        const auto start = Clock::now();
        answer.P = filter.P();
        return ns_since(start);
      }
    }
    return 0;
  }

  void read(const Filter& filter, const Answer& answer, const FlightType& flight, int k,
            RunOutcome& outcome) {
    const auto index = static_cast<std::size_t>(k);
    CampaignRow<n>& row = rows[index];
    read_report(answer.report, row);
    row.cost = std::numeric_limits<double>::quiet_NaN();
    if constexpr (one_step) {
      const StepContext<Scalar, Control::RowsAtCompileTime> at{
          flight.time(k - 1), static_cast<Scalar>(flight.dt),
          Control(kernel::cast<Scalar>(flight.control[index - 1]))};
      if (!row.refused) {
        row.cost =
            static_cast<double>(one_step_cost(filter.method(), filter.dynamics(), scenario_.sensor, prior_,
                                              Y(kernel::cast<Scalar>(flight.y[index])), at, answer.report)
                                    .value);
      }
      prior_ = {answer.x, answer.P};
    } else {
      if constexpr (own_cost) row.cost = row.refused ? row.cost : answer.cost;
      static_cast<void>(filter);
    }
    place(answer, flight.truth[index], row);
    if (!usable(answer.predicted)) {
      outcome.last = k;
      outcome.fault = fault(k, RunFault::Kind::prediction_refused, answer.predicted);
    } else {
      judge(k, outcome);
    }
  }

  void place(const Answer& answer, const Vector<double, n>& truth, CampaignRow<n>& row) const {
    row.x = kernel::cast<double>(answer.x);
    row.truth = truth;
    row.error = row.x - truth;
    if constexpr (requires { scenario_.error(row.x, truth); })
      row.scalar_error = scenario_.error(row.x, truth);
    else
      row.scalar_error = row.error.norm();
    row.nees = std::numeric_limits<double>::quiet_NaN();
    if constexpr (has_P) row.nees = nees(row.error, kernel::cast<double>(answer.P));
    if constexpr (boxed) {
      row.box.lower = kernel::cast<double>(answer.box.lower);
      row.box.upper = kernel::cast<double>(answer.box.upper);
    }
  }

  void judge(int k, RunOutcome& outcome) const {
    const CampaignRow<n>& row = rows[static_cast<std::size_t>(k)];
    outcome.last = k;
    if (!all_finite(row.error) || !std::isfinite(row.scalar_error))
      outcome.fault = fault(k, RunFault::Kind::not_finite, row.status);
    else if (!outcome.fault && row.scalar_error > lost_)
      outcome.fault = fault(k, RunFault::Kind::lost, row.status);
  }
  RunFault fault(int k, RunFault::Kind kind, Status status) const {
    RunFault out;
    out.step = k;
    out.kind = kind;
    out.status = status;
    out.scalar_error = rows[static_cast<std::size_t>(k)].scalar_error;
    return out;
  }

  const Scenario& scenario_;
  const E& estimator_;
  double lost_;
  std::vector<Answer> answers_{static_cast<std::size_t>(leg_steps)};
  struct Nothing {};
  std::conditional_t<one_step, Estimate<Scalar, n>, Nothing> prior_{};
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
