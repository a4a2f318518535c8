// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: dynamics(x) or measurement(x) does not answer in the scalar of x
#include "parts.hpp"

namespace measurement_in_float {

#ifdef MISTAKE
using Scalar = float;
#else
using Scalar = double;
#endif

struct Sensor {
  static constexpr int measurements = 1;
  jml::Vector<Scalar, 1> measurement(const parts::Vector2&) const { return jml::Vector<Scalar, 1>(1); }
  jml::Matrix<double, 1, 2> measurement_jacobian(const parts::Vector2&) const { return {1, 0}; }
  parts::Matrix1 noise_covariance() const { return parts::Matrix1(1); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace measurement_in_float
