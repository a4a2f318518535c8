// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: residual exists but does not accept (y, predicted)
#include "parts.hpp"

namespace hook_that_does_not_fit {

struct Sensor : parts::Sensor {
#ifdef MISTAKE
  double residual(double y, double predicted) const { return y - predicted; }
#else
  parts::Vector1 residual(const parts::Vector1& y, const parts::Vector1& predicted) const {
    return y - predicted;
  }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace hook_that_does_not_fit
