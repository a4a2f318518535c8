// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this model reads time, dt or control: pass dt, predict(dt)
#include "parts.hpp"

namespace predict_without_dt {

struct Model {
  static constexpr int states = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const jml::StepContext<double>& at) const {
    return {x(0) + at.dt * x(1), x(1)};
  }
  parts::Matrix2 disturbance_covariance() const { return parts::Matrix2::Identity(); }
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
#ifdef MISTAKE
  return jml::usable(filter.predict());
#else
  return jml::usable(filter.predict(0.1));
#endif
}

}  // namespace predict_without_dt
