// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: something to be saved has a part of a type T that jml cannot look into
#include "parts.hpp"

namespace saved_pointer {

struct Counters {
  int used = 0;
#ifdef MISTAKE
  const double* last = nullptr;
#else
  double last = 0;
#endif
};

inline bool run() {
  Counters counters;
  jml::ImageOf<Counters> image;
  return jml::save(image, counters) == jml::Status::ok;
}

}  // namespace saved_pointer
