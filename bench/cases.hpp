// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the step benchmarks are timed on: a model pair of tests/models, a start, and a period of 64
/// measurements around a nominal trajectory, repeated.
#pragma once

#include <array>
#include <cmath>
#include <jml/jml.hpp>

#include "../tests/models/dense.hpp"
#include "../tests/models/radar.hpp"
#include "../tests/models/van_der_pol.hpp"

namespace cases {

template <typename D, typename S>
struct Case {
  static constexpr int n = jml::states_of<D>, p = jml::measurements_of<S>;
  D dynamics;
  S sensor;
  jml::Estimate<double, n> start;
  std::array<jml::Vector<double, p>, 64> y;
};

using VanDerPol = Case<models::VanDerPol, models::SaturatingPosition>;
using Radar = Case<models::BallisticTarget, models::Radar>;
using Dense = Case<models::DenseDynamics<15>, models::DenseSensor<15, 6>>;

inline VanDerPol make_n2() {
  VanDerPol c;
  c.start = {{0.5, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};
  jml::Vector<double, 2> x{1, 0};
  for (int i = 0; i < 64; ++i) {
    x = c.dynamics.dynamics(x);
    c.y[i] = c.sensor.measurement(x);
    c.y[i](0) += 0.1 * std::sin(7.0 * i);
  }
  return c;
}

inline Radar make_n6() {
  Radar c;
  c.dynamics.gravity = 0;  // a level track that 64 samples can repeat without ever reaching the ground
  jml::Vector<double, 6> x;
  x << 40, 25, 12, -0.4, 0.1, 0.02;
  c.start.x = x;
  c.start.P = 1e-2 * jml::Matrix<double, 6, 6>::Identity();
  for (int i = 0; i < 64; ++i) {
    const double angle = 2 * 3.141592653589793 * i / 64;
    jml::Vector<double, 6> at = x;
    at(0) += 0.5 * std::sin(angle);
    at(1) += 0.5 * std::cos(angle);
    c.y[i] = c.sensor.measurement(at);
  }
  return c;
}

inline Dense make_n15() {
  Dense c;
  c.start.P = 0.1 * jml::Matrix<double, 15, 15>::Identity();
  jml::Vector<double, 15> x;
  for (int i = 0; i < 15; ++i) x(i) = std::sin(1.0 + i);
  for (int i = 0; i < 64; ++i) {
    for (int j = 0; j < 15; ++j) x(j) = std::sin(1.0 + j + 2 * 3.141592653589793 * i / 64);
    c.y[i] = c.sensor.measurement(x);
  }
  return c;
}

/// G Q Gᵀ of the model at the start.
template <typename Case>
bool process_noise(const Case& c, jml::Matrix<double, Case::n, Case::n>& noise) {
  return jml::ProcessNoise<double, decltype(c.dynamics)>(c.dynamics)
      .with(c.dynamics, c.start.x, jml::StepContext<double>{}, [&](const auto& GQG) { noise = GQG; });
}

}  // namespace cases
