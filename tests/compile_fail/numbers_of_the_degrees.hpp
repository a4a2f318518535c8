// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the estimate has not as many numbers as a state of the dynamics
#include "space_parts.hpp"

namespace numbers_of_the_degrees {

#ifdef MISTAKE
constexpr int numbers = 3;
#else
constexpr int numbers = 4;
#endif

inline bool run() {
  const jml::Estimate<double, numbers, 3> start;
  jml::Filter filter{jml::Ekf{}, space_parts::Attitude{}, start};
  return filter.predict() == jml::Status::ok;
}

}  // namespace numbers_of_the_degrees
