// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a vector or matrix of another scalar is given, float for double
#include "parts.hpp"

namespace y_of_other_scalar {

#ifdef MISTAKE
inline const jml::Vector<float, 1> y(1.0F);
#else
inline const parts::Vector1 y(1.0);
#endif

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, y).status);
}

}  // namespace y_of_other_scalar
