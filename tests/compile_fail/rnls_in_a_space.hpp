// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: over states in a space (`Space`, `tangent`) a continuous filter takes Ekf
#include "space_parts.hpp"

namespace rnls_in_a_space {

#ifdef MISTAKE
using Rule = jml::Rnls<>;
#else
using Rule = jml::Ekf<>;
#endif

inline bool run() {
  jml::Filter filter{jml::Continuous{Rule{}}, space_parts::Turning{}, space_parts::start};
  return filter.predict(0.1) == jml::Status::ok;
}

}  // namespace rnls_in_a_space
