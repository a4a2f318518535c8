// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A random walk and its Kalman filter in the steady state, whose errors have a closed law.
#pragma once

#include <jml/filter/filter.hpp>
#include <jml/campaign/campaign.hpp>

namespace walk {

using Number = jml::Matrix<double, 1, 1>;

/// x⁺ = x + w, Q = ½; y = x + v, R = 1: the prediction's variance M solves M² - ½ M - ½ = 0, M = 1, and P = ½
/// after each update.
struct Walk {
  static constexpr int states = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  Number disturbance_covariance() const { return Number(0.5); }
};
struct Position {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  Number noise_covariance() const { return Number(1.0); }
};
constexpr double P = 0.5;

struct Scenario {
  static constexpr int states = 1, measurements = 1;
  std::string name = "random walk";
  int steps = 5;
  double dt = 1;
  Position sensor{};
  /// The start is the filter's prior: 0 ± √P.
  void fly(jml::CounterNoise& noise, jml::Flight<1, 1>& flight) const {
    const jml::Vector<double, 1> start(std::sqrt(P) * noise.normal());
    jml::simulate(Walk{}, sensor, start, jml::GaussianNoise{}, jml::GaussianNoise{}, noise, flight);
  }
};

inline auto filter() {
  return jml::Filter{jml::Kalman{}, Walk{}, jml::Estimate{jml::Vector<double, 1>(0.0), Number(P)}};
}
inline auto kalman() {
  return jml::Estimator{"Kalman", [](const auto&) { return filter(); }};
}

/// The Kalman filter, but every step and prediction is refused from the first y above a bound on.
class Brittle {
 public:
  explicit Brittle(double bound) : bound_(bound) {}
  auto step(const Position& sensor, const Number& y, double dt) {
    broken_ |= y(0) > bound_;
    auto report = filter_.step(sensor, y, dt);
    if (broken_) report.status = jml::Status::not_converged;
    return report;
  }
  jml::Status predict(double dt) { return broken_ ? jml::Status::riccati_escape : filter_.predict(dt); }
  const jml::Vector<double, 1>& x() const { return filter_.x(); }
  const Number& P() const { return filter_.P(); }

 private:
  double bound_;
  bool broken_ = false;
  decltype(filter()) filter_ = filter();
};
inline auto brittle(double bound) {
  return jml::Estimator{"brittle", [bound](const auto&) { return Brittle(bound); }};
}

}  // namespace walk
