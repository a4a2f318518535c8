// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: disturbance_spectral_density() belongs to continuous dynamics
#include "parts.hpp"

namespace spectral_density_in_discrete_model {

struct Model : parts::WithInput {
#ifdef MISTAKE
  parts::Matrix1 disturbance_spectral_density() const { return parts::Matrix1(1); }
#else
  parts::Matrix1 disturbance_covariance() const { return parts::Matrix1(1); }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, 1.0).status);
}

}  // namespace spectral_density_in_discrete_model
