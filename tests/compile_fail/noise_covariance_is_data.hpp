// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: noise_covariance and its like are functions, not data
#include "parts.hpp"

namespace noise_covariance_is_data {

struct Sensor : parts::Position {
#ifdef MISTAKE
  parts::Matrix1 noise_covariance = parts::Matrix1(1);
#else
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(1); }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace noise_covariance_is_data
