// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: Paved<parts>: a union has one box or more
#include "parts.hpp"

namespace paved_without_boxes {

inline bool run() {
#ifdef MISTAKE
  jml::Filter filter{jml::Paved<0>{}, parts::Pushed{}, parts::box};
#else
  jml::Filter filter{jml::Paved<2>{}, parts::Pushed{}, parts::box};
#endif
  return jml::usable(filter.predict());
}

}  // namespace paved_without_boxes
