// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: bounded noise: G reads the state: make disturbance_input(x) a template
#include "parts.hpp"

namespace guaranteed_box_of_plain_input_in_time {

struct Model : parts::Functions {
#ifdef MISTAKE
  jml::Matrix<double, 2, 1> disturbance_input(const parts::Vector2& x, const auto& at) const {
    return {at.dt, x(0)};
  }
#else
  // Of the time alone: numbers will do.
  template <typename T>
  jml::Matrix<double, 2, 1> disturbance_input(const jml::Vector<T, 2>&, const auto& at) const {
    return {at.dt, 1};
  }
#endif
  parts::Vector1 disturbance_bound() const { return parts::Vector1(1.0); }
};

inline bool run() {
  jml::Filter filter{jml::Guaranteed{}, Model{}, parts::box};
  return jml::usable(filter.predict(0.1));
}

}  // namespace guaranteed_box_of_plain_input_in_time
