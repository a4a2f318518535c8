// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this estimator is of states in ℝⁿ; states in a space
#include "space_parts.hpp"

namespace box_in_a_space {

#ifdef MISTAKE
using Model = space_parts::OnSphere<space_parts::Functions<space_parts::Bounded>>;
#else
using Model = space_parts::Functions<space_parts::Bounded>;
#endif

inline bool run() {
  jml::Filter filter{jml::Guaranteed{}, Model{},
                     jml::Box<double, 4>{space_parts::Vector4::Zero(), space_parts::Vector4::Ones()}};
  return filter.predict() == jml::Status::ok;
}

}  // namespace box_in_a_space
