// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the box has not as many states as the dynamics
#include "parts.hpp"

namespace box_of_other_size {

inline bool run() {
#ifdef MISTAKE
  const jml::Box<double, 3> box;
#else
  const jml::Box<double, 2> box;
#endif
  const jml::Filter filter{jml::Linearised{}, parts::Pushed{}, box};
  return jml::usable(filter.status());
}

}  // namespace box_of_other_size
