// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a vector or matrix of the wrong size is given: y has `measurements` entries, a control
// `controls`
#include "parts.hpp"

namespace y_of_other_size {

#ifdef MISTAKE
inline const parts::Vector2 y(1, 1);
#else
inline const parts::Vector1 y(1.0);
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, y).status);
}

}  // namespace y_of_other_size
