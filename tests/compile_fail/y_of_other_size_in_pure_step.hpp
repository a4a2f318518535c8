// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a vector or matrix of the wrong size is given: y has `measurements` entries, a control
// `controls`
#include "parts.hpp"

namespace y_of_other_size_in_pure_step {

#ifdef MISTAKE
inline const parts::Vector2 y(1, 1);
#else
constexpr double y = 1;
#endif

inline bool run() {
  return jml::usable(jml::step(jml::Ekf{}, parts::Model{}, parts::Sensor{}, parts::start, y).report.status) &&
         jml::usable(jml::update(jml::Ekf{}, parts::Sensor{}, parts::start, y).report.status);
}

}  // namespace y_of_other_size_in_pure_step
