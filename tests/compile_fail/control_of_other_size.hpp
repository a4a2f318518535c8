// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a vector or matrix of the wrong size is given: y has `measurements` entries, a control
// `controls`
#include "parts.hpp"

namespace control_of_other_size {

struct Model {
  static constexpr int states = 2, controls = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(0) + at.control(0), x(1)};
  }
  parts::Matrix2 disturbance_covariance() const { return parts::Matrix2::Identity(); }
};

#ifdef MISTAKE
inline const parts::Vector1 control(1.0);
#else
inline const parts::Vector2 control(1, 1);
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict(0.1, control));
}

}  // namespace control_of_other_size
