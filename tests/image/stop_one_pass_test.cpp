// SPDX-License-Identifier: BSD-3-Clause
// Stopped anywhere, restored into a filter with another past: Kalman, EKF, SDDRE, JML and a factored EKF go
// on bit by bit, also where a belief keeps more digits than it shows.
#include "models/combinations.hpp"
#include "pushed.hpp"

namespace {

using namespace flights;

const auto push_seen = [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
  push<Seen>(filter, seed, k, trace);
};
const auto extended = [](const auto& filter) { return filter.belief().extended ? 1 : 0; };

TEST(StopAndGoOn, OnePassRules) {
  stop_and_go_on(
      "EKF", [] { return jml::Filter{jml::Ekf{}, Pushed{}, pushed_start(), 3.0}; }, push_seen, extended);
  stop_and_go_on(
      "SDDRE about a point",
      [] {
        return jml::Filter{jml::Sddre{jml::AboutPoint{Vector<double, 2>(0.3, -0.1)}}, Pushed{},
                           pushed_start()};
      },
      [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
        if (k % 10 == 0) filter.method().reference.point(0) = 0.01 * k;
        push_seen(filter, seed, k, trace);
      });
  stop_and_go_on("JML", [] { return jml::Filter{jml::Jml{}, Pushed{}, pushed_start()}; }, push_seen);
  stop_and_go_on(
      "Kalman", [] { return jml::Filter{jml::Kalman{}, LinearPushed{}, pushed_start()}; },
      [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
        push<LinearSeen>(filter, seed, k, trace, seed % 2 == 0 ? 1e-7 : 1e-9);
      },
      [](const auto& filter) { return filter.belief().extended && filter.belief().fine ? 1 : 0; });
}

TEST(StopAndGoOn, InFloat) {
  stop_and_go_on(
      "EKF in float",
      [] {
        return jml::Filter{jml::Ekf{}, models::CombinedStep<float, true>{}, models::combined_start<float>()};
      },
      [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
        Draw draw(seed, k);
        const models::CombinedSensor<float, true, false> sensor;
        const auto y = static_cast<float>(draw.uniform(-1, 1));
        if (draw.below(4) == 0)
          trace.see_report(filter.update(sensor, y));
        else
          trace.see_report(filter.step(sensor, y, static_cast<float>(draw.uniform(0.01, 0.1))));
      });
}

TEST(StopAndGoOn, Factored) {
  stop_and_go_on(
      "factored EKF", [] { return jml::Filter{jml::Factored{jml::Ekf{}}, Pushed{}, pushed_start()}; },
      [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
        push<Seen>(filter, seed, k, trace, 1e-11);
      },
      extended);
}

TEST(StopAndGoOn, DamagesAreRefused) {
  jml::Filter filter{jml::Ekf{}, Pushed{}, pushed_start()};
  const auto fresh = filter;
  Trace trace;
  for (int k = 1; k < 20; ++k) push_seen(filter, 1, k, trace);
  refuse_damages(filter, fresh, damages());
}

}  // namespace
