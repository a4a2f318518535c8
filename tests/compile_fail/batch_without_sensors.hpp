// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a batch makes room for measurements: name the types of the sensors
#include <jml/interval/batch.hpp>

#include "parts.hpp"

namespace batch_without_sensors {

inline bool run() {
#ifdef MISTAKE
  jml::Batch batch{parts::Model{}, parts::start, jml::Capacity{3}};
#else
  jml::Batch batch{parts::Model{}, jml::sensors<parts::Sensor>, parts::start, jml::Capacity{3}};
#endif
  return jml::usable(batch.predict());
}

}  // namespace batch_without_sensors
