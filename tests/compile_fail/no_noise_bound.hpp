// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: bounded noise: a sensor needs noise_bound(), p
#include "parts.hpp"

namespace no_noise_bound {

#ifdef MISTAKE
using Sensor = parts::Sensor;
#else
struct Sensor : parts::Sensor {
  parts::Vector1 noise_bound() const { return parts::Vector1(1.0); }
};
#endif

inline bool run() {
  jml::Filter filter{jml::Linearised{}, parts::Pushed{}, parts::box};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace no_noise_bound
