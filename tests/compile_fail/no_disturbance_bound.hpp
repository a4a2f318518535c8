// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: bounded noise: dynamics with disturbances need disturbance_bound(), q
#include "parts.hpp"

namespace no_disturbance_bound {

#ifdef MISTAKE
using Model = parts::Model;
#else
using Model = parts::Pushed;
#endif

inline bool run() {
  jml::Filter filter{jml::Linearised{}, Model{}, parts::box};
  return jml::usable(filter.predict());
}

}  // namespace no_disturbance_bound
