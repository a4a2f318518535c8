// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a dynamics model needs `static constexpr int states`
#include "parts.hpp"

namespace states_not_static {

struct Model {
#ifdef MISTAKE
  int states = 2;
#else
  static constexpr int states = 2;
#endif
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return x;
  }
  parts::Matrix2 disturbance_covariance() const { return parts::Matrix2::Identity(); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace states_not_static
