// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: only with Jacobians in the slots B and D do the sweeps end at a solution of (12)
#include <jml/continuous/swept.hpp>

#include "continuous_parts.hpp"

namespace swept_sddre {

#ifdef MISTAKE
using Rule = jml::Sddre<>;
#else
using Rule = jml::Rnls<>;
#endif

inline bool run() {
  jml::TwoPoint smoother{parts::Flow{}, parts::Signal{}, parts::start, {.steps = 1}};
  return jml::sweep(smoother, Rule{}).status == jml::Status::ok;
}

}  // namespace swept_sddre
