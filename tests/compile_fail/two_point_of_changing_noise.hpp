// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the two-point smoother takes G, Q and R that are constants, functions of ()
#include <jml/continuous/two_point.hpp>

#include "continuous_parts.hpp"

namespace two_point_of_changing_noise {

struct Sensor : parts::LinearPosition {
#ifdef MISTAKE
  parts::Matrix1 noise_spectral_density(const jml::Vector<double, 2>& x) const {
    return parts::Matrix1(1 + x(0) * x(0));
  }
#else
  parts::Matrix1 noise_spectral_density() const { return parts::Matrix1(1); }
#endif
};

inline bool run() {
  jml::TwoPoint smoother{parts::Flow{}, Sensor{}, parts::start, {.steps = 1}};
  return smoother.status() == jml::Status::ok;
}

}  // namespace two_point_of_changing_noise
