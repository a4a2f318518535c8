// SPDX-License-Identifier: BSD-3-Clause
// One run of the univariate nonstationary growth model of the EKF/UKF toolbox manual (Hartikainen, Solin and
// Särkkä 2011): the truth starts at exactly 0.1, the filter at (0.1, 1).
#pragma once

#include "models/growth.hpp"
#include "published/campaign.hpp"

namespace growth {

using X = jml::Vector<double, 1>;

inline constexpr int steps = 500;

struct Track {
  double truth[steps], y[steps];

  explicit Track(std::uint64_t seed) {
    jml::Noise noise(seed);
    double x = 0.1;
    for (int k = 0; k < steps; ++k) {
      const X f = models::Growth{}.dynamics(X(x), jml::StepContext<double>{.time = double(k)});
      x = f(0) + noise.normal();
      truth[k] = x;
      y[k] = x * x / 20 + noise.normal();
    }
  }
};

template <typename Rule>
void score(const Rule& rule, const Track& track, campaign::Score& out) {
  jml::Filter filter{rule, models::Growth{}, jml::Estimate{X(0.1), X(1)}};
  double squares = 0;
  for (int k = 0; k < steps; ++k) {
    if (!jml::usable(filter.step(models::SquareSensor{}, track.y[k], 1.0).status))
      out.refuse(filter.predict(1.0));
    squares += (filter.x()(0) - track.truth[k]) * (filter.x()(0) - track.truth[k]);
  }
  out.finish(squares / steps, 1e9);
}

}  // namespace growth
