// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: std::sin and its like take plain numbers, and T may be a dual number: write `using std::sin;
// sin(x)`
#include "parts.hpp"

namespace std_sin_in_dynamics {

struct Model : parts::Model {
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
#ifdef MISTAKE
    return {x(0), std::sin(x(1))};
#else
    using std::sin;
    return {x(0), sin(x(1))};
#endif
  }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace std_sin_in_dynamics
