// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a sensor needs noise_spectral_density() (it measures all the time) or
#include "continuous_parts.hpp"

namespace sensor_without_noise_in_continuous_filter {

#ifdef MISTAKE
using Sensor = parts::Position;
#else
using Sensor = parts::Signal;
#endif

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, parts::Flow{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0, 0.1).status);
}

}  // namespace sensor_without_noise_in_continuous_filter
