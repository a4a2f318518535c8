// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this model reads time, dt or control: pass dt, predict(dt)
#include <jml/interval/batch.hpp>

#include "parts.hpp"

namespace batch_predict_without_dt {

struct Model {
  static constexpr int states = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const jml::StepContext<double>& at) const {
    return {x(0) + at.dt * x(1), x(1)};
  }
  parts::Matrix2 disturbance_covariance() const { return parts::Matrix2::Identity(); }
};

inline bool run() {
  jml::Batch batch{Model{}, jml::sensors<parts::Sensor>, parts::start, {3}};
#ifdef MISTAKE
  return jml::usable(batch.predict());
#else
  return jml::usable(batch.predict(0.1));
#endif
}

}  // namespace batch_predict_without_dt
