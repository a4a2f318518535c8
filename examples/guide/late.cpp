// SPDX-License-Identifier: BSD-3-Clause
// Measurements that arrive late, or out of order: a filter that remembers its last steps takes each at the
// time at which it was taken. Against a Kalman filter that was given everything in time.
#include <cmath>
#include <cstdio>
#include <jml/jml.hpp>

// [model]
struct Car {  // x: position m, speed m/s; its functions read dt, so that a step may be cut in two
  static constexpr int states = 2;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(0) + at.dt * x(1), x(1)};
  }
  jml::Matrix<double, 2, 2> disturbance_covariance(const auto&,
                                                   const auto& at) const {  // of a white acceleration
    const double t = at.dt;
    jml::Matrix<double, 2, 2> Q;
    Q << t * t * t / 3, t * t / 2, t * t / 2, t;
    return Q;
  }
};
template <int component>
struct Reading {  // of one state
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double variance = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(component));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(variance); }
};
// [/model]

int main() {
  const jml::Matrix<double, 2, 2> P0 = 10 * jml::Matrix<double, 2, 2>::Identity();
  const jml::Estimate start{jml::Vector<double, 2>(0, 0), P0};
  // [filter]
  using Camera = Reading<0>;
  using Wheel = Reading<1>;
  jml::Filter filter{jml::FixedLag<20>{}, Car{}, jml::sensors<Camera, Wheel>, start};  // remembers 20 steps
  // [/filter]
  jml::Filter in_time{jml::Kalman{}, Car{}, start};
  const Camera camera{.variance = 4};
  const Wheel wheel{.variance = 0.01};

  bool sound = true;
  for (int k = 1; k <= 10; ++k) {
    const double t = 0.1 * k, speed = 1 + 0.1 * std::sin(3 * t);
    sound &= jml::usable(filter.step(wheel, speed, jml::at_time(t)).status);
    if (k == 6) sound &= jml::usable(in_time.step(camera, 0.7, jml::at_time(0.53)).status);
    sound &= jml::usable(in_time.step(wheel, speed, jml::at_time(t)).status);
    if (k == 7) sound &= jml::usable(in_time.update(camera, 0.9).status);
  }
  // [late]
  const auto late = filter.update(camera, 0.9, jml::age(3));             // taken three steps ago
  const auto later = filter.update(camera, 0.7, jml::at_time(0.53));     // taken at 0.53 s, between two steps
  const auto too_late = filter.update(camera, 0.1, jml::at_time(-0.4));  // Status::older_than_window
  // [/late]
  const jml::Vector<double, 2> difference = filter.x() - in_time.x();
  std::printf("position %.4f m, ± %.4f; given in time it is %.4f\n", filter.x()(0),
              std::sqrt(filter.P()(0, 0)), in_time.x()(0));
  std::printf("too late: %s\n", jml::describe(too_late.status));
  sound &= jml::usable(late.status) && jml::usable(later.status) && difference.norm() < 1e-9;
  return sound && too_late.status == jml::Status::older_than_window ? 0 : 1;
}
