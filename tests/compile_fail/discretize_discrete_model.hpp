// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: discretize makes a step of ẋ = f(x), which says `using time_domain = jml::ContinuousTime;`
#include <jml/model/discretize.hpp>

#include "continuous_parts.hpp"

namespace discretize_discrete_model {

#ifdef MISTAKE
using Model = parts::Model;
#else
using Model = parts::Flow;
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(Model{}), parts::start};
  return jml::usable(filter.predict(0.1));
}

}  // namespace discretize_discrete_model
