// SPDX-License-Identifier: BSD-3-Clause
// Noise where it enters: a factor of the measurement, a disturbance inside the dynamics, and noise that is
// not white.
#include <cmath>
#include <cstdio>
#include <jml/jml.hpp>
#include <jml/model/coloured_noise.hpp>

// [model]
struct Growth {  // x⁺ = 1.02 x exp(w): it stays positive
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const jml::Vector<T, 1>& w) const {
    using std::exp;
    return jml::Vector<T, 1>(1.02 * x(0) * exp(w(0)));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(1e-3); }
};

struct Counter {  // y = x (1 + v₀) + v₁: an error of the scale, and one of the reading
  static constexpr int measurements = 1, noises = 2;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const jml::Vector<T, 2>& v) const {
    return jml::Vector<T, 1>(x(0) * (1.0 + v(0)) + v(1));
  }
  jml::Matrix<double, 2, 2> noise_covariance() const {
    return jml::Vector<double, 2>(0.01, 0.04).asDiagonal();
  }
};
// [/model]

// [coloured]
struct Drift {  // ξ⁺ = 0.95 ξ + η: what the sensor is off by
  static constexpr int states = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& xi) const {
    return jml::Vector<T, 1>(0.95 * xi(0));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.01); }
};
struct Scale {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.02); }
};
// [/coloured]

int main() {
  const jml::Matrix<double, 1, 1> P0(4.0);
  // [filter]
  jml::Filter filter{jml::Ekf{}, Growth{},
                     jml::Estimate{jml::Vector<double, 1>(10.0), P0}};  // or IteratedJml, FixedLag
  const auto report = filter.step(Counter{}, 11.5);
  // [/filter]

  // [coloured_filter]
  const jml::ColouredNoise plant{Growth{}, Drift{}};  // its states: (x, ξ)
  const jml::Matrix<double, 1, 1> C(1.0);             // y = m(x) + C ξ + v
  const auto scale = jml::with_coloured_noise(plant, Scale{}, C);
  jml::Filter coloured{jml::Ekf{}, plant,
                       jml::Estimate{jml::Vector<double, 2>(10, 0), jml::Matrix<double, 2, 2>::Identity()}};
  const auto second = coloured.step(scale, 11.5);
  // [/coloured_filter]
  std::printf("x = %.3f ± %.3f; with a drift %.3f ± %.3f, the drift %.3f\n", filter.x()(0),
              std::sqrt(filter.P()(0, 0)), coloured.x()(0), std::sqrt(coloured.P()(0, 0)), coloured.x()(1));
  const double S = report.innovation_matrix(0, 0), M = 1.02 * 1.02 * (4.0 + 100 * 1e-3), x = 10.2;
  const bool right = std::abs(S - (M + x * x * 0.01 + 0.04)) < 1e-9;  // m_v R m_vᵀ at the prediction
  return right && jml::usable(report.status) && jml::usable(second.status) && coloured.x()(1) > 0 ? 0 : 1;
}
