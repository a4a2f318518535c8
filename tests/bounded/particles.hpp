// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Enclosure by brute force: points of the prior box, pushed through the true f with admissible disturbances
/// and kept while they explain every measurement, must never be outside the box of an estimator.
#pragma once

#include <gtest/gtest.h>

#include <jml/bounded/bounded_noise.hpp>
#include <vector>

#include "models/bounded.hpp"

namespace particles {

/// Inside, to the rounding of the particle's own simulation.
template <int n>
bool inside(const jml::Box<double, n>& box, const jml::Vector<double, n>& x) {
  const jml::Vector<double, n> slack = 1e-12 * (jml::Vector<double, n>::Ones() + x.cwiseAbs());
  return ((x - box.lower + slack).array() >= 0).all() && ((box.upper - x + slack).array() >= 0).all();
}

/// True where v = y - m(x) is within its bound, by more than rounding.
template <typename S, int n, int p>
bool explains(const S& sensor, const jml::Vector<double, n>& x, const jml::Vector<double, p>& y) {
  const jml::StepContext<double> none;
  const jml::Vector<double, p> v =
      jml::measurement_residual(sensor, y, jml::Vector<double, p>(sensor.measurement(x)));
  return ((jml::noise_bound(sensor, x, none) - v.cwiseAbs()).array() >= 1e-12).all();
}

template <typename D>
jml::Vector<double, D::states> push(const D& plant, const jml::Vector<double, D::states>& x,
                                    jml::Noise& noise) {
  const jml::StepContext<double> none;
  const jml::Vector<double, D::disturbances> bound = jml::disturbance_bound(plant, x, none);
  const bool corner = noise.uniform() < 0.7;
  const jml::Vector<double, D::disturbances> w = models::within(bound, noise, corner);
  return jml::predicted_state(plant, x, none) + jml::disturbance_input(plant, x, none) * w;
}

struct Outcome {
  int outside = 0, refused = 0;
  long checked = 0;
};

/// One run: the truth is the first particle. Half of the others start in corners of the prior box.
template <typename Rule, typename D, typename S, int n>
Outcome run(const Rule& rule, const D& plant, const S& sensor, const jml::Box<double, n>& prior, int steps,
            int count, jml::Noise& noise) {
  constexpr int p = S::measurements;
  const jml::StepContext<double> none;
  Outcome out;
  jml::Filter filter{rule, plant, prior};
  std::vector<jml::Vector<double, n>> cloud;
  for (int i = 0; i < count; ++i) cloud.push_back(models::point_of(prior, noise, i % 2 == 1));
  for (int k = 0; k < steps; ++k) {
    for (auto& x : cloud) x = push(plant, x, noise);
    const jml::Vector<double, p> b = jml::noise_bound(sensor, cloud[0], none) * (1 - 1e-9);
    const jml::Vector<double, p> v = models::within(b, noise, noise.uniform() < 0.3);
    const jml::Vector<double, p> y = sensor.measurement(cloud[0]) + v;
    out.refused += filter.step(sensor, y).status != jml::Status::ok;
    std::vector<jml::Vector<double, n>> kept;
    for (const auto& x : cloud) {
      if (!explains(sensor, x, y)) continue;
      kept.push_back(x);
      ++out.checked;
      out.outside += !inside(filter.box(), x);
    }
    if (kept.empty()) kept.push_back(cloud[0]);
    const std::size_t alive = kept.size();
    for (std::size_t i = 0; kept.size() < cloud.size(); ++i) kept.push_back(kept[i % alive]);
    cloud = kept;
  }
  return out;
}

/// Many runs from random boxes about random centres, of half widths up to `half`.
template <typename Rule, typename D, typename S, int n>
void never_outside(const Rule& rule, const D& plant, const S& sensor, const jml::Box<double, n>& centres,
                   const jml::Vector<double, n>& half, int runs, int steps, std::uint64_t seed) {
  SCOPED_TRACE(seed);
  jml::Noise noise(seed);
  Outcome all;
  for (int i = 0; i < runs; ++i) {
    const jml::Vector<double, n> centre = models::point_of(centres, noise);
    const double size = noise.uniform();
    const jml::Vector<double, n> below = half * size * noise.uniform(), above = half * size * noise.uniform();
    const Outcome one =
        run(rule, plant, sensor, jml::Box<double, n>{centre - below, centre + above}, steps, 300, noise);
    all.outside += one.outside;
    all.refused += one.refused;
    all.checked += one.checked;
  }
  EXPECT_EQ(all.outside, 0);
  EXPECT_EQ(all.refused, 0);
  EXPECT_GT(all.checked, 50L * runs * steps);
}

}  // namespace particles
