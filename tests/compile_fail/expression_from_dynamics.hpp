// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a model function must return a jml::Vector or jml::Matrix, not auto of an Eigen expression
#include "parts.hpp"

namespace expression_from_dynamics {

struct Model {
  static constexpr int states = 2;
  parts::Matrix2 F = parts::Matrix2::Identity();
  template <typename T>
#ifdef MISTAKE
  auto dynamics(const jml::Vector<T, 2>& x) const {
#else
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
#endif
      return F.cast<T>() * x;
}
};  // namespace expression_from_dynamics

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace expression_from_dynamics
