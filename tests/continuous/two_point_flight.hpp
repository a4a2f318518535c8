// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Flights of the chapter's oscillator (Rusnak 2018, section 6) for the continuous smoother, and its
/// two-point problem (12) written once more by hand.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <jml/campaign/noise.hpp>
#include <jml/continuous/swept.hpp>
#include <vector>

#include "models/continuous.hpp"

namespace two_point_flight {

using X = jml::Vector<double, 2>;
using Square = jml::Matrix<double, 2, 2>;
using Smoother = jml::TwoPoint<models::Oscillator, models::SaturatingSignal>;

inline double output(double position) { return position / std::sqrt(1 + position * position); }
inline jml::Estimate<double, 2> chapters_start() { return {{0, 0}, Square{{0.001, 0}, {0, 0.001}}}; }

/// A model and where its estimate starts. The default: the chapter's.
struct Case {
  models::Oscillator oscillator{};
  models::SaturatingSignal sensor{};
  jml::Estimate<double, 2> start = chapters_start();
};
/// The other paper's oscillator and a start beside the truth, R = 1e-2: what (19) along the smoothed
/// trajectory was first tried on.
inline Case gentle() { return {{1, 0.1, 1, 1}, {1e-2}, {{1.5, 0.3}, Square{{0.25, 0}, {0, 0.25}}}}; }

/// y at 0, dt, … of the truth from (2, 0); both noises white in 100 rad/s, held for π/100 s, unless seed is
/// 0.
inline std::vector<double> flight(int steps, double dt, std::uint64_t seed, const Case& of = {}) {
  constexpr double band = 3.141592653589793 / 100;
  jml::Noise noise(seed);
  std::vector<double> y;
  double x = 2, v = 0, w = 0, e = 0;
  int drawn = 0;
  const auto pull = [&](double position, double velocity) {
    return -of.oscillator.k * position - 2 * of.oscillator.c * (position * position - 1) * velocity + w;
  };
  for (int i = 0; i <= steps; ++i) {
    while (seed != 0 && drawn * band <= i * dt) {
      w = noise.normal() * std::sqrt(1 / band);
      e = noise.normal() * std::sqrt(of.sensor.r / band);
      ++drawn;
    }
    y.push_back(output(x) + e);
    for (int k = 0; k < 4; ++k) {  // midpoint
      const double h = dt / 4, xm = x + h / 2 * v, vm = v + h / 2 * pull(x, v);
      x += h * vm;
      v += h * pull(xm, vm);
    }
  }
  return y;
}

/// Straight lines between the samples.
inline Smoother smoother_of(const std::vector<double>& y, double dt, const Case& of = {}) {
  const int steps = static_cast<int>(y.size()) - 1;
  Smoother smoother{of.oscillator, of.sensor, of.start, {.steps = steps}};
  for (std::size_t k = 0; k + 1 < y.size(); ++k)
    EXPECT_EQ(smoother.step(jml::Line{y[k], y[k + 1]}, dt), jml::Status::ok);
  return smoother;
}

/// The largest distance between two trajectories.
inline double distance(const Smoother& a, const Smoother& b) {
  double most = 0;
  for (int k = 0; k <= a.steps(); ++k) most = std::max(most, (a.x(k) - b.x(k)).norm());
  return most;
}

/// The right-hand side of (12) for z = (x, λ), with µ = 1, c = 0.01, k = 0.1, Q = 1, R = 1e-5.
using Z = std::array<double, 4>;
inline Z two_point_rate(const Z& z, double y) {
  const double s = 1 + z[0] * z[0], root = std::sqrt(s), nu = (y - z[0] / root) / 1e-5;
  return {z[1], -0.1 * z[0] - 0.02 * (z[0] * z[0] - 1) * z[1] + z[3],
          (0.1 + 0.04 * z[0] * z[1]) * z[3] - nu / (s * root), -z[2] + 0.02 * (z[0] * z[0] - 1) * z[3]};
}
/// From z over dt along the line from y0 to y1, by the classical Runge-Kutta method.
inline Z two_point_flow(Z z, double y0, double y1, double dt, int parts) {
  const double h = dt / parts;
  const auto moved = [](const Z& a, double by, const Z& slope) {
    Z out = a;
    for (std::size_t i = 0; i < 4; ++i) out[i] += by * slope[i];
    return out;
  };
  for (int k = 0; k < parts; ++k) {
    const auto y = [&](double share) { return y0 + (k + share) / parts * (y1 - y0); };
    const Z a = two_point_rate(z, y(0)), b = two_point_rate(moved(z, h / 2, a), y(0.5)),
            c = two_point_rate(moved(z, h / 2, b), y(0.5)), d = two_point_rate(moved(z, h, c), y(1));
    for (std::size_t i = 0; i < 4; ++i) z[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
  return z;
}
/// The residual of (12): by how much the flow from any node misses the next one, and both ends, relative to
/// the largest value of each of (x, λ).
inline double residual(const Smoother& smoother, const std::vector<double>& y, double dt, int parts) {
  const auto node = [&](int k) {
    return Z{smoother.x(k)(0), smoother.x(k)(1), smoother.costate(k)(0), smoother.costate(k)(1)};
  };
  Z size{}, worst{};
  for (int k = 0; k <= smoother.steps(); ++k) {
    for (std::size_t i = 0; i < 4; ++i) size[i] = std::max(size[i], std::abs(node(k)[i]));
  }
  const auto differ = [&](const Z& a, const Z& b) {
    for (std::size_t i = 0; i < 4; ++i) worst[i] = std::max(worst[i], std::abs(a[i] - b[i]) / size[i]);
  };
  for (int k = 0; k < smoother.steps(); ++k)
    differ(two_point_flow(node(k), y[std::size_t(k)], y[std::size_t(k) + 1], dt, parts), node(k + 1));
  const Z first = node(0), last = node(smoother.steps());
  differ(first, {0.001 * first[2], 0.001 * first[3], first[2], first[3]});  // x(0) = x̄ + P_0 λ(0)
  differ(last, {last[0], last[1], 0, 0});
  return *std::max_element(worst.begin(), worst.end());
}

}  // namespace two_point_flight
