// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: restore(image, filter): what is restored is not const
#include "parts.hpp"

namespace restored_into_const {

inline bool run() {
#ifdef MISTAKE
  const int count = 1;
#else
  int count = 1;
#endif
  jml::ImageOf<int> image;
  return jml::save(image, count) == jml::Status::ok && jml::restore(image, count) == jml::Status::ok;
}

}  // namespace restored_into_const
