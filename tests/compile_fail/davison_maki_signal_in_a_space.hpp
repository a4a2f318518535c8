// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: over states in a space a sensor that measures all the time takes RungeKutta4 or Cvode
#include <jml/riccati/davison_maki.hpp>

#include "space_parts.hpp"

namespace davison_maki_signal_in_a_space {

struct Signal {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 4>& x) const {
    return jml::Vector<T, 1>(x(1));
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(1); }
};
#ifdef MISTAKE
using By = jml::DavisonMaki;
#else
using By = jml::RungeKutta4;
#endif

inline bool run() {
  jml::Filter filter{jml::Continuous{jml::Ekf{}, By{}}, space_parts::Turning{}, space_parts::start};
  return filter.step(Signal{}, 0.1, 0.1).status == jml::Status::ok;
}

}  // namespace davison_maki_signal_in_a_space
