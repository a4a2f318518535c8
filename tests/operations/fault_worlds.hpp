// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The flights that faults are scripted into: a ballistic target and its radar, Van der Pol's oscillator.
#pragma once

#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>

#include "models/radar.hpp"
#include "models/van_der_pol.hpp"
#include "operations/faults.hpp"

namespace faults {

/// Discrete dynamics and one sensor, a sample every dt.
template <typename Base, int n, int p>
struct SampledWorld : Base {
  using Flight = Tape<n, p>;
  using Y = jml::Vector<double, p>;
  Script script{};
  template <typename F, typename C>
  jml::Status sample(F& filter, C& channel, const Flight&, int, const Y& y) const {
    return channel.step(filter, y, Base::dt);
  }
  template <typename F>
  jml::Status pass(F& filter, const Flight&, int) const {
    return filter.predict(Base::dt);
  }
  /// A flight from a state drawn about the start.
  [[nodiscard]] Flight fly(std::uint64_t seed, bool jumps) const {
    jml::Noise noise(seed);
    Flight tape;
    tape.sd = this->noise_deviation();
    jml::Vector<double, n> x = this->start().x;
    for (int i = 0; i < n; ++i) x(i) += std::sqrt(this->start().P(i, i)) * noise.normal();
    for (int k = 0; k < script.samples; ++k) {
      x = this->next(x, noise);
      if (jumps && k == script.begin) x += this->jump();
      Y y = this->sensor.measurement(x);
      for (int i = 0; i < p; ++i) y(i) += tape.sd(i) * noise.normal();
      tape.truth.push_back(x);
      tape.y.push_back(y);
    }
    return tape;
  }
};

struct RadarBase {
  static constexpr double dt = 0.1;
  models::BallisticTarget target;
  models::Radar sensor;
  static jml::Estimate<double, 6> start() {
    jml::Vector<double, 6> x, variances;
    x << 40, 30, 5, -0.3, -0.2, 0.4;
    variances << 1, 1, 1, 0.01, 0.01, 0.01;
    return {x, jml::Matrix<double, 6, 6>(variances.asDiagonal())};
  }
  static jml::Vector<double, 3> noise_deviation() { return {0.02, 2e-3, 2e-3}; }
  /// 100 deviations of the steady predicted position (0.02 to 0.04 km at sample 250).
  static jml::Vector<double, 6> jump() {
    jml::Vector<double, 6> by = jml::Vector<double, 6>::Zero();
    by.head<3>() << 2.5, 2.5, 3;
    return by;
  }
  [[nodiscard]] jml::Vector<double, 6> next(const jml::Vector<double, 6>& x, jml::Noise& noise) const {
    jml::Vector<double, 6> out = target.dynamics(x);
    for (int i = 0; i < 3; ++i) out(3 + i) += dt * 1e-2 * noise.normal();
    return out;
  }
  static double error(const jml::Vector<double, 6>& estimate, const jml::Vector<double, 6>& truth) {
    return (estimate - truth).head<3>().norm();
  }
  static jml::Lockout<6> policy() {
    jml::Lockout<6> lockout{.after = 20, .recovery = jml::Recovery::inflate};
    lockout.variances << 100, 100, 100, 1, 1, 1;
    return lockout;
  }
};
using RadarWorld = SampledWorld<RadarBase, 6, 3>;

struct VanDerPolBase {
  static constexpr double dt = 0.05;
  models::VanDerPol target;
  models::SaturatingPosition sensor;
  static jml::Estimate<double, 2> start() {
    return {jml::Vector<double, 2>(1, 0),
            jml::Matrix<double, 2, 2>(0.1 * jml::Matrix<double, 2, 2>::Identity())};
  }
  static jml::Vector<double, 1> noise_deviation() { return jml::Vector<double, 1>(std::sqrt(0.02)); }
  static jml::Vector<double, 2> jump() {
    return {3, 0};
  }  // more than its amplitude; 100 deviations would be 30
  [[nodiscard]] jml::Vector<double, 2> next(const jml::Vector<double, 2>& x, jml::Noise& noise) const {
    return target.dynamics(x) + jml::Vector<double, 2>(0, dt * std::sqrt(20.0) * noise.normal());
  }
  static double error(const jml::Vector<double, 2>& estimate, const jml::Vector<double, 2>& truth) {
    return std::abs(estimate(0) - truth(0));
  }
  static jml::Lockout<2> policy() {
    jml::Lockout<2> lockout{.after = 20, .recovery = jml::Recovery::inflate};
    lockout.variances << 1, 1;
    return lockout;
  }
};
using VanDerPolWorld = SampledWorld<VanDerPolBase, 2, 1>;

}  // namespace faults
