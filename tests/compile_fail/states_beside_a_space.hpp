// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: `states` is not how many numbers a state of `Space` has: leave it out
#include "space_parts.hpp"

namespace states_beside_a_space {

struct Model : space_parts::Attitude {
#ifdef MISTAKE
  static constexpr int states = 3;
#endif
};

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Model{}, space_parts::start};
  return filter.predict() == jml::Status::ok;
}

}  // namespace states_beside_a_space
