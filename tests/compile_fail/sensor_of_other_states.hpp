// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the sensor's measurement(x) does not accept this model's state: check its size and scalar
#include "parts.hpp"

namespace sensor_of_other_states {

#ifdef MISTAKE
constexpr int states = 3;
#else
constexpr int states = 2;
#endif

struct Sensor {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, states>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(1); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace sensor_of_other_states
