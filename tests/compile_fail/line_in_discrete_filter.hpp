// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a jml::Line or a function of time is what a continuous filter measures
#include "continuous_parts.hpp"

namespace line_in_discrete_filter {

inline bool run() {
#ifdef MISTAKE
  const jml::Line y{1.0, 2.0};
#else
  const double y = 2;
#endif
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, y, 0.1).status);
}

}  // namespace line_in_discrete_filter
