// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: discretize<Integrator, NoiseModel> takes jml::VanLoan (the default) or jml::HeldNoise
#include <jml/model/discretize.hpp>

#include "continuous_parts.hpp"

namespace discretize_with_another_noise {

#ifdef MISTAKE
using Noise = parts::Signal;
#else
using Noise = jml::HeldNoise;
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, jml::discretize<jml::Euler, Noise>(parts::Flow{}), parts::start};
  return jml::usable(filter.predict(0.1));
}

}  // namespace discretize_with_another_noise
