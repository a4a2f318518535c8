// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the estimate has not as many states as the dynamics
#include "continuous_parts.hpp"

namespace estimate_of_other_size_in_continuous_filter {

#ifdef MISTAKE
constexpr int states = 3;
#else
constexpr int states = 2;
#endif

inline bool run() {
  const jml::Estimate<double, states> start;
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, parts::Flow{}, start};
  return jml::usable(filter.step(parts::Signal{}, 1.0, 0.1).status);
}

}  // namespace estimate_of_other_size_in_continuous_filter
