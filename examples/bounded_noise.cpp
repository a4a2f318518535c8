// SPDX-License-Identifier: BSD-3-Clause
// Nothing is known of the disturbance and the noise but their bounds, and the truth must be inside the
// answer.
//
// An undamped pendulum of which only the angle is measured. The linearised box of its rate grows without
// limit; the guaranteed one remembers how angle and rate move together, and stays.
#include <cstdio>
#include <jml/bounded/bounded_noise.hpp>
#include <jml/campaign/noise.hpp>

// [model]
struct Pendulum {
  static constexpr int states = 2, disturbances = 1;
  static constexpr double dt = 0.05;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    using std::sin;
    const T rate = x(1) - dt * 9.81 * sin(x(0));
    return {x(0) + dt * rate, rate};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {dt * dt, dt}; }
  jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(0.4); }  // rad/s²
};
// [/model]

// [sensor]
struct AngleSensor {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(0.05); }  // rad
};
// [/sensor]

int main() {
  // [filter]
  using State = jml::Vector<double, 2>;
  const jml::Box box{State(0.7, -0.3), State(1.3, 0.3)};
  jml::Filter linearised{jml::Linearised{}, Pendulum{}, box};
  jml::Filter guaranteed{jml::Guaranteed{}, Pendulum{}, box};
  // [/filter]

  jml::Noise noise(1);
  State truth(1, 0);
  int outside = 0;
  for (int k = 1; k <= 10000; ++k) {
    truth = Pendulum{}.dynamics(truth) + Pendulum{}.disturbance_input() * noise.uniform(-0.4, 0.4);
    const double y = truth(0) + noise.uniform(-0.05, 0.05);
    for (const auto& report : {linearised.step(AngleSensor{}, y), guaranteed.step(AngleSensor{}, y)}) {
      if (report.status != jml::Status::ok) std::puts(jml::describe(report.status));
    }
    outside += !guaranteed.box().contains(truth);
    if (k == 10 || k == 100 || k == 1000 || k == 10000) {
      std::printf("step %5d: width of the rate's box: linearised %7.2f, guaranteed %5.2f rad/s\n", k,
                  linearised.box().width()(1), guaranteed.box().width()(1));
    }
  }
  std::printf("truth outside the guaranteed box: %d times\n", outside);

  // The day the sensor lies: the measurement is named and left out, the box stays where it can be.
  // [lie]
  const auto lie = guaranteed.step(AngleSensor{}, truth(0) + 1);
  std::printf("a wrong angle: %s; by %.2f rad\n", jml::describe(lie.status), lie.violation.excess);
  // [/lie]
  return outside;
}
