// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the two-point smoother is of a sensor with a noise_spectral_density()
#include <jml/continuous/two_point.hpp>

#include "continuous_parts.hpp"

namespace two_point_of_samples {

#ifdef MISTAKE
using Sensor = parts::Sensor;
#else
using Sensor = parts::Signal;
#endif

inline bool run() {
  jml::TwoPoint smoother{parts::Flow{}, Sensor{}, parts::start, {.steps = 1}};
  return smoother.status() == jml::Status::ok;
}

}  // namespace two_point_of_samples
