// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the model compares states; a box has no single answer
#include "parts.hpp"

namespace guaranteed_box_of_branches {

struct Model : parts::WithInput {
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
#ifdef MISTAKE
    return {x(0) < 0 ? -x(0) : x(0), x(1)};
#else
    using std::abs;
    return {abs(x(0)), x(1)};
#endif
  }
  parts::Vector1 disturbance_bound() const { return parts::Vector1(1.0); }
};

inline bool run() {
  jml::Filter filter{jml::Guaranteed{}, Model{}, parts::box};
  return jml::usable(filter.predict());
}

}  // namespace guaranteed_box_of_branches
