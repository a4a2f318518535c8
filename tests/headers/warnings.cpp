// SPDX-License-Identifier: BSD-3-Clause
// What a project compiles that asks its compiler for every warning, and has the headers of jml as ordinary
// ones: a step of several methods, read and not optimised. Every method: the tests warnings.* of a night.
#include <jml/jml.hpp>

struct VanDerPol {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + 0.05 * x(1), x(1) - 0.05 * (x(0) + 0.2 * (x(0) * x(0) - 1.0) * x(1))};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 0.05}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(20.0); }
  jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(4.0); }
};

struct SaturatingPosition {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0 + x(0) * x(0)));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.02); }
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(0.2); }
};

template <typename Filter>
bool steps(Filter filter) {
  return jml::usable(filter.step(SaturatingPosition{}, 0.7).status) &&
         jml::usable(filter.update(SaturatingPosition{}, 0.7).status);
}

int main() {
  const jml::Estimate<double, 2> start{jml::Vector<double, 2>(1, 0),
                                       0.1 * jml::Matrix<double, 2, 2>::Identity()};
  const jml::Box<double, 2> box{jml::Vector<double, 2>(0, -1), jml::Vector<double, 2>(2, 1)};
  const jml::FixedLag<2> lag{};
  return steps(jml::Filter{jml::Ekf{}, VanDerPol{}, start}) &&
                 steps(jml::Filter{jml::Factored{jml::Ekf{}}, VanDerPol{}, start}) &&
                 steps(jml::Filter{jml::IteratedJml{}, VanDerPol{}, start}) &&
                 steps(jml::Filter{lag, VanDerPol{}, jml::sensors<SaturatingPosition>, start}) &&
                 steps(jml::Filter{jml::Guaranteed{}, VanDerPol{}, box})
             ? 0
             : 1;
}
