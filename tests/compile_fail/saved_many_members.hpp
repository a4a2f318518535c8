// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a struct with more than sixteen members or entries of a C array
#include "parts.hpp"

namespace saved_many_members {

struct Counters {
#ifdef MISTAKE
  int of[20];
#else
  std::array<int, 20> of;
#endif
};

inline bool run() {
  Counters counters{};
  jml::ImageOf<Counters> image;
  return jml::save(image, counters) == jml::Status::ok;
}

}  // namespace saved_many_members
