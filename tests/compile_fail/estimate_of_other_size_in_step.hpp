// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the estimate has not as many states as the dynamics
#include "parts.hpp"

namespace estimate_of_other_size_in_step {

#ifdef MISTAKE
constexpr int states = 3;
#else
constexpr int states = 2;
#endif

inline bool run() {
  const jml::Estimate<double, states> start;
  return jml::usable(jml::predict(jml::Ekf{}, parts::Model{}, start).status);
}

}  // namespace estimate_of_other_size_in_step
