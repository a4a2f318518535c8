// SPDX-License-Identifier: BSD-3-Clause
// A model in which everything is read that a filter carries beside its belief: time, dt and control in the
// dynamics and in a sensor, noise that follows them; and a sensor that has a number of its own.
#pragma once

#include "flights.hpp"

namespace flights {

template <typename T, typename At>
Vector<T, 2> pushed_slope(const Vector<T, 2>& x, const At& at) {
  return {x(1), -1.0 * x(0) - 0.3 * x(1) - 0.1 * x(0) * x(0) * x(0) + double(at.control(0)) +
                    0.1 * std::sin(at.time)};
}
struct Pushed {
  static constexpr int states = 2, controls = 1, disturbances = 1;
  template <typename T, typename At>
  Vector<T, 2> dynamics(const Vector<T, 2>& x, const At& at) const {
    const Vector<T, 2> slope = pushed_slope(x, at);
    const double dt = at.dt;
    return {x(0) + dt * slope(0), x(1) + dt * slope(1)};
  }
  template <typename At>
  Matrix<double, 2, 1> disturbance_input(const Vector<double, 2>&, const At& at) const {
    return {0.0, at.dt};
  }
  Matrix<double, 1, 1> disturbance_covariance() const { return Matrix<double, 1, 1>(0.4); }
  Vector<double, 1> disturbance_bound() const { return Vector<double, 1>(0.5); }
};
/// The same without what an enclosure cannot take: G of the state.
struct Driven : Pushed {
  static Matrix<double, 2, 1> disturbance_input() { return {0.0, 0.1}; }
};
struct Flowing {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, controls = 1, disturbances = 1;
  template <typename T, typename At>
  Vector<T, 2> dynamics(const Vector<T, 2>& x, const At& at) const {
    return pushed_slope(x, at);
  }
  Matrix<double, 2, 1> disturbance_input() const { return {0.0, 1.0}; }
  Matrix<double, 1, 1> disturbance_spectral_density() const { return Matrix<double, 1, 1>(0.4); }
};
struct LinearPushed {
  static constexpr int states = 2, controls = 1, disturbances = 1;
  static constexpr bool linear = true;
  template <typename T, typename At>
  Vector<T, 2> dynamics(const Vector<T, 2>& x, const At& at) const {
    const double dt = at.dt;
    return {x(0) + dt * x(1), x(1) - dt * x(0) + dt * double(at.control(0))};
  }
  Matrix<double, 2, 1> disturbance_input() const { return {0.0, 0.1}; }
  Matrix<double, 1, 1> disturbance_covariance() const { return Matrix<double, 1, 1>(0.4); }
};
/// Sees x and what the control adds; σ, m, is each sensor's own.
struct Seen {
  static constexpr int measurements = 2;
  double sigma = 0.1, offset = 0;
  template <typename T, typename At>
  Vector<T, 2> measurement(const Vector<T, 2>& x, const At& at) const {
    return {x(0) + 0.05 * x(0) * x(0) + offset + 0.1 * double(at.control(0)), x(1) + 0.2 * x(0)};
  }
  Matrix<double, 2, 2> noise_covariance() const {
    Matrix<double, 2, 2> R;
    R << sigma * sigma, 0.3 * sigma * sigma, 0.3 * sigma * sigma, sigma * sigma;
    return R;
  }
  Vector<double, 2> noise_bound() const { return {3 * sigma, 3 * sigma}; }
};
struct LinearSeen {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  double sigma = 0.1;
  template <typename T, typename At>
  Vector<T, 2> measurement(const Vector<T, 2>& x, const At& at) const {
    return {x(0) + 0.1 * double(at.control(0)), x(1) + 0.2 * x(0)};
  }
  Matrix<double, 2, 2> noise_covariance() const { return sigma * sigma * Matrix<double, 2, 2>::Identity(); }
};
struct SeenAlways {
  static constexpr int measurements = 1;
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 2>& x) const {
    return Vector<T, 1>(x(0) + 0.05 * x(0) * x(0));
  }
  Matrix<double, 1, 1> noise_spectral_density() const { return Matrix<double, 1, 1>(0.02); }
};

inline jml::Estimate<double, 2> pushed_start() {
  return {{0.8, 0.3}, (Matrix<double, 2, 2>() << 0.2, 0.05, 0.05, 0.1).finished()};
}
template <typename S>
Vector<double, 2> pushed_y(const S& sensor, int k, Draw& draw) {
  const Vector<double, 2> x(std::cos(0.1 * k), -std::sin(0.1 * k));
  const jml::StepContext<double, 1> at{};
  Vector<double, 2> y = sensor.measurement(x, at);
  for (int i = 0; i < 2; ++i) y(i) += draw.uniform(-1, 1) * sensor.sigma;
  return y;
}

/// One verb of any method on Pushed and its like. `fine`: σ of one row now and then, by which one direction
/// is known far better than another, so that a belief keeps more digits than double has.
template <typename S, typename Filter>
void push(Filter& filter, std::uint64_t seed, int k, Trace& trace, double fine = 1e-7) {
  Draw draw(seed, k);
  S sensor;
  sensor.sigma = draw.uniform(0.05, 0.2);
  if constexpr (requires { sensor.offset; }) sensor.offset = draw.uniform(-0.1, 0.1);
  const double dt = draw.uniform(0.05, 0.15);
  const double control = draw.uniform(-1, 1);
  const int verb = draw.below(12);
  if (verb == 7 || (verb == 6 && fine < 1e-8)) sensor.sigma = fine;
  Vector<double, 2> y = pushed_y(sensor, k, draw);
  const Vector<double, 1> u(control);
  if (verb < 5) {
    trace.see_report(filter.step(sensor, y, dt, u));
  } else if (verb == 5) {
    trace.add(filter.predict(dt, u));
  } else if (verb == 6) {
    trace.see_report(filter.update(sensor, y));
  } else if (verb == 7) {
    trace.see_report(filter.update(sensor, y, jml::only(1)));
  } else if (verb == 8) {
    trace.see_report(filter.update(sensor, y, jml::age(1 + draw.below(3))));
  } else if (verb == 9) {
    trace.see_report(filter.update(sensor, y, jml::at_time(filter.time() - draw.uniform(0, 0.3))));
  } else if (verb == 10) {
    filter.gate = {draw.below(2) == 0 ? 1 : 0.99};
    trace.see_report(filter.step(sensor, y, jml::at_time(filter.time() + dt), u));
  } else {
    y(1) = std::numeric_limits<double>::quiet_NaN();
    trace.see_report(filter.step(sensor, y, dt, u));
  }
}

}  // namespace flights
