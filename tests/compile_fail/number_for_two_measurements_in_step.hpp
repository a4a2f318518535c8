// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a single number for a vector or matrix of several entries
#include "parts.hpp"

namespace number_for_two_measurements_in_step {

struct Sensor {
  static constexpr int measurements = 2;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return x;
  }
  parts::Matrix2 noise_covariance() const { return parts::Matrix2::Identity(); }
};

#ifdef MISTAKE
constexpr double y = 1;
#else
inline const parts::Vector2 y(1, 1);
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Sensor{}, y).status);
}

}  // namespace number_for_two_measurements_in_step
