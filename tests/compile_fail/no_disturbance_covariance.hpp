// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: discrete dynamics with disturbances need disturbance_covariance(), q×q
#include "parts.hpp"

namespace no_disturbance_covariance {

#ifdef MISTAKE
using Model = parts::WithInput;
#else
using Model = parts::Model;
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, 1.0).status);
}

}  // namespace no_disturbance_covariance
