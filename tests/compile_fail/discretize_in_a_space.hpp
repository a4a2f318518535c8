// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: discretize is of states in ℝⁿ; in a space write the step x⁺ = f(x) itself
#include <jml/model/discretize.hpp>

#include "space_parts.hpp"

namespace discretize_in_a_space {

#ifdef MISTAKE
using Model = space_parts::OnSphere<space_parts::Functions<space_parts::Continuous>>;
#else
using Model = space_parts::Functions<space_parts::Continuous>;
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(Model{}), space_parts::flat_start};
  return filter.predict(0.1) == jml::Status::ok;
}

}  // namespace discretize_in_a_space
