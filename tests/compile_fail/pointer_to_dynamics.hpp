// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a pointer in place of the dynamics: give the model itself, *model
#include <memory>

#include "parts.hpp"

namespace pointer_to_dynamics {

inline bool run() {
  const auto model = std::make_unique<parts::Model>();
#ifdef MISTAKE
  jml::Filter filter{jml::Ekf{}, &*model, parts::start};
#else
  jml::Filter filter{jml::Ekf{}, *model, parts::start};
#endif
  return jml::usable(filter.predict());
}

}  // namespace pointer_to_dynamics
