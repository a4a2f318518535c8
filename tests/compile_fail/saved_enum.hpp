// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: to restore an enum, jml has to know its values
#include "parts.hpp"

namespace saved_enum {

enum class Mode : unsigned char { off, on };
#ifndef MISTAKE
constexpr Mode last_value(Mode) { return Mode::on; }
#endif
struct Policy {
  Mode mode = Mode::off;
};

inline bool run() {
  Policy policy;
  jml::ImageOf<Policy> image;
  return jml::save(image, policy) == jml::Status::ok;
}

}  // namespace saved_enum
