// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: dynamics_jacobian(x) takes a state of another size than `states`
#include "parts.hpp"

namespace jacobian_of_other_states {

#ifdef MISTAKE
constexpr int given = 3;
#else
constexpr int given = 2;
#endif

struct Model : parts::Model {
  parts::Matrix2 dynamics_jacobian(const jml::Vector<double, given>&) const {
    return parts::Matrix2{{1, 0.1}, {0, 1}};
  }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace jacobian_of_other_states
