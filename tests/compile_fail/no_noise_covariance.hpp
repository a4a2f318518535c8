// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a sensor needs noise_covariance(), p×p
#include "parts.hpp"

namespace no_noise_covariance {

#ifdef MISTAKE
using Sensor = parts::Position;
#else
using Sensor = parts::Sensor;
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace no_noise_covariance
