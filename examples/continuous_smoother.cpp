// SPDX-License-Identifier: BSD-3-Clause
// The trajectory of least J given y(t) over a whole flight, in continuous time; and the RNLS filter, swept
// along its own smoothed trajectory until it stays, which ends at the same point.
#include <cmath>
#include <cstdio>
#include <jml/continuous/continuous.hpp>
#include <jml/continuous/swept.hpp>

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
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(1e-2); }
};

int main() {
  const jml::Estimate prior{jml::Vector<double, 2>(1, 1),
                            jml::Matrix<double, 2, 2>(0.5 * jml::Matrix<double, 2, 2>::Identity())};
  jml::Filter filter{jml::Continuous{jml::Rnls{}}, VanDerPol{}, prior};
  // [smoother]
  jml::TwoPoint smoother{VanDerPol{}, SaturatingPosition{}, prior, {.steps = 300}};
  // [/smoother]
  const auto y = [](double t) { return 0.8 * std::cos(t) + 0.02 * std::sin(17 * t); };
  for (int i = 0; i < 300; ++i) {
    (void)filter.step(SaturatingPosition{}, y, 0.01);
    (void)smoother.step(y, 0.01);
  }
  // [solve]
  const auto least = smoother.solve();
  const jml::Vector<double, 2> end = smoother.x();
  const auto excess = jml::excess_cost(smoother, filter.x());
  const auto swept = jml::sweep(smoother, jml::Rnls{});
  // [/solve]
  std::printf("least J %.9f after %d passes; the RNLS filter ends %.1e above it\n", least.cost,
              least.iterations, excess.value);
  std::printf("swept %d times it ends at (%.9f, %.9f), the optimum is (%.9f, %.9f)\n", swept.sweeps,
              smoother.x()(0), smoother.x()(1), end(0), end(1));
  const double off = std::abs(smoother.x()(0) - end(0)) + std::abs(smoother.x()(1) - end(1));
  return usable(least.status) && usable(swept.status) && usable(excess.status) && off < 1e-8 ? 0 : 1;
}
