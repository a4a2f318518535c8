// SPDX-License-Identifier: BSD-3-Clause
// Stopped anywhere: filters in continuous time, by samples and by a measurement that is there all the time,
// and the algebraic filter with its last solution.
#include "pushed.hpp"

namespace {

using namespace flights;

/// One verb of a filter in continuous time.
const auto flow = [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
  Draw draw(seed, k);
  const double dt = draw.uniform(0.05, 0.15);
  const Vector<double, 1> u(draw.uniform(-1, 1));
  Seen sensor{draw.uniform(0.05, 0.2), draw.uniform(-0.1, 0.1)};
  const Vector<double, 2> y = pushed_y(sensor, k, draw);
  const double from = std::cos(0.1 * k), to = std::cos(0.1 * k + 0.1);
  const int verb = draw.below(8);
  if (verb < 2) {
    trace.see_report(filter.step(sensor, y, dt, u));
  } else if (verb == 2) {
    trace.add(filter.predict(dt, u));
  } else if (verb == 3) {
    trace.see_report(filter.update(sensor, y));
  } else if (verb == 4) {
    filter.gate = {draw.below(2) == 0 ? 1 : 0.99};
    trace.see_report(filter.step(sensor, y, jml::at_time(filter.time() + dt), u));
  } else if (verb == 5) {
    trace.see_report(filter.step(SeenAlways{}, jml::Line{from, to}, dt, u));
  } else if (verb == 6) {
    trace.see_report(filter.step(SeenAlways{}, from, dt, u));
  } else {
    trace.see_report(filter.step(SeenAlways{}, std::numeric_limits<double>::quiet_NaN(), dt, u));
  }
};

TEST(StopAndGoOn, ContinuousTime) {
  stop_and_go_on(
      "EKF by Runge-Kutta",
      [] { return jml::Filter{jml::Continuous{jml::Ekf{}}, Flowing{}, pushed_start(), 1.0}; }, flow);
  stop_and_go_on(
      "RNLS by Davison-Maki",
      [] {
        return jml::Filter{jml::Continuous{jml::Rnls{}, jml::DavisonMaki{}}, Flowing{}, pushed_start(), 1.0};
      },
      flow);
  stop_and_go_on(
      "factored",
      [] { return jml::Filter{jml::Factored{jml::Continuous{jml::Ekf{}}}, Flowing{}, pushed_start(), 1.0}; },
      flow);
}

TEST(StopAndGoOn, Algebraic) {
  stop_and_go_on(
      "algebraic SDDRE",
      [] { return jml::Filter{jml::Algebraic{jml::Sddre{}}, Flowing{}, Vector<double, 2>(0.8, 0.3)}; },
      [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
        if (k % 20 == 0) filter.method().options.substeps = 1 + k / 20;
        flow(filter, seed, k, trace);
      },
      [](const auto& filter) { return filter.belief().warm ? 1 : 0; });
}

}  // namespace
