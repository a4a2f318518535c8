// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a vector or matrix of the wrong size is given: y has `measurements` entries, a control
// `controls`
#include "parts.hpp"

namespace covariance_not_square {

#ifdef MISTAKE
constexpr int columns = 3;
#else
constexpr int columns = 2;
#endif

inline bool run() {
  const jml::Estimate start{parts::Vector2(1, 0), jml::Matrix<double, 2, columns>::Identity()};
  return start.P(0, 0) > 0;
}

}  // namespace covariance_not_square
