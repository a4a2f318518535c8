// SPDX-License-Identifier: BSD-3-Clause
#include "models.hpp"

double run(const jml::Vector<double, 3>& y) {
  jml::Filter filter{jml::FixedLag<20>{}, D6{}, jml::sensors<S6>, start<6>()};
  const auto report = filter.step(S6{}, y);
  return filter.x()(0) + static_cast<int>(report.status);
}
