// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: P has the size of the degrees of freedom, not of the numbers of a state
#include "space_parts.hpp"

namespace covariance_of_the_numbers {

/// A navigation state: 16 numbers, 15 degrees of freedom.
struct Navigation {
  using Space = jml::Product<jml::SO3, jml::Euclidean<12>>;
  template <typename T>
  jml::Vector<T, 16> dynamics(const jml::Vector<T, 16>& x) const {
    return x;
  }
};
#ifdef MISTAKE
constexpr int degrees = 16;
#else
constexpr int degrees = 15;
#endif

inline bool run() {
  const jml::Estimate<double, 16, degrees> start;
  jml::Filter filter{jml::Ekf{}, Navigation{}, start};
  return filter.predict() == jml::Status::ok;
}

}  // namespace covariance_of_the_numbers
