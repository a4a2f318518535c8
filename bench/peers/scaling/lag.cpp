// SPDX-License-Identifier: BSD-3-Clause
// A step of jml::FixedLag<JML_SCALING_LAG>, two sweeps, on the Van der Pol oscillator.
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <models/van_der_pol.hpp>

#include "study.hpp"

namespace {

constexpr int lag = JML_SCALING_LAG;

auto make() {
  jml::Filter filter{jml::FixedLag<lag>{}, models::VanDerPol{}, jml::sensors<models::SaturatingPosition>,
                     jml::Estimate<double, 2>{{1, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()}};
  filter.method().options.tolerance = 0;
  return filter;
}

void step(long steps) {
  static auto filter = make();
  static jml::Vector<double, 2> truth{1, 0};
  static jml::Noise noise(1);
  const models::VanDerPol dynamics;
  const models::SaturatingPosition sensor;
  const auto fly = [&](long count) {
    for (long k = 0; k < count; ++k) {
      truth = dynamics.dynamics(truth) +
              dynamics.disturbance_input() * noise.normal_vector(dynamics.disturbance_covariance());
      const jml::Vector<double, 1> y =
          sensor.measurement(truth) + noise.normal_vector(sensor.noise_covariance());
      if (!jml::usable(filter.step(sensor, y).status)) std::abort();
      scaling::keep(filter);
    }
  };
  if (filter.depth() < lag) fly(lag);
  fly(steps);
}

const scaling::Register all{"lag_by_length", lag, 2, 1, step};

}  // namespace
