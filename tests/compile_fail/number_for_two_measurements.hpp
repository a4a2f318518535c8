// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a single number for a vector or matrix of several entries
#include "continuous_parts.hpp"

namespace number_for_two_measurements {

#ifdef MISTAKE
constexpr double y = 1;
#else
inline const parts::Vector2 y(1, 1);
#endif

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, parts::Flow{}, parts::start};
  return jml::usable(filter.step(parts::Signals{}, y, 0.1).status);
}

}  // namespace number_for_two_measurements
