// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a box is of noise that adds: measurement(x)
#include "space_parts.hpp"

namespace noise_argument_of_a_sensor_in_a_box {

struct Scale {
  static constexpr int measurements = 1;
#ifdef MISTAKE
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x, const jml::Vector<T, 1>& v) const {
    return jml::Vector<T, 1>(x(0) * (v(0) + 1.0));
  }
#else
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
#endif
  parts::Vector1 noise_bound() const { return parts::Vector1(1.0); }
};

inline bool run() {
  jml::Filter filter{jml::Guaranteed{}, parts::Pushed{}, parts::box};
  return jml::usable(filter.update(Scale{}, 1.0).status);
}

}  // namespace noise_argument_of_a_sensor_in_a_box
