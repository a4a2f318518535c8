// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: Bounded{…} takes a FixedLag; for a batch there is BoundedBatch
#include "parts.hpp"

namespace bounds_of_an_ekf {

inline bool run() {
#ifdef MISTAKE
  jml::Filter filter{jml::Bounded{jml::Ekf{}, jml::Bounds<2>{}}, parts::Model{}, parts::start};
#else
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
#endif
  return jml::usable(filter.predict());
}

}  // namespace bounds_of_an_ekf
