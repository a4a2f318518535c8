// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the bounds are of another size than the model: jml::Bounds<states, disturbances>
#include "parts.hpp"

namespace bounds_of_other_size {

#ifdef MISTAKE
using Box = jml::Bounds<3>;
#else
using Box = jml::Bounds<2>;
#endif

inline bool run() {
  jml::Filter filter{jml::Bounded{jml::FixedLag<3>{}, Box{}}, parts::Model{}, jml::sensors<parts::Sensor>,
                     parts::start};
  return jml::usable(filter.predict());
}

}  // namespace bounds_of_other_size
