// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: give the sensor a measurement_jacobian(x), or make measurement(x) a template
#include "parts.hpp"

namespace no_derivative_of_measurement {

struct Sensor {
  static constexpr int measurements = 1;
  parts::Vector1 measurement(const parts::Vector2& x) const { return parts::Vector1(x(0)); }
#ifndef MISTAKE
  jml::Matrix<double, 1, 2> measurement_jacobian(const parts::Vector2&) const { return {1, 0}; }
#endif
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(1); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace no_derivative_of_measurement
