// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: give the dynamics a dynamics_jacobian(x), or make dynamics(x) a template
#include "parts.hpp"

namespace no_derivative_of_dynamics {

struct Model {
  static constexpr int states = 2;
  parts::Vector2 dynamics(const parts::Vector2& x) const { return {x(0) + 0.1 * x(1), x(1)}; }
#ifndef MISTAKE
  parts::Matrix2 dynamics_jacobian(const parts::Vector2&) const { return parts::Matrix2{{1, 0.1}, {0, 1}}; }
#endif
  parts::Matrix2 disturbance_covariance() const { return parts::Matrix2::Identity(); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, 1.0).status);
}

}  // namespace no_derivative_of_dynamics
