// SPDX-License-Identifier: BSD-3-Clause
// A Jacobian with a wrong sign, found before the first flight.
#include <cmath>
#include <cstdio>
#include <jml/model/check.hpp>

// [model]
struct Pendulum {
  static constexpr int states = 2, disturbances = 1;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    using std::sin;
    return {x(0) + 0.01 * x(1), x(1) - 0.01 * 9.81 * sin(x(0))};
  }
  jml::Matrix<double, 2, 2> dynamics_jacobian(const jml::Vector<double, 2>& x) const {
    jml::Matrix<double, 2, 2> J;
    J << 1, 0.01, 0.01 * 9.81 * std::cos(x(0)), 1;  // should be -0.01 · 9.81 …
    return J;
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 0.01}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.1); }
};
// [/model]

int main() {
  // [check]
  const auto report = jml::check_model(Pendulum{}, jml::Vector<double, 2>(0.4, -1.2));
  report.print([](const char* line) { std::puts(line); });
  // [/check]
  return report.ok() ? 1 : 0;  // this model is meant to be found wrong
}
