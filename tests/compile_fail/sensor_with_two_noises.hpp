// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this sensor has a noise_spectral_density() and a noise_covariance(): which of them
#include "continuous_parts.hpp"

namespace sensor_with_two_noises {

struct Sensor : parts::Signal {
#ifdef MISTAKE
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(1); }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, parts::Flow{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0, 0.1).status);
}

}  // namespace sensor_with_two_noises
