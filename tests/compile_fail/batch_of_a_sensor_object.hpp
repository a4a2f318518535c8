// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a batch makes room for measurements: name the types of the sensors
#include <jml/interval/batch.hpp>

#include "parts.hpp"

namespace batch_of_a_sensor_object {

inline bool run() {
#ifdef MISTAKE
  jml::Batch batch{parts::Model{}, parts::Sensor{}, parts::start, {3}};
#else
  jml::Batch batch{parts::Model{}, jml::sensors<parts::Sensor>, parts::start, {3}};
#endif
  return jml::usable(batch.predict());
}

}  // namespace batch_of_a_sensor_object
