// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: dynamics(x) or measurement(x) does not answer in the scalar of x: make it a template
#include "parts.hpp"

namespace guaranteed_box_of_plain_dynamics {

struct Model : parts::WithInput {
#ifdef MISTAKE
  parts::Vector2 dynamics(const parts::Vector2& x) const { return x; }
#else
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return x;
  }
#endif
  parts::Matrix2 dynamics_jacobian(const parts::Vector2&) const { return parts::Matrix2::Identity(); }
  parts::Vector1 disturbance_bound() const { return parts::Vector1(1.0); }
};

inline bool run() {
  jml::Filter filter{jml::Guaranteed{}, Model{}, parts::box};
  return jml::usable(filter.predict());
}

}  // namespace guaranteed_box_of_plain_dynamics
