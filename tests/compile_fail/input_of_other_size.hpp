// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a model function returns a matrix of the wrong size
#include "parts.hpp"

namespace input_of_other_size {

struct Model : parts::Functions {
#ifdef MISTAKE
  jml::Matrix<double, 1, 2> disturbance_input() const { return {0, 1}; }
#else
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
#endif
  parts::Matrix1 disturbance_covariance() const { return parts::Matrix1(1); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace input_of_other_size
