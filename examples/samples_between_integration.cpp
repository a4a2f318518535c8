// SPDX-License-Identifier: BSD-3-Clause
// Continuous dynamics, discrete measurements at two rates: a body falling through air. The differential
// equation carries the estimate from sample to sample, and a sensor that has a covariance corrects it there.
#include <cmath>
#include <cstdio>
#include <jml/continuous/continuous.hpp>
#include <jml/riccati/davison_maki.hpp>

struct Fall {  // x: height m, speed m/s, upwards; drag 0.002/m
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1), -9.81 + 0.002 * x(1) * x(1)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(0.01); }
};

template <int component>
struct Sample {  // of one state
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
  const Sample<0> altimeter{25.0};  // ten times a second, m²
  const Sample<1> doppler{0.25};    // once a second, (m/s)²
  const jml::Vector<double, 2> x0(1000, 0);
  const jml::Matrix<double, 2, 2> P0 = 400 * jml::Matrix<double, 2, 2>::Identity();
  jml::Filter filter{jml::Continuous{jml::Ekf{}, jml::DavisonMaki{.substeps = 2}}, Fall{},
                     jml::Estimate{x0, P0}};

  // From 1010 m at rest: v = -V tanh(g t / V), h = 1010 - V²/g ln cosh(g t / V), V² = g / drag.
  const double terminal = std::sqrt(9.81 / 0.002);
  bool sound = true;
  for (int i = 1; i <= 80; ++i) {
    const double t = 0.1 * i,
                 height = 1010 - terminal * terminal / 9.81 * std::log(std::cosh(9.81 * t / terminal));
    const double wobble = 5 * std::sin(2.4 * i);  // stands for noise
    const auto fall = filter.step(altimeter, height + wobble, 0.1);
    sound &= jml::usable(fall.status);
    if (i % 10 != 0) continue;
    const double speed = -terminal * std::tanh(9.81 * t / terminal);
    sound &= jml::usable(filter.update(doppler, speed + 0.1 * wobble).status);
    const double height_error = filter.x()(0) - height, speed_error = filter.x()(1) - speed;
    std::printf("t = %.0f s: height %6.1f m (%+.2f), speed %6.2f m/s (%+.2f)\n", filter.time(), filter.x()(0),
                height_error, filter.x()(1), speed_error);
    sound &= std::abs(height_error) < 3 * std::sqrt(filter.P()(0, 0)) &&
             std::abs(speed_error) < 3 * std::sqrt(filter.P()(1, 1));
  }
  sound &= jml::usable(filter.predict(0.5));  // and on without a measurement
  std::printf("t = %.1f s: height %6.1f m, ± %.1f\n", filter.time(), filter.x()(0),
              std::sqrt(filter.P()(0, 0)));
  return sound ? 0 : 1;
}
