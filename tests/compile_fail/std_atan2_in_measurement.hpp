// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: std::sin and its like take plain numbers, and T may be a dual number: write `using std::sin;
// sin(x)`
#include "parts.hpp"

namespace std_atan2_in_measurement {

struct Sensor : parts::Sensor {
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
#ifndef MISTAKE
    using std::atan2;
    return jml::Vector<T, 1>(atan2(x(1), x(0)));
#else
    return jml::Vector<T, 1>(std::atan2(x(1), x(0)));
#endif
  }
};

inline bool run() {
  jml::Filter filter{jml::IteratedJml{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, 1.0).status);
}

}  // namespace std_atan2_in_measurement
