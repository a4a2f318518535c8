// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: max(x, 0) and min(x, 0): std::max takes two numbers of one type, and T may be double: write
// max(x, T(0))
#include "parts.hpp"

namespace max_with_int {

struct Model : parts::Model {
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    using std::max;
#ifdef MISTAKE
    return {x(0), max(x(1), 0)};
#else
    return {max(0.0, x(0)), max(x(1), 0.0)};
#endif
  }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace max_with_int
