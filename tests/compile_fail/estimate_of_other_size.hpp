// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the estimate has not as many states as the dynamics
#include "parts.hpp"

namespace estimate_of_other_size {

#ifdef MISTAKE
constexpr int states = 3;
#else
constexpr int states = 2;
#endif

inline bool run() {
  const jml::Estimate<double, states> start;
  jml::Filter filter{jml::Ekf{}, parts::Model{}, start};
  return jml::usable(filter.step(parts::Sensor{}, 1.0).status);
}

}  // namespace estimate_of_other_size
