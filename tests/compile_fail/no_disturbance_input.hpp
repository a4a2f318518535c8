// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the dynamics have fewer disturbances than states: give disturbance_input(), n×q
#include "parts.hpp"

namespace no_disturbance_input {

struct Model : parts::Functions {
  parts::Matrix1 disturbance_covariance() const { return parts::Matrix1(1); }
#ifndef MISTAKE
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, 1.0).status);
}

}  // namespace no_disturbance_input
