// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a campaign (component jml::campaign) asks of an estimator, and how it reads the answers.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/nees.hpp>
#include <jml/campaign/accumulator.hpp>
#include <jml/campaign/flight.hpp>
#include <jml/iterated/one_step_cost.hpp>

namespace jml {

/// No cost is wanted (the default).
struct NoCost {};
/// The one-step criterion (11), of a filter with method(), dynamics(), estimate().
struct OneStep {};

/// An estimator of a campaign: a name, how a filter is made for a flight, and optionally a cost for each
/// step: OneStep{}, or a callable (filter, report) -> double, asked after each step that was not refused,
/// within the filter's time. Both are called from several threads at once.
///
///     jml::Estimator{"EKF", [](const auto&) { return jml::Filter{jml::Ekf{}, VanDerPol{}, prior}; }}
///
/// The filter has x(), and step(sensor, y, dt, control), step(sensor, y, dt) or step(sensor, y) whose report
/// has a status. Used where there: update(sensor, y), predict(…), P() for NEES, box(),
/// report.nis(), report.gate, report.violation.row.
template <typename Make, typename Cost = NoCost>
struct Estimator {
  std::string name;  ///< in tables and files; not empty
  Make make;         ///< (const Flight&) → a filter at its start
  Cost cost{};       ///< OneStep{}, or (filter, report) → double
};
/// Types from the arguments.
/// @{
template <typename Make>
Estimator(std::string, Make) -> Estimator<Make, NoCost>;
template <typename Make, typename Cost>
Estimator(std::string, Make, Cost) -> Estimator<Make, Cost>;
/// @}

/// What a campaign flies: x(), and one of the three step() whose report has a status.
template <typename F, typename S, typename Y, typename Scalar, typename Control>
concept Flyable =
    (requires(F& filter, const S& sensor, const Y& y) {
      filter.step(sensor, y).status;
    } || requires(F& filter, const S& sensor, const Y& y, Scalar dt) {
      filter.step(sensor, y, dt).status;
    } || requires(F& filter, const S& sensor, const Y& y, Scalar dt, const Control& control) {
      filter.step(sensor, y, dt, control).status;
    }) && requires(const F& filter) { filter.x(); };

namespace detail {

template <typename Scenario>
constexpr int controls_of_scenario() {
  if constexpr (requires { Scenario::controls; })
    return Scenario::controls;
  else
    return 0;
}
template <typename Scenario>
using FlightOf = Flight<Scenario::states, Scenario::measurements, controls_of_scenario<Scenario>()>;

template <typename Scenario>
bool measured_at_start(const Scenario& scenario) {
  if constexpr (requires { scenario.measured_at_start; })
    return scenario.measured_at_start;
  else
    return false;
}
template <typename Scenario>
double lost_bound(const Scenario& scenario) {
  if constexpr (requires { scenario.lost; })
    return scenario.lost;
  else
    return std::numeric_limits<double>::infinity();
}

/// Compile-time checks of a scenario and of an estimator for it, each with the user's mistake in words.
template <typename Scenario>
consteval bool require_scenario() {
  constexpr bool counted = requires {
    std::integral_constant<int, Scenario::states>();
    std::integral_constant<int, Scenario::measurements>();
  };
  static_assert(counted,
                "jml: a scenario of a campaign has `static constexpr int states` and `measurements`");
  if constexpr (counted) {
    static_assert(Scenario::states > 0 && Scenario::measurements > 0,
                  "jml: a scenario of a campaign has at least one state and one measurement");
    constexpr bool described = requires(const Scenario& s) {
      std::string(s.name);
      static_cast<int>(s.steps);
      double(s.dt);
      s.sensor;
    };
    static_assert(described, "jml: a scenario of a campaign has `name`, `steps`, `dt` (s) and `sensor`");
    constexpr bool flies = requires(const Scenario& s, CounterNoise& noise, FlightOf<Scenario>& flight) {
      s.fly(noise, flight);
    };
    static_assert(flies,
                  "jml: a scenario of a campaign has `void fly(jml::CounterNoise&, jml::Flight<states, "
                  "measurements, controls>&) const`, with its own numbers");
  }
  return true;
}
template <typename Scenario, typename E>
consteval bool require_estimator() {
  constexpr bool makes =
      requires(const E& estimator, const FlightOf<Scenario>& flight) { estimator.make(flight); };
  static_assert(makes,
                "jml: an Estimator is a name and a function of the flight that makes a filter, "
                "[](const auto&) { return jml::Filter{…}; }");
  return makes;
}

/// The sample at the end of dt, however the filter takes it.
template <typename Filter, typename S, typename Y, typename Scalar, typename Control>
auto step_with(Filter& filter, const S& sensor, const Y& y, Scalar dt, const Control& control) {
  static_assert(
      Flyable<Filter, S, Y, Scalar, Control>,
      "jml: an estimator of a campaign has x(), and step(sensor, y, dt, control), step(sensor, y, dt) or "
      "step(sensor, y), whose report has a status");
  if constexpr (Control::RowsAtCompileTime > 0 && requires { filter.step(sensor, y, dt, control); })
    return filter.step(sensor, y, dt, control);
  else if constexpr (requires { filter.step(sensor, y, dt); })
    return filter.step(sensor, y, dt);
  else
    return filter.step(sensor, y);
}
/// `refused` where the filter has no predict().
template <typename Filter, typename Scalar, typename Control>
Status predict_with(Filter& filter, Status refused, Scalar dt, const Control& control) {
  if constexpr (Control::RowsAtCompileTime > 0 && requires { filter.predict(dt, control); })
    return filter.predict(dt, control);
  else if constexpr (requires { filter.predict(dt); })
    return filter.predict(dt);
  else if constexpr (requires { filter.predict(); })
    return filter.predict();
  else
    return refused;
}

/// What the judging of a report fills in.
template <int n, typename Report>
void read_report(const Report& report, CampaignRow<n>& row) {
  row.status = report.status;
  row.refused = !usable(report.status);
  row.rejected = false;
  row.nis = std::numeric_limits<double>::quiet_NaN();
  if (row.refused) return;
  if constexpr (requires { report.gate == Verdict::rejected; })
    row.rejected = report.gate == Verdict::rejected;
  if constexpr (requires { report.violation.row >= 0; }) row.rejected |= report.violation.row >= 0;
  if constexpr (requires { double(report.nis()); }) row.nis = static_cast<double>(report.nis());
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
