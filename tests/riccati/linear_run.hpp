// SPDX-License-Identifier: BSD-3-Clause
// Shared by the tests on linear systems: a Kalman filter in long double, and a run to compare the library
// with.
#pragma once

#include <gtest/gtest.h>

#include <jml/jml.hpp>
#include <vector>

#include "models/linear.hpp"
#include "riccati/oracle.hpp"

namespace linear_run {

using oracle::big;
using oracle::Big;

// 1e-12 of the largest entry over 1000 steps: the filters are stable, so rounding does not add up.
inline constexpr double tolerance = 1e-12;
inline constexpr int steps = 1000;

/// Kalman (1960) in long double, Joseph form; nothing of the library.
struct Reference {
  Big x, P;

  void predict(const Big& F, const Big& noise) {
    x = Big(F * x);
    P = Big(F * P * F.transpose() + noise);
  }
  void update(const Big& M, const Big& R, const Big& y) {
    const oracle::Slots here{Big::Identity(P.rows(), P.cols()),
                             Big::Identity(P.rows(), P.cols()),
                             M,
                             M,
                             Big::Zero(P.rows(), P.cols()),
                             R};
    const auto posterior = oracle::joseph(here, x, P, y - M * x);
    x = posterior.x;
    P = posterior.P;
  }
};

/// What one run gives to compare: the oracle after every sample, and the measurements.
template <int n, int p>
struct Run {
  models::LinearDynamics<n, 2> dynamics;
  models::LinearSensor<n, p> sensor;
  jml::Estimate<double, n> start;
  std::vector<jml::Vector<double, p>> y;
  std::vector<bool> dropped;
  std::vector<Reference> wanted;
  double scale = 0;  // largest |x| of the run: an estimate that passes through zero has no relative error

  explicit Run(unsigned seed) {
    jml::Noise noise(seed);
    dynamics = models::random_linear_dynamics<n, 2>(noise);
    sensor = models::random_linear_sensor<n, p>(noise);
    start = {models::random_matrix<n, 1>(noise), models::random_covariance<n>(noise, 0.1)};
    const Big F = big(dynamics.F), G = big(dynamics.G), M = big(sensor.M), R = big(sensor.R);
    const Big GQG = G * big(dynamics.Q) * G.transpose();
    Reference reference{big(start.x), big(start.P)};
    jml::Vector<double, n> truth = start.x;
    for (int i = 0; i < steps; ++i) {
      truth = dynamics.F * truth + dynamics.G * noise.normal_vector(dynamics.Q);
      y.push_back(sensor.M * truth + noise.normal_vector(sensor.R));
      dropped.push_back(noise.uniform() < 0.2);
      reference.predict(F, GQG);
      if (!dropped.back()) reference.update(M, R, big(y.back()));
      wanted.push_back(reference);
      scale = std::max(scale, static_cast<double>(reference.x.cwiseAbs().maxCoeff()));
    }
  }

  template <typename Rule>
  void expect_kalman(const Rule& rule, const char* name, double asked = tolerance) const {
    SCOPED_TRACE(name);
    jml::Filter filter{rule, dynamics, start};
    double worst_x = 0, worst_P = 0;
    for (std::size_t i = 0; i < steps; ++i) {
      const jml::Status status = dropped[i] ? filter.predict() : filter.step(sensor, y[i]).status;
      ASSERT_TRUE(jml::usable(status)) << jml::describe(status) << " at " << i;
      const long double off = (big(filter.x()) - wanted[i].x).cwiseAbs().maxCoeff();
      worst_x = std::max(worst_x, static_cast<double>(off) / scale);
      worst_P = std::max(worst_P, oracle::distance(filter.P(), wanted[i].P));
    }
    EXPECT_LT(worst_x, asked);
    EXPECT_LT(worst_P, asked);
  }
};

}  // namespace linear_run
