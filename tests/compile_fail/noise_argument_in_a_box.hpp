// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a box is of noise that adds: dynamics(x)
#include "space_parts.hpp"

namespace noise_argument_in_a_box {

struct Growth {
  static constexpr int states = 1, disturbances = 1;
#ifdef MISTAKE
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const jml::Vector<T, 1>& w) const {
    return jml::Vector<T, 1>(x(0) + w(0) * w(0));
  }
#else
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
#endif
  parts::Vector1 disturbance_bound() const { return parts::Vector1(1.0); }
};

inline bool run() {
  jml::Filter filter{jml::Guaranteed{}, Growth{},
                     jml::Box<double, 1>{parts::Vector1(0.0), parts::Vector1(1.0)}};
  return filter.predict() == jml::Status::ok;
}

}  // namespace noise_argument_in_a_box
