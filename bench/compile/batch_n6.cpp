// SPDX-License-Identifier: BSD-3-Clause
#include "models.hpp"

double run(const jml::Vector<double, 3>& y) {
  jml::Batch batch{D6{}, jml::sensors<S6>, start<6>(), {.steps = 100}};
  const jml::Status status = batch.step(S6{}, y);
  return batch.solve().cost + batch.x(0)(0) + static_cast<int>(status);
}
