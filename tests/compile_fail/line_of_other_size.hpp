// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a vector or matrix of the wrong size is given: y has `measurements` entries, a control
// `controls`
#include "continuous_parts.hpp"

namespace line_of_other_size {

#ifdef MISTAKE
inline const jml::Line y{1.0, 2.0};
#else
inline const jml::Line y{parts::Vector2(1, 1), parts::Vector2(2, 2)};
#endif

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, parts::Flow{}, parts::start};
  return jml::usable(filter.step(parts::Signals{}, y, 0.1).status);
}

}  // namespace line_of_other_size
