// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: bounds are of states in ℝⁿ with additive disturbances
#include "space_parts.hpp"

namespace bounds_in_a_space {

#ifdef MISTAKE
using Method = jml::Bounded<jml::FixedLag<3>, jml::Bounds<3>>;
#else
using Method = jml::FixedLag<3>;
#endif

inline bool run() {
  const Method method = [] {
#ifdef MISTAKE
    return jml::Bounded{jml::FixedLag<3>{}, jml::Bounds<3>{}};
#else
    return jml::FixedLag<3>{};
#endif
  }();
  jml::Filter filter{method, space_parts::Attitude{}, jml::sensors<space_parts::Sensor>, space_parts::start};
  return jml::usable(filter.predict());
}

}  // namespace bounds_in_a_space
