// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a control for a model that says no `static constexpr int controls`
#include "parts.hpp"

namespace control_of_none {

struct Model : parts::Model {
#ifndef MISTAKE
  static constexpr int controls = 1;
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, parts::start};
  return jml::usable(filter.predict(0.1, 1.0));
}

}  // namespace control_of_none
