// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: braces with more or fewer numbers than the vector has entries
#include "parts.hpp"

namespace braces_of_other_size {

inline bool run() {
  const jml::Estimate<double, 2> start{
#ifdef MISTAKE
      {1.0, 2.0, 3.0}, parts::Matrix2::Identity()};
#else
      {1.0, 2.0}, parts::Matrix2::Identity()};
#endif
  return start.x(0) > 0;
}

}  // namespace braces_of_other_size
