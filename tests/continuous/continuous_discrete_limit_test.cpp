// SPDX-License-Identifier: BSD-3-Clause
// The discrete filters tend to the continuous ones at first order in dt: R/dt, Q/dt, G dt (jml::sampled,
// HeldNoise) and a fixed smooth y(t), sampled at the end of each step. Measured slopes: 0.997 to 0.999.
#include <gtest/gtest.h>

#include <jml/jml.hpp>
#include <jml/model/discretize.hpp>

#include "continuous/continuous_check.hpp"

namespace {

using continuous_check::OscillatorCase;

template <typename Rule, typename Samples>
double discrete_error(const Rule& rule, const Samples& samples, int per_second) {
  const OscillatorCase c{};
  jml::Filter filter{rule, jml::discretize<jml::Euler, jml::HeldNoise>(c.dynamics), c.start()};
  const auto sensor = jml::sampled(c.sensor);
  const double dt = 1.0 / per_second;
  double worst = 0;
  int step = 0;
  for (const auto& sample : samples) {
    if (sample.time > 5) break;
    for (; step < sample.time * per_second - 0.5; ++step) {
      if (!jml::usable(filter.step(sensor, c.y((step + 1) * dt), dt).status)) return INFINITY;
    }
    worst =
        std::max(worst, continuous_check::distance(filter.estimate(), continuous_check::estimate_of(sample)));
  }
  return worst;
}

template <typename Rule, typename Samples>
void expect_first_order(const Rule& rule, const Samples& samples) {
  const double coarse = discrete_error(rule, samples, 2000), fine = discrete_error(rule, samples, 4000),
               finest = discrete_error(rule, samples, 8000);
  EXPECT_NEAR(continuous_check::order(coarse, fine, 2), 1, 0.1) << coarse << " " << fine;
  EXPECT_NEAR(continuous_check::order(fine, finest, 2), 1, 0.1) << fine << " " << finest;
  EXPECT_LT(finest, 0.02);
}

TEST(DiscreteLimit, Ekf) { expect_first_order(jml::Ekf{}, OscillatorCase::ekf); }
TEST(DiscreteLimit, Sddre) { expect_first_order(jml::Sddre{}, OscillatorCase::sddre); }
TEST(DiscreteLimit, Jml) { expect_first_order(jml::Jml{}, OscillatorCase::rnls); }
TEST(DiscreteLimit, IteratedJml) { expect_first_order(jml::IteratedJml{}, OscillatorCase::rnls); }

// Nonsymmetric P is what tells Jml from Ekf: with the wrong row of Table 1 there is no limit.
TEST(DiscreteLimit, AnotherRowDoesNotConverge) {
  EXPECT_GT(discrete_error(jml::Jml{}, OscillatorCase::ekf, 8000), 0.03);
  EXPECT_GT(discrete_error(jml::Ekf{}, OscillatorCase::rnls, 8000), 0.03);
}

}  // namespace
