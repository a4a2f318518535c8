// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: dynamics with `tangent` give their space too: plus(x, δ), of `states` numbers, and minus(a,
// b)
#include "space_parts.hpp"

namespace plus_of_plain_numbers {

#ifdef MISTAKE
using Plain = jml::Vector<double, 1>;
inline Plain moved(const Plain& x, const Plain& delta) { return jml::SO2::plus(x, delta); }
#endif
struct Angle {
  static constexpr int states = 1, tangent = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
#ifdef MISTAKE
  static Plain plus(const Plain& x, const Plain& delta) { return moved(x, delta); }
#else
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

}  // namespace plus_of_plain_numbers
