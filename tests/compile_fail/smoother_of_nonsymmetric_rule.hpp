// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a smoother belongs to the symmetric one-pass rules Kalman, Ekf and Sddre
#include "parts.hpp"

namespace smoother_of_nonsymmetric_rule {

#ifdef MISTAKE
using Rule = jml::Jml<>;
#else
using Rule = jml::Ekf<>;
#endif

inline bool run() {
  jml::Smoother smoother{jml::Filter{Rule{}, parts::Model{}, parts::start}, 3};
  return smoother.smooth() == jml::Status::ok;
}

}  // namespace smoother_of_nonsymmetric_rule
