// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a single number for a vector or matrix of several entries
#include "parts.hpp"

namespace number_for_two_controls {

#ifdef MISTAKE
constexpr int count = 2;
#else
constexpr int count = 1;
#endif

struct Model {
  static constexpr int states = 2, controls = count;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(0) + at.control(0), x(1)};
  }
  parts::Matrix2 disturbance_covariance() const { return parts::Matrix2::Identity(); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  jml::Filter lag{jml::FixedLag<3>{}, Model{}, jml::sensors<parts::Sensor>, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, 1.0, 0.1, 0.5).status) &&
         jml::usable(lag.step(parts::Sensor{}, 1.0, 0.1, 0.5).status) &&
         jml::usable(jml::predict(jml::Ekf{}, Model{}, parts::start, {.dt = 0.1, .control = 0.5}).status);
}

}  // namespace number_for_two_controls
