// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: disturbance_covariance() is per step and belongs to discrete dynamics
#include "continuous_parts.hpp"

namespace covariance_in_continuous_model {

struct Model : parts::Flow {
#ifdef MISTAKE
  parts::Matrix1 disturbance_covariance() const { return parts::Matrix1(1); }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, Model{}, parts::start};
  return filter.status() == jml::Status::ok;
}

}  // namespace covariance_in_continuous_model
