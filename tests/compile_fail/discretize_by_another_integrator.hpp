// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: discretize<Integrator> makes a step of jml::Euler or jml::RungeKutta4
#include <jml/model/discretize.hpp>

#include "continuous_parts.hpp"

namespace discretize_by_another_integrator {

#ifdef MISTAKE
using Integrator = jml::DavisonMaki;
#else
using Integrator = jml::RungeKutta4;
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, jml::discretize<Integrator>(parts::Flow{}), parts::start};
  return jml::usable(filter.predict(0.1));
}

}  // namespace discretize_by_another_integrator
