// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: the model reads at.control, and does not say how many: `static constexpr int controls`
#include "parts.hpp"

namespace control_read_but_not_declared {

struct Model {
  static constexpr int states = 2;
#ifndef MISTAKE
  static constexpr int controls = 1;
#endif
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(0) + at.control(0), x(1)};
  }
  parts::Matrix2 disturbance_covariance() const { return parts::Matrix2::Identity(); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict(0.1));
}

}  // namespace control_read_but_not_declared
