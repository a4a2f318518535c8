// SPDX-License-Identifier: BSD-3-Clause
// One run of the bearings-only tracking of the EKF/UKF toolbox manual (Hartikainen, Solin and Särkkä 2011).
//
// RMSE: √ of the mean over the 500 samples of the squared distance of the position, each after its update;
// then the mean over runs.
#pragma once

#include "models/bearings_only.hpp"
#include "published/campaign.hpp"

namespace bearings_only {

using State = jml::Vector<double, 4>;
using Covariance = jml::Matrix<double, 4, 4>;

inline constexpr int steps = 500;

struct Track {
  std::vector<State> truth;
  std::vector<jml::Vector<double, 2>> y;

  /// Straight, with three right turns of a quarter circle in samples 50-100, 200-250, 350-400 (from 1).
  explicit Track(std::uint64_t seed) {
    jml::Noise noise(seed);
    constexpr double dt = 0.01, quarter = 1.5707963267948966 / 51 / dt;
    const models::DirectionFinders sensor;
    State x(0, 0, 1, 0);
    for (int k = 1; k <= steps; ++k) {
      const bool turning = (k >= 50 && k <= 100) || (k >= 200 && k <= 250) || (k >= 350 && k <= 400);
      const double rate = turning ? quarter + 0.01 * noise.normal() : 0;
      const double c = std::cos(rate * dt), s = std::sin(rate * dt);
      const double along = rate > 0 ? s / rate : dt, across = rate > 0 ? (1 - c) / rate : 0;
      x = State(x(0) + along * x(2) + across * x(3), x(1) - across * x(2) + along * x(3), c * x(2) + s * x(3),
                c * x(3) - s * x(2));
      truth.push_back(x);
      y.push_back(sensor.measurement(x) + sensor.sd * noise.normal_vector<2>());
    }
  }
};

template <typename Rule>
void score(const Rule& rule, const Track& track, campaign::Score& out) {
  const Covariance P = State(0.1, 0.1, 10, 10).asDiagonal();
  jml::Filter filter{rule, models::WhiteAcceleration{}, jml::Estimate{State(State::Zero()), P}};
  double squares = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    if (!jml::usable(filter.step(models::DirectionFinders{}, track.y[k]).status))
      out.refuse(filter.predict());
    const State error = filter.x() - track.truth[k];
    squares += error(0) * error(0) + error(1) * error(1);
  }
  out.finish(std::sqrt(squares / steps), 10);
}

}  // namespace bearings_only
