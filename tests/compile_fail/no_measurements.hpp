// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a sensor needs `static constexpr int measurements`
#include "parts.hpp"

namespace no_measurements {

struct Sensor {
#ifndef MISTAKE
  static constexpr int measurements = 1;
#endif
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(1); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace no_measurements
