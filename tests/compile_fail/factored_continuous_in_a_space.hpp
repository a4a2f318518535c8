// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this estimator is of states in ℝⁿ; states in a space
#include "space_parts.hpp"

namespace factored_continuous_in_a_space {

#ifdef MISTAKE
using Model = space_parts::Turning;
const auto& start = space_parts::start;
#else
using Model = space_parts::Functions<space_parts::Continuous>;
const auto& start = space_parts::flat_start;
#endif

inline bool run() {
  jml::Filter filter{jml::Factored{jml::Continuous{jml::Ekf{}}}, Model{}, start};
  return filter.predict(0.1) == jml::Status::ok;
}

}  // namespace factored_continuous_in_a_space
