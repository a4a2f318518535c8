// SPDX-License-Identifier: BSD-3-Clause
// The first filter: two small structs, and the paper's estimator runs on them.
#include <cmath>
#include <cstdio>
// clang-format off
// [model]
#include <jml/jml.hpp>

struct VanDerPol {                                        // x⁺ = f(x) + G w, a step of 50 ms; x: position, velocity
  static constexpr int states = 2, disturbances = 1;
  template <typename T> jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + 0.05 * x(1), x(1) - 0.05 * (x(0) + 0.2 * (x(0) * x(0) - 1.0) * x(1))};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 0.05}; }                              // G
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(20.0); }   // Q, per step
};

struct SaturatingPosition {                               // y = m(x) + v
  static constexpr int measurements = 1;
  template <typename T> jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;                                      // not std::sqrt(…): T is double or a dual number
    return jml::Vector<T, 1>(x(0) / sqrt(1.0 + x(0) * x(0)));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.02); }         // R
};
// [/model]

int main() {
  // [use]
  const jml::Vector<double, 2> x0(1, 0);
  const jml::Matrix<double, 2, 2> P0 = 0.1 * jml::Matrix<double, 2, 2>::Identity();
  jml::Filter filter{jml::IteratedJml{}, VanDerPol{}, jml::Estimate{x0, P0}};   // or jml::Ekf{}, jml::Sddre{}, jml::Jml{} …
  const auto report = filter.step(SaturatingPosition{}, 0.7);                   // predict and correct together
  if (!jml::usable(report.status)) std::puts(jml::describe(report.status));     // filter.x(), filter.P(), time as before
  // [/use]
  // clang-format on

  for (int i = 1; i <= 5; ++i) {
    const auto next = filter.step(SaturatingPosition{}, 0.7 * std::cos(0.05 * i));
    if (!jml::usable(next.status)) {
      std::printf("step %d: %s\n", i, jml::describe(next.status));
      return 1;
    }
    std::printf("step %d: x = (%.4f, %.4f), NIS %.3f, %s, %d iterations\n", i, filter.x()(0), filter.x()(1),
                next.nis(), jml::describe(next.solver), next.iterations);
  }
  return jml::usable(report.status) ? 0 : 1;
}
