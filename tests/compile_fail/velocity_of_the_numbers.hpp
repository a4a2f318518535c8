// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: continuous dynamics in a space answer with a tangent vector
#include "space_parts.hpp"

namespace velocity_of_the_numbers {

#ifdef MISTAKE
struct Model : space_parts::Turning {
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x) const {
    return x;
  }
};
#else
using Model = space_parts::Turning;
#endif

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Ekf{}}, Model{}, space_parts::start};
  return filter.predict(0.1) == jml::Status::ok;
}

}  // namespace velocity_of_the_numbers
