// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a pointer in place of the sensor: give the sensor itself, *sensor
#include "parts.hpp"

namespace pointer_to_sensor {

inline bool run() {
  const parts::Sensor sensor;
  const parts::Sensor* there = &sensor;
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
#ifdef MISTAKE
  return jml::usable(filter.step(there, 1.0).status);
#else
  return jml::usable(filter.step(*there, 1.0).status);
#endif
}

}  // namespace pointer_to_sensor
