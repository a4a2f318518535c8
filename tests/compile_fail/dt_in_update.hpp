// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: update(sensor, y, …) takes only(0, 2), first(k), finite_rows(y), at_time(t) or age(k), and
// no dt
#include "parts.hpp"

namespace dt_in_update {

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
#ifdef MISTAKE
  return jml::usable(filter.update(parts::Sensor{}, 1.0, 0.1).status);
#else
  return jml::usable(filter.update(parts::Sensor{}, 1.0, jml::age(0)).status);
#endif
}

}  // namespace dt_in_update
