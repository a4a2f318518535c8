// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this sensor type is not in the estimator's list: add it to jml::sensors<...> (a sensor of which a part is measured now and then as jml::Part<...>)
#include <jml/interval/fixed_lag.hpp>

#include "parts.hpp"

namespace sensor_in_parts_not_in_list {

inline bool run() {
#ifdef MISTAKE
  jml::Filter filter{jml::FixedLag<3>{}, parts::Model{}, jml::sensors<parts::Sensor>, parts::start};
#else
  jml::Filter filter{jml::FixedLag<3>{}, parts::Model{}, jml::sensors<jml::Part<parts::Sensor>>, parts::start};
#endif
  return jml::usable(filter.update(parts::Sensor{}, 1.0, jml::only(0)).status);
}

}  // namespace sensor_in_parts_not_in_list
