// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a model in place of the method: write jml::Filter{jml::Ekf{}, dynamics, start}
#include "parts.hpp"

namespace model_before_method {

inline bool run() {
#ifdef MISTAKE
  jml::Filter filter{parts::Model{}, jml::Ekf{}, parts::start};
#else
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
#endif
  return jml::usable(filter.predict());
}

}  // namespace model_before_method
