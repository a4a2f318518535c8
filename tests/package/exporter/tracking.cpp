// SPDX-License-Identifier: BSD-3-Clause
#include <tracking.hpp>

#include <jml/kernels.hpp>

namespace tracking {
jml::Vector<double, 1> fuse(const jml::Vector<double, 1>& x, double y) {
  return x + 0.5 * (jml::Vector<double, 1>(y) - x);
}
}  // namespace tracking
