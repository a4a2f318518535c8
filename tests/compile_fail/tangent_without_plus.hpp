// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: dynamics with `tangent` give their space too: plus(x, δ), of `states` numbers, and minus(a,
// b)
#include "space_parts.hpp"

namespace tangent_without_plus {

struct Angle {
  static constexpr int states = 1, tangent = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
#ifndef MISTAKE
  template <typename T>
  static jml::Vector<T, 1> plus(const jml::Vector<T, 1>& x, const jml::Vector<T, 1>& delta) {
    return jml::SO2::plus(x, delta);
  }
#endif
  template <typename T>
  static jml::Vector<T, 1> minus(const jml::Vector<T, 1>& a, const jml::Vector<T, 1>& b) {
    return jml::SO2::minus(a, b);
  }
};

inline bool run() {
  const jml::Estimate<double, 1> start;
  jml::Filter filter{jml::Ekf{}, Angle{}, start};
  return filter.predict() == jml::Status::ok;
}

}  // namespace tangent_without_plus
