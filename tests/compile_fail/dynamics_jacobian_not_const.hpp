// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: dynamics_jacobian exists but does not accept (x) or (x, at): check its arguments and const
#include "parts.hpp"

namespace dynamics_jacobian_not_const {

struct Model : parts::Model {
  parts::Matrix2 dynamics_jacobian(const parts::Vector2&)
#ifndef MISTAKE
      const
#endif
  {
    return parts::Matrix2{{1, 0.1}, {0, 1}};
  }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace dynamics_jacobian_not_const
