// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a factored form belongs to the symmetric rules Kalman, Ekf and Sddre
#include "parts.hpp"

namespace factored_nonsymmetric_rule {

#ifdef MISTAKE
using Rule = jml::Jml<>;
#else
using Rule = jml::Ekf<>;
#endif

inline bool run() {
  jml::Filter filter{jml::Factored{Rule{}}, parts::Model{}, parts::start};
  return filter.status() == jml::Status::ok;
}

}  // namespace factored_nonsymmetric_rule
