// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: max(x, 0) and min(x, 0): std::max takes two numbers of one type, and T may be double: write
// max(x, T(0))
#include "parts.hpp"

namespace min_with_int_in_measurement {

struct Sensor : parts::Sensor {
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::min;
#ifdef MISTAKE
    return jml::Vector<T, 1>(min(5, x(0)));
#else
    return jml::Vector<T, 1>(min(T(5), x(0)));
#endif
  }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.update(Sensor{}, 1.0).status);
}

}  // namespace min_with_int_in_measurement
