// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this estimator is of states in ℝⁿ; states in a space
#include "space_parts.hpp"

namespace algebraic_filter_in_a_space {

#ifdef MISTAKE
using Model = space_parts::OnSphere<space_parts::Functions<space_parts::Continuous>>;
#else
using Model = space_parts::Functions<space_parts::Continuous>;
#endif

inline bool run() {
  jml::Filter filter{jml::Algebraic{jml::Ekf{}}, Model{}, space_parts::upright};
  return filter.status() == jml::Status::ok;
}

}  // namespace algebraic_filter_in_a_space
