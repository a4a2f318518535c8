// SPDX-License-Identifier: BSD-3-Clause
// A radar in operation: its own gate, a way out when the target jumps and the gate shuts, a watch on its
// innovations, limits of the state, and the health of it all in words.
#include <cstdio>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>

struct Target {  // position and velocity, m, m/s; a sample each second
  static constexpr int states = 2, disturbances = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + x(1), x(1)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0.5, 1}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.01); }
};
struct Radar {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(4.0); }
};

int main() {
  const jml::Estimate<double, 2> start{jml::Vector<double, 2>(0, 10), jml::Matrix<double, 2, 2>::Identity()};
  jml::Filter filter{jml::Ekf{}, Target{}, start};

  // [channel]
  jml::Lockout<2> way_out{.after = 5, .recovery = jml::Recovery::inflate};
  way_out.variances << 1e6, 100;  // what a jump may be, m², (m/s)²
  jml::Channel radar{Radar{}, way_out};
  radar.gate = {0.999};
  radar.monitor.options = {.window = 10, .false_alarms = 1e-4, .repeats = 3};
  jml::Limits<2> limits;
  limits.lower << -1e4, -300;
  limits.upper << 1e4, 300;
  limits.least_variance << 0.1, 0.01;
  // [/channel]

  jml::Health before;
  jml::Noise noise(1);
  jml::Vector<double, 2> truth(0, 10);
  for (int k = 1; k <= 60; ++k) {
    truth = Target{}.dynamics(truth);
    if (k == 30) truth(0) += 500;  // say, another target is tracked from here on
    const double y = truth(0) + 2 * noise.normal();
    // [step]
    const auto report = radar.step(filter, y, 1.0);  // in place of filter.step(Radar{}, y, 1.0)
    const auto kept = jml::keep_within(filter, limits);
    const jml::Health health = jml::check_health(filter, kept, 10.0, radar);
    // [/step]
    const bool news = health.concerns != before.concerns;
    if (k % 10 == 0 || news)
      std::printf("%2d s: %s, error %6.1f m, %d rejected in a row%s\n", k, jml::describe(report.status),
                  filter.x()(0) - truth(0), radar.rejected_in_a_row(), health.good() ? "" : ":");
    for (int i = 0; i < jml::Health::kinds; ++i) {
      const auto concern = static_cast<jml::Concern>(i);
      if (news && health.has(concern)) std::printf("      %s\n", jml::describe(concern));
    }
    before = health;
  }
  const jml::Tally& tally = radar.tally();
  std::printf("%d accepted, %d rejected, %d times out of a gate that had shut\n",
              static_cast<int>(tally.accepted), static_cast<int>(tally.rejected),
              static_cast<int>(tally.recovered));
  return std::abs(filter.x()(0) - truth(0)) < 10 && tally.recovered == 1 ? 0 : 1;
}
