// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this estimator is of states in ℝⁿ; states in a space
#include "space_parts.hpp"

namespace smoother_in_a_space {

#ifdef MISTAKE
using Model = space_parts::Attitude;
const auto& start = space_parts::start;
#else
using Model = space_parts::Functions<space_parts::Four>;
const auto& start = space_parts::flat_start;
#endif

inline bool run() {
  jml::Smoother smoother{jml::Filter{jml::Ekf{}, Model{}, start}, 3};
  return smoother.smooth() == jml::Status::ok;
}

}  // namespace smoother_in_a_space
