// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: residual returns a vector of the wrong size
#include "parts.hpp"

namespace residual_of_other_size {

#ifdef MISTAKE
using Residual = Eigen::VectorXd;
#else
using Residual = parts::Vector1;
#endif

struct Sensor : parts::Sensor {
  Residual residual(const parts::Vector1& y, const parts::Vector1& predicted) const { return y - predicted; }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace residual_of_other_size
