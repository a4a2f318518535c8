// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the sensor's measurement(x) does not accept this model's state: check its size and scalar
#include "parts.hpp"

namespace plain_sensor_of_other_states {

#ifdef MISTAKE
constexpr int states = 3;
#else
constexpr int states = 2;
#endif

struct Sensor {
  static constexpr int measurements = 1;
  parts::Vector1 measurement(const jml::Vector<double, states>& x) const { return parts::Vector1(x(0)); }
  jml::Matrix<double, 1, 2> measurement_jacobian(const parts::Vector2&) const { return {1, 0}; }
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(1); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace plain_sensor_of_other_states
