// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: Kalman is for linear models: say `static constexpr bool linear = true;` in it, or use Ekf
#include "parts.hpp"

namespace kalman_on_nonlinear_sensor {

struct Model : parts::Model {
  static constexpr bool linear = true;
};
struct Sensor : parts::Sensor {
#ifndef MISTAKE
  static constexpr bool linear = true;
#endif
};

inline bool run() {
  jml::Filter filter{jml::Kalman{}, Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace kalman_on_nonlinear_sensor
