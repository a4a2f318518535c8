// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: over states in a space the SDC matrices are about the origin of the space
#include "space_parts.hpp"

namespace sdc_about_a_point_in_a_space {

#ifdef MISTAKE
const jml::Sddre rule{jml::AboutPoint{space_parts::Vector3(0, 0, 0)}};
#else
const jml::Sddre<> rule;
#endif

inline bool run() {
  jml::Filter filter{rule, space_parts::Attitude{}, space_parts::start};
  return filter.predict() == jml::Status::ok;
}

}  // namespace sdc_about_a_point_in_a_space
