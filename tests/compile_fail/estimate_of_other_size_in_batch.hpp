// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the estimate has not as many states as the dynamics
#include <jml/interval/batch.hpp>

#include "parts.hpp"

namespace estimate_of_other_size_in_batch {

#ifdef MISTAKE
constexpr int states = 3;
#else
constexpr int states = 2;
#endif

inline bool run() {
  const jml::Estimate<double, states> start;
  jml::Batch batch{parts::Model{}, jml::sensors<parts::Sensor>, start, {3}};
  return jml::usable(batch.predict());
}

}  // namespace estimate_of_other_size_in_batch
