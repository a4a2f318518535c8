// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this filter starts at a box: give it jml::Box{lower, upper}
#include "parts.hpp"

namespace box_started_at_an_estimate {

inline bool run() {
#ifdef MISTAKE
  const auto& start = parts::start;
#else
  const auto& start = parts::box;
#endif
  jml::Filter filter{jml::Linearised{}, parts::Pushed{}, start};
  return jml::usable(filter.predict());
}

}  // namespace box_started_at_an_estimate
