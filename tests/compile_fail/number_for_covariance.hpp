// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a single number for a vector or matrix of several entries
#include "parts.hpp"

namespace number_for_covariance {

inline bool run() {
#ifdef MISTAKE
  const jml::Estimate start{parts::Vector2(1, 0), 0.1};
#else
  const jml::Estimate start{parts::Vector2(1, 0), 0.1 * parts::Matrix2::Identity()};
#endif
  return start.P(0, 0) > 0;
}

}  // namespace number_for_covariance
