// SPDX-License-Identifier: BSD-3-Clause
// Continuous time: a pendulum with control under a sampled sensor, the algebraic filter, and questions to a
// SDC choice.
#include <cmath>
#include <cstdio>
#include <jml/continuous/algebraic.hpp>
#include <jml/continuous/continuous.hpp>
#include <jml/jml.hpp>

// [pendulum]
struct Pendulum {  // ẋ = f(x, u) + G w; x: angle rad, rate rad/s; u: rad/s²
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1, controls = 1;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    using std::sin;
    return {x(1), at.control(0) - 9.81 / 1.2 * sin(x(0)) - 0.1 * x(1)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(0.01); }
};

struct Encoder {  // a sample of the angle: noise_covariance()
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(1e-4); }
};
// [/pendulum]

// [oscillator]
struct Oscillator {  // ẋ = f(x) + G w
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(1), -0.1 * x(0) - 0.02 * (x(0) * x(0) - 1.0) * x(1)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }  // G
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const {
    return jml::Matrix<double, 1, 1>(1.0);
  }  // Q
};

struct Position {  // measured all the time: noise_spectral_density()
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(0.01); }  // R
};
// [/oscillator]

int main() {
  bool sound = true;
  {
    const jml::Vector<double, 2> x0(0.5, 0);
    const jml::Matrix<double, 2, 2> P0 = 0.1 * jml::Matrix<double, 2, 2>::Identity();
    // [sampled]
    jml::Filter filter{jml::Continuous{jml::Ekf{}}, Pendulum{}, jml::Estimate{x0, P0}};
    const auto report = filter.step(Encoder{}, 0.52, 0.02, 1.5);  // f over 0.02 s under u = 1.5; the sample
    const jml::Status status = filter.predict(0.02, 1.5);         // no sample
    // [/sampled]
    sound &= jml::usable(report.status) && jml::usable(status);
    std::printf("pendulum: angle %.4f, rate %.4f at %.2f s\n", filter.x()(0), filter.x()(1), filter.time());
  }
  const jml::Vector<double, 2> x0(1, 0);
  const jml::Matrix<double, 2, 2> P0 = jml::Matrix<double, 2, 2>::Identity();
  const double dt = 0.05, y = 1.1, y_next = 1.12;
  // [signals]
  jml::Filter filter{jml::Continuous{jml::Rnls{}, jml::DavisonMaki{}}, Oscillator{}, jml::Estimate{x0, P0}};
  const auto held = filter.step(Position{}, y, dt);                     // y held over dt
  const auto line = filter.step(Position{}, jml::Line{y, y_next}, dt);  // or interpolated
  const auto cosine = [](double t) { return 1.1 * std::cos(t); };
  const auto any = filter.step(Position{}, cosine, dt);  // or any function of time
  const jml::Status on = filter.predict(dt);             // no measurement
  // [/signals]
  sound &= jml::usable(held.status) && jml::usable(line.status) && jml::usable(any.status) && jml::usable(on);

  // [algebraic]
  jml::Filter steady{jml::Algebraic{jml::Sddre{}}, Oscillator{}, x0};  // a state, and no P
  const auto report = steady.step(Position{}, y, dt);                  // steady.P(): the solution there
  // [/algebraic]
  sound &= jml::usable(report.status);

  // [sdc]
  const auto sdc = jml::examine_sdc(Oscillator{}, Position{}, x0);
  if (sdc.observable_sdc.rank < 2) std::puts("(F, M) is not observable here");
  std::printf("F is off f_x by %.3f\n", sdc.dynamics_gap);
  // [/sdc]
  std::printf("RNLS (%.4f, %.4f), algebraic (%.4f, %.4f)\n", filter.x()(0), filter.x()(1), steady.x()(0),
              steady.x()(1));
  // F is f_x averaged from 0 to x: -0.02 (s² - 1) over 0 ≤ s ≤ 1 makes 0.04/3, where f_x has 0.
  const bool gap = std::abs(sdc.dynamics_gap - 0.04 / 3) < 1e-12;
  return sound && sdc.observable_sdc.rank == 2 && gap && steady.P()(0, 0) > 0 ? 0 : 1;
}
