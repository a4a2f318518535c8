// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a fixed lag makes room for measurements: name the sensors
#include "parts.hpp"

namespace fixed_lag_without_sensors {

inline bool run() {
#ifdef MISTAKE
  jml::Filter filter{jml::FixedLag<3>{}, parts::Model{}, parts::start};
#else
  jml::Filter filter{jml::FixedLag<3>{}, parts::Model{}, jml::sensors<parts::Sensor>, parts::start};
#endif
  return jml::usable(filter.predict());
}

}  // namespace fixed_lag_without_sensors
