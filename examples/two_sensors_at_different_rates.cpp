// SPDX-License-Identifier: BSD-3-Clause
// Irregular samples of two sensors, a gate against outliers, and a model that reads dt: a car on a line.
#include <cstdio>
#include <jml/jml.hpp>

struct Car {  // x: position m, speed m/s; control: commanded acceleration m/s²
  static constexpr int states = 2, disturbances = 1, controls = 1;
  static constexpr bool linear = true;

  template <typename T, typename At>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const At& at) const {
    return {x(0) + at.dt * x(1), x(1) + at.dt * at.control(0)};
  }
  template <typename T, typename At>
  jml::Matrix<T, 2, 1> disturbance_input(const jml::Vector<T, 2>&, const At& at) const {
    return {0.5 * at.dt * at.dt, at.dt};
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.04); }
};

template <int component>
struct Reading {  // of one state
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double variance;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(component));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(variance); }
};

int main() {
  const Reading<0> position{4.0};
  const Reading<1> speed{0.01};
  const jml::Matrix<double, 2, 2> P0 = 100 * jml::Matrix<double, 2, 2>::Identity();
  // [filter]
  jml::Filter filter{jml::Kalman{}, Car{}, jml::Estimate{jml::Vector<double, 2>(0, 0), P0}};
  filter.gate = {0.999};
  // [/filter]

  const jml::Vector<double, 1> throttle(0.5);
  bool sound = true;
  for (int i = 1; i <= 20; ++i) {
    const double dt = i % 3 == 0 ? 0.15 : 0.1;
    sound &= jml::usable(filter.step(speed, 0.5 * (filter.time() + dt), dt, throttle).status);
    if (i % 5 != 0) continue;
    const double lie = i == 15 ? 300 : 0;  // a position fix now and then, and once a wrong one
    const auto report = filter.update(position, 0.25 * filter.time() * filter.time() + lie);
    sound &= jml::usable(report.status);
    std::printf("t = %.2f s: position %.2f m, speed %.2f m/s, innovation %.1f m %s\n", filter.time(),
                filter.x()(0), filter.x()(1), report.innovation(0),
                report.gate == jml::Verdict::rejected ? "rejected" : "used");
  }
  return sound ? 0 : 1;
}
