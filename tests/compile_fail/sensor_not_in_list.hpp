// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this sensor type is not in the estimator's list: add it to jml::sensors<...>
#include <jml/interval/batch.hpp>

#include "parts.hpp"

namespace sensor_not_in_list {

struct Other : parts::Position {
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(2); }
};

inline bool run() {
#ifdef MISTAKE
  jml::Batch batch{parts::Model{}, jml::sensors<Other>, parts::start, {3}};
#else
  jml::Batch batch{parts::Model{}, jml::sensors<Other, parts::Sensor>, parts::start, {3}};
#endif
  return jml::usable(batch.step(parts::Sensor{}, 1.0));
}

}  // namespace sensor_not_in_list
