// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this filter starts at an estimate: give it jml::Estimate{x, P}
#include "parts.hpp"

namespace start_at_a_box {

inline bool run() {
#ifdef MISTAKE
  const auto& start = parts::box;
#else
  const auto& start = parts::start;
#endif
  jml::Filter filter{jml::IteratedJml{}, parts::Model{}, start};
  return jml::usable(filter.predict());
}

}  // namespace start_at_a_box
