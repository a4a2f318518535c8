// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: ColouredInput: the shaping filter needs one state for each disturbance of the plant
#include "parts.hpp"

namespace coloured_input_of_other_size {

struct Shaping {
#ifdef MISTAKE
  static constexpr int states = 2;
#else
  static constexpr int states = 1;
#endif
  template <typename T, int n>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& u) const {
    return 0.9 * u;
  }
  parts::Vector1 disturbance_bound() const { return parts::Vector1(1.0); }
};

inline bool run() {
  const jml::ColouredInput whole{parts::Pushed{}, Shaping{}};
  return decltype(whole)::states == 3;
}

}  // namespace coloured_input_of_other_size
