// SPDX-License-Identifier: BSD-3-Clause
// A filter in continuous time, RNLS: the model is a differential equation, Q and R are spectral densities,
// and y moves in a straight line from sample to sample. Held instead, it is half a sample old.
#include <cmath>
#include <cstdio>
#include <jml/continuous/continuous.hpp>

struct VanDerPol {  // x: position, velocity; ẋ = f(x) + G w
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1), -x(0) - 0.2 * (x(0) * x(0) - 1.0) * x(1)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(1.0); }
};

struct SaturatingPosition {  // y = m(x) + v, all the time
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0 + x(0) * x(0)));
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(1e-5); }
};

int main() {
  const jml::Vector<double, 2> x0(1, 1), truth(2, 0);
  const jml::Matrix<double, 2, 2> P0 = 1e-3 * jml::Matrix<double, 2, 2>::Identity();
  jml::Filter held{jml::Continuous{jml::Rnls{}}, VanDerPol{}, jml::Estimate{x0, P0}};
  jml::Filter line{jml::Continuous{jml::Rnls{}}, VanDerPol{}, jml::Estimate{x0, P0}};
  jml::Filter plant{jml::Continuous{jml::Ekf{}}, VanDerPol{},
                    jml::Estimate{truth, P0}};  // only ever predicts
  const SaturatingPosition sensor;

  const double dt = 0.01;
  for (int i = 0; i < 1000; ++i) {
    const auto y_before = sensor.measurement(plant.x());
    const jml::Status moved = plant.predict(dt);
    const auto y_after = sensor.measurement(plant.x());
    const auto a = held.step(sensor, y_before, dt);
    const auto b = line.step(sensor, jml::Line{y_before, y_after}, dt);
    for (const jml::Status status : {moved, a.status, b.status}) {
      if (status == jml::Status::ok) continue;
      std::puts(jml::describe(status));
      return 1;
    }
  }
  const double held_error = std::abs(held.x()(0) - plant.x()(0)),
               line_error = std::abs(line.x()(0) - plant.x()(0));
  std::printf("t = %.0f s: position %.4f, held %.4f, line %.6f\n", plant.time(), plant.x()(0), held.x()(0),
              line.x()(0));
  std::printf("P12 = %.6f, P21 = %.6f: no covariance\n", line.P()(0, 1), line.P()(1, 0));
  return line_error < 1e-4 && line_error < 0.1 * held_error ? 0 : 1;
}
