// SPDX-License-Identifier: BSD-3-Clause
// The first filter: two small structs, and the paper's estimator runs on them.
#include <cmath>
#include <cstdio>
#include <jml/jml.hpp>

struct VanDerPol {  // x⁺ = f(x) + G w, one step of 50 ms; x: position, velocity
  static constexpr int states = 2, disturbances = 1;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + 0.05 * x(1), x(1) - 0.05 * (x(0) + 0.2 * (x(0) * x(0) - 1.0) * x(1))};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 0.05}; }                              // G
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(20.0); }  // Q, per step
};

struct SaturatingPosition {  // y = m(x) + v
  static constexpr int measurements = 1;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0 + x(0) * x(0)));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.02); }  // R
};

int main() {
  const jml::Vector<double, 2> x0(1, 0);
  const jml::Matrix<double, 2, 2> P0 = 0.1 * jml::Matrix<double, 2, 2>::Identity();
  jml::Filter filter{jml::IteratedJml{}, VanDerPol{}, jml::Estimate{x0, P0}};

  for (int i = 1; i <= 5; ++i) {
    const double y = 0.7 * std::cos(0.05 * i);
    const auto report = filter.step(SaturatingPosition{}, y);  // predict and correct together
    if (!jml::usable(report.status)) {
      std::printf("step %d: %s\n", i, jml::describe(report.status));
      return 1;
    }
    std::printf("step %d: x = (%.4f, %.4f), NIS %.3f, %s, %d iterations\n", i, filter.x()(0), filter.x()(1), report.nis(),
                jml::describe(report.solver), report.iterations);
  }
  return 0;
}
