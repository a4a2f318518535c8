// SPDX-License-Identifier: BSD-3-Clause
#include "models.hpp"

double run(const jml::Vector<double, 3>& y) {
  jml::Box<double, 6> box;
  for (int i = 0; i < 6; ++i) {
    box.lower(i) = i + 1;
    box.upper(i) = i + 2;
  }
  jml::Filter filter{jml::Guaranteed{}, D6{}, box};
  const auto report = filter.step(S6{}, y);
  return filter.x()(0) + static_cast<int>(report.status);
}
