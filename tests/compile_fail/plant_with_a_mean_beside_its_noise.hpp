// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a plant with more states beside it has no disturbance_mean()
#include <jml/model/correlated_noise.hpp>

#include "parts.hpp"

namespace plant_with_a_mean_beside_its_noise {

struct Plant {
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(1); }
#ifdef MISTAKE
  jml::Vector<double, 1> disturbance_mean() const { return jml::Vector<double, 1>(1); }
#endif
};

inline bool run() {
  const jml::RemembersDisturbance whole{Plant{}};
  const jml::Matrix<double, 2, 2> P = jml::Matrix<double, 2, 2>::Identity();
  jml::Filter filter{jml::Ekf{}, whole, jml::Estimate{jml::Vector<double, 2>(0, 0), P}};
  return filter.predict() == jml::Status::ok;
}

}  // namespace plant_with_a_mean_beside_its_noise
