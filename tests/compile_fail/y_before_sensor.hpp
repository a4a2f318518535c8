// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a sensor needs `static constexpr int measurements`
#include "parts.hpp"

namespace y_before_sensor {

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
#ifdef MISTAKE
  return jml::usable(filter.step(1.0, parts::Sensor{}).status);
#else
  return jml::usable(filter.step(parts::Sensor{}, 1.0).status);
#endif
}

}  // namespace y_before_sensor
