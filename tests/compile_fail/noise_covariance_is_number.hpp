// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a model function must return a jml::Vector or jml::Matrix, also where it is 1×1
#include "parts.hpp"

namespace noise_covariance_is_number {

struct Sensor : parts::Position {
#ifdef MISTAKE
  double noise_covariance() const { return 1; }
#else
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(1); }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace noise_covariance_is_number
