// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this dynamics model is discrete in time: a continuous filter wants
#include "continuous_parts.hpp"

namespace discrete_model_in_continuous_filter {

#ifdef MISTAKE
using Model = parts::Model;
#else
using Model = parts::Flow;
#endif

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, Model{}, parts::start};
  return jml::usable(filter.step(parts::Signal{}, 1.0, 0.1).status);
}

}  // namespace discrete_model_in_continuous_filter
