// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the bounds are of another size than the model: jml::Bounds<states, disturbances>
#include "parts.hpp"

namespace bounds_of_other_size_in_batch {

#ifdef MISTAKE
using Box = jml::Bounds<2, 2>;
#else
using Box = jml::Bounds<2, 1>;
#endif

inline bool run() {
  jml::BoundedBatch batch{parts::Model{}, jml::sensors<parts::Sensor>, parts::start, {.steps = 3}, Box{}};
  return jml::usable(batch.solve().status);
}

}  // namespace bounds_of_other_size_in_batch
