// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: disturbance_covariance and its like are functions, not data
#include "parts.hpp"

namespace disturbance_covariance_is_data {

struct Model : parts::WithInput {
#ifdef MISTAKE
  parts::Matrix1 disturbance_covariance = parts::Matrix1(1);
#else
  parts::Matrix1 disturbance_covariance() const { return parts::Matrix1(1); }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace disturbance_covariance_is_data
