// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: an iterated rule has no meaning in continuous time: take Ekf, Sddre, Rnls or Kalman
#include "continuous_parts.hpp"

namespace iterated_rule_in_continuous_filter {

#ifdef MISTAKE
using Rule = jml::IteratedJml<>;
#else
using Rule = jml::Rnls<>;
#endif

inline bool run() {
  jml::Filter filter{jml::Continuous{Rule{}}, parts::Flow{}, parts::start};
  return filter.status() == jml::Status::ok;
}

}  // namespace iterated_rule_in_continuous_filter
