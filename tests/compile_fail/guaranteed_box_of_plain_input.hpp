// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: bounded noise: G reads the state: make disturbance_input(x) a template
#include "parts.hpp"

namespace guaranteed_box_of_plain_input {

struct Model : parts::Functions {
#ifdef MISTAKE
  jml::Matrix<double, 2, 1> disturbance_input(const parts::Vector2& x) const { return {0, x(0)}; }
#else
  template <typename T>
  jml::Matrix<T, 2, 1> disturbance_input(const jml::Vector<T, 2>& x) const {
    return {T(0), x(0)};
  }
#endif
  parts::Vector1 disturbance_bound() const { return parts::Vector1(1.0); }
};

inline bool run() {
  jml::Filter filter{jml::Guaranteed{}, Model{}, parts::box};
  return jml::usable(filter.predict());
}

}  // namespace guaranteed_box_of_plain_input
