// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: something to be saved has a part of a type T that jml cannot look into
#include "parts.hpp"

namespace saved_derived_filter {

using Filter = jml::Filter<jml::Ekf<>, parts::Model>;
/// What it adds would be lost without a word.
struct Mine : Filter {
  using Filter::Filter;
  int used = 0;
};

inline bool run() {
  Mine filter{jml::Ekf{}, parts::Model{}, parts::start};
#ifdef MISTAKE
  jml::ImageOf<Mine> image;
  return jml::save(image, filter) == jml::Status::ok;
#else
  jml::ImageOf<Filter, int> image;
  return jml::save(image, static_cast<const Filter&>(filter), filter.used) == jml::Status::ok;
#endif
}

}  // namespace saved_derived_filter
