// SPDX-License-Identifier: BSD-3-Clause
// Models: a pendulum with control in discrete and in continuous time, a sensor of an angle, and types of
// another library that cannot be edited.
#include <array>
#include <cmath>
#include <cstdio>
#include <jml/jml.hpp>
#include <jml/model/discretize.hpp>
#include <numbers>

// [pendulum]
struct Pendulum {  // x: angle rad, rate rad/s; control: torque over inertia, rad/s²
  static constexpr int states = 2, disturbances = 1, controls = 1;
  double length = 1.2, damping = 0.1;  // m, 1/s

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    using std::sin;
    const T rate = x(1) + at.dt * (at.control(0) - 9.81 / length * sin(x(0)) - damping * x(1));
    return {x(0) + at.dt * rate, rate};
  }
  jml::Matrix<double, 2, 1> disturbance_input(const auto&, const auto& at) const {
    return {at.dt * at.dt, at.dt};
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.04); }
};

struct Encoder {  // y: angle rad
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  template <typename T>
  jml::Vector<T, 1> residual(const jml::Vector<T, 1>& y, const jml::Vector<T, 1>& predicted) const {
    using std::remainder;
    return jml::Vector<T, 1>(remainder(y(0) - predicted(0), T(2 * std::numbers::pi)));  // the short way round
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(1e-4); }
};
// [/pendulum]

// [continuous_pendulum]
struct ContinuousPendulum {  // ẋ = f(x, u) + G w
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1, controls = 1;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    using std::sin;
    return {x(1), at.control(0) - 9.81 / 1.2 * sin(x(0)) - 0.1 * x(1)};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const {  // (rad/s²)²/Hz
    return jml::Matrix<double, 1, 1>(0.0008);
  }
};
// [/continuous_pendulum]

// [theirs]
namespace theirs {  // not ours to edit

struct Spring {
  double stiffness = 4, damping = 0.3;
  template <typename Real>
  std::array<Real, 2> advance(Real position, Real velocity, double dt) const {
    const Real next = velocity - dt * (stiffness * position + damping * velocity);
    return {position + dt * next, next};
  }
};
struct Gauge {
  double offset = 0.2, sigma = 0.05;
  double read(double position) const { return position * position * position + offset; }
};

}  // namespace theirs
// [/theirs]

// [traits]
template <>
struct jml::DynamicsTraits<theirs::Spring> : jml::DynamicsDefaults {
  static constexpr int states = 2, disturbances = 1;

  template <typename T>
  static jml::Vector<T, 2> dynamics(const theirs::Spring& spring, const jml::Vector<T, 2>& x,
                                    const auto& at) {
    const auto next = spring.advance(x(0), x(1), at.dt);
    return {next[0], next[1]};
  }
  static jml::Matrix<double, 2, 1> disturbance_input(const theirs::Spring&) { return {0, 0.1}; }
  static jml::Matrix<double, 1, 1> disturbance_covariance(const theirs::Spring&) {
    return jml::Matrix<double, 1, 1>(0.5);
  }
};

template <>
struct jml::SensorTraits<theirs::Gauge> : jml::SensorDefaults {
  static constexpr int measurements = 1;

  static jml::Vector<double, 1> measurement(const theirs::Gauge& gauge, const jml::Vector<double, 2>& x) {
    return jml::Vector<double, 1>(gauge.read(x(0)));  // double alone: nothing can be derived …
  }
  static jml::Matrix<double, 1, 2> jacobian(const theirs::Gauge&, const jml::Vector<double, 2>& x) {
    return {3 * x(0) * x(0), 0};  // … so it is given
  }
  static jml::Matrix<double, 1, 1> noise_covariance(const theirs::Gauge& gauge) {
    return jml::Matrix<double, 1, 1>(gauge.sigma * gauge.sigma);
  }
};
// [/traits]

int main() {
  const jml::Vector<double, 2> x0(0.3, 0);
  const jml::Matrix<double, 2, 2> P0 = 0.1 * jml::Matrix<double, 2, 2>::Identity();
  const double dt = 0.02;

  // [step]
  jml::Filter filter{jml::Ekf{}, Pendulum{.length = 1.2, .damping = 0.1}, jml::Estimate{x0, P0}};
  const auto report = filter.step(Encoder{}, 0.31, dt, 1.5);  // y, dt, and the control held over dt
  const jml::Status status = filter.predict(dt, 1.5);         // no measurement this time
  // [/step]

  // [discretize]
  jml::Filter second{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(ContinuousPendulum{}),
                     jml::Estimate{x0, P0}};
  // [/discretize]
  bool sound = jml::usable(report.status) && jml::usable(status);
  for (const double y : {0.31, 0.31 + 2 * std::numbers::pi})
    sound &= jml::usable(second.step(Encoder{}, y, dt, 1.5).status);
  std::printf("discrete    (%.5f, %.5f)\ncontinuous  (%.5f, %.5f)\n", filter.x()(0), filter.x()(1),
              second.x()(0), second.x()(1));

  // [foreign_filter]
  jml::Filter of_theirs{jml::Ekf{}, theirs::Spring{.stiffness = 4}, jml::Estimate{x0, P0}};
  const auto answer = of_theirs.step(theirs::Gauge{}, 0.25, dt);
  // [/foreign_filter]
  std::printf("theirs      (%.5f, %.5f)\n", of_theirs.x()(0), of_theirs.x()(1));
  const auto check =
      jml::check_model(theirs::Spring{}, x0, jml::ContextOf<theirs::Spring>{.time = 0, .dt = dt});
  check.print([](const char* line) { std::puts(line); });
  return sound && jml::usable(answer.status) && check.ok() && std::abs(second.x()(0)) < 1 ? 0 : 1;
}
