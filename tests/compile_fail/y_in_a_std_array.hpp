// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a std::vector or std::array in place of a jml::Vector
#include <array>

#include "parts.hpp"

namespace y_in_a_std_array {

inline bool run() {
  const std::array<double, 1> numbers{1};
#ifdef MISTAKE
  const auto& y = numbers;
#else
  const Eigen::Map<const parts::Vector1> y(numbers.data());
#endif
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(parts::Sensor{}, y).status);
}

}  // namespace y_in_a_std_array
