// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: P has the size of the degrees of freedom, not of the numbers of a state
#include "space_parts.hpp"

namespace covariance_of_the_numbers_in_batch {

#ifdef MISTAKE
constexpr int degrees = 4;
#else
constexpr int degrees = 3;
#endif

inline bool run() {
  const jml::Estimate<double, 4, degrees> start;
  jml::Batch batch{space_parts::Attitude{}, jml::sensors<space_parts::Sensor>, start, {.steps = 3}};
  return jml::usable(batch.solve().status);
}

}  // namespace covariance_of_the_numbers_in_batch
