// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: each_part(f) returns what f returns
#include "parts.hpp"

namespace saved_parts_of_void {

class Counters {
 public:
#ifdef MISTAKE
  void each_part(auto&& f) { f(used_); }
#else
  auto each_part(auto&& f) { return f(used_); }
#endif

 private:
  int used_ = 0;
};

inline bool run() {
  Counters counters;
  jml::ImageOf<Counters> image;
  return jml::save(image, counters) == jml::Status::ok;
}

}  // namespace saved_parts_of_void
