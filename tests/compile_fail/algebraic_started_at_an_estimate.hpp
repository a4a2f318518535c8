// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: an algebraic filter starts at a state, a jml::Vector of `states` entries
#include <jml/continuous/algebraic.hpp>

#include "continuous_parts.hpp"

namespace algebraic_started_at_an_estimate {

inline bool run() {
#ifdef MISTAKE
  const auto& start = parts::start;
#else
  const auto& start = parts::start.x;
#endif
  jml::Filter filter{jml::Algebraic{jml::Sddre{}}, parts::Flow{}, start};
  return jml::usable(filter.predict(0.1));
}

}  // namespace algebraic_started_at_an_estimate
