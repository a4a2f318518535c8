// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: Kalman is for linear models: say `static constexpr bool linear = true;` in it, or use Ekf
#include "continuous_parts.hpp"

namespace kalman_on_nonlinear_continuous_model {

struct Model : parts::Flow {
#ifdef MISTAKE
  static constexpr bool linear = false;
#endif
};

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Kalman{}}, Model{}, parts::start};
  return jml::usable(filter.step(parts::Signal{}, 1.0, 0.1).status);
}

}  // namespace kalman_on_nonlinear_continuous_model
