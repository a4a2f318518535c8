// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: this filter starts at an estimate: give it jml::Estimate{x, P}
#include "parts.hpp"

namespace start_without_covariance {

inline bool run() {
#ifdef MISTAKE
  const parts::Vector2 start(1, 0);
#else
  const jml::Estimate start{parts::Vector2(1, 0), parts::Matrix2::Identity()};
#endif
  jml::Filter filter{jml::Ekf{}, parts::Model{}, start};
  return jml::usable(filter.predict());
}

}  // namespace start_without_covariance
