// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The two examples of continuous_reference.hpp as filters, and their distance from it.
#pragma once

#include <algorithm>
#include <cmath>
#include <jml/continuous/continuous.hpp>
#include <jml/riccati/davison_maki.hpp>

#include "continuous/continuous_reference.hpp"
#include "models/continuous.hpp"
#include "models/time_varying.hpp"

namespace continuous_check {

namespace reference = continuous_reference;

template <int n>
jml::Estimate<double, n> estimate_of(const reference::Sample<n>& s) {
  jml::Estimate<double, n> e;
  for (int i = 0; i < n; ++i) {
    e.x(i) = s.x[i];
    for (int j = 0; j < n; ++j) e.P(i, j) = s.P[n * i + j];
  }
  return e;
}

/// Largest error of x over the largest entry of x, or of P(i, j) over √(P(i, i) P(j, j)): so each entry
/// counts.
template <typename Scalar, int n>
double distance(const jml::Estimate<Scalar, n>& a, const jml::Estimate<double, n>& b) {
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(a.x(i)) - b.x(i)) / b.x.cwiseAbs().maxCoeff());
    for (int j = 0; j < n; ++j)
      worst = std::max(worst, std::abs(static_cast<double>(a.P(i, j)) - b.P(i, j)) /
                                  std::sqrt(std::abs(b.P(i, i) * b.P(j, j))));
  }
  return worst;  // a NaN is smaller than everything: ask for ok, too
}

struct OscillatorCase {
  using Dynamics = models::Oscillator;
  static constexpr int n = 2;
  models::Oscillator dynamics;
  models::SaturatingSignal sensor;
  jml::Vector<double, 0> control;
  static jml::Estimate<double, n> start() { return estimate_of(reference::oscillator_start); }
  static jml::Vector<double, 1> y(double t) {
    return jml::Vector<double, 1>(reference::oscillator_signal(t));
  }
  static constexpr auto ekf = reference::oscillator_ekf;
  static constexpr auto sddre = reference::oscillator_sddre;
  static constexpr auto rnls = reference::oscillator_rnls;
};

struct TimeVaryingCase {
  using Dynamics = models::TimeVaryingPlant;
  static constexpr int n = 3;
  models::TimeVaryingPlant dynamics;
  models::TimeVaryingSensor sensor;
  jml::Vector<double, 1> control{reference::time_varying_control};
  static jml::Estimate<double, n> start() { return estimate_of(reference::time_varying_start); }
  static jml::Vector<double, 2> y(double t) {
    const auto s = reference::time_varying_signal(t);
    return {s[0], s[1]};
  }
  static constexpr auto ekf = reference::time_varying_ekf;
  static constexpr auto sddre = reference::time_varying_sddre;
  static constexpr auto rnls = reference::time_varying_rnls;
};

/// Largest distance from the reference at its instants up to `last`; infinite after a refusal.
/// `intervals_per_second` steps of the filter, each as the integrator pleases.
template <typename Case, typename Rule, typename Integrator, typename Samples>
double error(const Rule& rule, const Integrator& integrator, const Samples& samples, int intervals_per_second,
             double last = 100) {
  const Case c{};
  jml::Filter filter{jml::Continuous{rule, integrator}, c.dynamics, Case::start()};
  double worst = 0;
  for (const auto& sample : samples) {
    if (sample.time > last) break;
    const double begin = filter.time();
    const int count =
        std::max(1, static_cast<int>(std::lround((sample.time - begin) * intervals_per_second)));
    for (int i = 0; i < count; ++i) {
      const double dt = begin + (sample.time - begin) * (i + 1) / count - filter.time();
      const auto report = filter.step(c.sensor, [](double t) { return Case::y(t); }, dt, c.control);
      if (report.status != jml::Status::ok) return INFINITY;
    }
    worst = std::max(worst, distance(filter.estimate(), estimate_of(sample)));
    if (!jml::all_finite(filter.x()) || !jml::all_finite(filter.P())) return INFINITY;
  }
  return worst;
}

/// The slope of log(error) over log(step) between two errors.
inline double order(double coarse, double fine, double ratio) {
  return std::log(coarse / fine) / std::log(ratio);
}

}  // namespace continuous_check
