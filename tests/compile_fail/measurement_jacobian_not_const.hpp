// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: measurement_jacobian exists but does not accept (x) or (x, at): check its arguments and
// const
#include "parts.hpp"

namespace measurement_jacobian_not_const {

struct Sensor : parts::Sensor {
  jml::Matrix<double, 1, 2> measurement_jacobian(const parts::Vector2&)
#ifndef MISTAKE
      const
#endif
  {
    return {1, 0};
  }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace measurement_jacobian_not_const
