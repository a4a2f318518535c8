// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: dt is a number of seconds, or jml::at_time(t); the control comes after it
#include "parts.hpp"

namespace control_in_place_of_dt {

struct Model {
  static constexpr int states = 2, controls = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(0) + at.control(0), x(1)};
  }
  parts::Matrix2 disturbance_covariance() const { return parts::Matrix2::Identity(); }
};

inline bool run() {
  const parts::Vector1 control(1.0);
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
#ifdef MISTAKE
  return jml::usable(filter.predict(control));
#else
  return jml::usable(filter.predict(0.1, control));
#endif
}

}  // namespace control_in_place_of_dt
