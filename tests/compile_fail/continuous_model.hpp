// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this dynamics model is continuous in time: wrap it in jml::discretize
#include "parts.hpp"

namespace continuous_model {

struct Model : parts::Model {
#ifdef MISTAKE
  using time_domain = jml::ContinuousTime;
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, 1.0).status);
}

}  // namespace continuous_model
