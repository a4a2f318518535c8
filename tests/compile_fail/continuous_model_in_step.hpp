// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this dynamics model is continuous in time: wrap it in jml::discretize
#include "parts.hpp"

namespace continuous_model_in_step {

struct Model : parts::Model {
#ifdef MISTAKE
  using time_domain = jml::ContinuousTime;
#endif
};

inline bool run() {
  return jml::usable(
      jml::step(jml::Jml{}, Model{}, parts::Sensor{}, parts::start, parts::Vector1(1)).report.status);
}

}  // namespace continuous_model_in_step
