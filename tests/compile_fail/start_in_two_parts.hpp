// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a filter is made as Filter{method, dynamics, start}
#include "parts.hpp"

namespace start_in_two_parts {

inline bool run() {
  const parts::Vector2 x(1, 0);
  const parts::Matrix2 P = parts::Matrix2::Identity();
#ifdef MISTAKE
  jml::Filter filter{jml::Ekf{}, parts::Model{}, x, P};
#else
  jml::Filter filter{jml::Ekf{}, parts::Model{}, jml::Estimate{x, P}};
#endif
  return jml::usable(filter.predict());
}

}  // namespace start_in_two_parts
