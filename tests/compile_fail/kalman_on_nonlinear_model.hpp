// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: Kalman is for linear models: say `static constexpr bool linear = true;` in it, or use Ekf
#include "parts.hpp"

namespace kalman_on_nonlinear_model {

struct Model : parts::Model {
#ifndef MISTAKE
  static constexpr bool linear = true;
#endif
};
struct Sensor : parts::Sensor {
  static constexpr bool linear = true;
};

inline bool run() {
  jml::Filter filter{jml::Kalman{}, Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace kalman_on_nonlinear_model
