// SPDX-License-Identifier: BSD-3-Clause
#include "models.hpp"

double run(const jml::Vector<double, 1>& y) {
  jml::Filter filter{jml::IteratedJml{}, D2{}, start<2>()};
  const auto report = filter.step(S2{}, y);
  return filter.x()(0) + static_cast<int>(report.status);
}
