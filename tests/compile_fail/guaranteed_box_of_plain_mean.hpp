// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: bounded noise: the disturbance's mean reads the state: make disturbance_mean(x) a template
#include "parts.hpp"

namespace guaranteed_box_of_plain_mean {

struct Model : parts::Pushed {
#ifdef MISTAKE
  parts::Vector1 disturbance_mean(const parts::Vector2& x, const auto&) const { return parts::Vector1(x(0)); }
#else
  template <typename T>
  jml::Vector<T, 1> disturbance_mean(const jml::Vector<T, 2>& x, const auto&) const {
    return jml::Vector<T, 1>(x(0));
  }
#endif
};

inline bool run() {
  jml::Filter filter{jml::Guaranteed{}, Model{}, parts::box};
  return jml::usable(filter.predict(0.1));
}

}  // namespace guaranteed_box_of_plain_mean
