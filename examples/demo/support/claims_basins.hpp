// SPDX-License-Identifier: BSD-3-Clause
// From where do the continuous filters find a truth that they are shown without noise? The chapter's
// oscillator, and two systems made to fail: a sensor that folds, and one that repeats.
#pragma once

#include <algorithm>
#include <cmath>
#include <jml/analysis/observability.hpp>
#include <jml/continuous/algebraic.hpp>
#include <jml/continuous/continuous.hpp>
#include <jml/riccati/davison_maki.hpp>
#include <numbers>

#include "oscillator.hpp"

namespace demo::claims {

enum class System { oscillator, fold, pendulum };

/// x = (position, velocity). oscillator: Rusnak 2018, section 6. fold: ξ'' = -ξ. pendulum: θ'' = -sin θ,
/// without friction. w pushes the velocity of each, Q = 1.
struct Plant {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 2, disturbances = 1;
  System system = System::oscillator;

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    using std::sin;
    if (system == System::oscillator) return models::Oscillator{}.dynamics(x);
    return {x(1), system == System::fold ? T(-x(0)) : T(-sin(x(0)))};
  }
  [[nodiscard]] jml::Matrix<double, 2, 2> dynamics_jacobian(const jml::Vector<double, 2>& x) const {
    if (system == System::oscillator) return models::Oscillator{}.dynamics_jacobian(x);
    return jml::Matrix<double, 2, 2>{{0, 1}, {system == System::fold ? -1 : -std::cos(x(0)), 0}};
  }
  [[nodiscard]] jml::Matrix<double, 2, 2> dynamics_sdc(const jml::Vector<double, 2>& x) const {
    if (system == System::oscillator) return models::Oscillator{}.dynamics_sdc(x);
    return jml::Matrix<double, 2, 2>{{0, 1}, {system == System::fold ? -1 : -over(x(0)), 0}};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 1}; }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(1.0); }

  /// sin(a)/a.
  static double over(double a) { return std::abs(a) < 1e-4 ? 1 - a * a / 6 : std::sin(a) / a; }
};

/// oscillator: y = ξ/√(1+ξ²), which saturates. fold: y = ξ/(1+ξ²), which falls beyond ξ = 1. pendulum: sin θ.
struct PlantSensor {
  static constexpr int measurements = 1;
  System system = System::oscillator;
  double r = 0.1;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sin;
    if (system == System::oscillator) return models::SaturatingPosition{}.measurement(x);
    return jml::Vector<T, 1>(system == System::fold ? T(x(0) / (1.0 + x(0) * x(0))) : T(sin(x(0))));
  }
  [[nodiscard]] jml::Matrix<double, 1, 2> measurement_jacobian(const jml::Vector<double, 2>& x) const {
    if (system == System::oscillator) return models::SaturatingPosition{}.measurement_jacobian(x);
    const double s = 1 + x(0) * x(0);
    return jml::Matrix<double, 1, 2>{
        {system == System::fold ? (1 - x(0) * x(0)) / (s * s) : std::cos(x(0)), 0}};
  }
  [[nodiscard]] jml::Matrix<double, 1, 2> measurement_sdc(const jml::Vector<double, 2>& x) const {
    if (system == System::oscillator) return models::SaturatingPosition{}.measurement_sdc(x);
    return jml::Matrix<double, 1, 2>{{system == System::fold ? 1 / (1 + x(0) * x(0)) : Plant::over(x(0)), 0}};
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(r); }
};

/// How the 81 starts of a grid ended.
struct Basin {
  int found = 0;      ///< the error at the end is below 0.05 (θ up to turns)
  int elsewhere = 0;  ///< it is not
  int refused = 0;    ///< a step was refused, and the run ended there
  int at_start = 0;   ///< of these, by the first step
  int full_rank = 0;  ///< not found, though the four ranks of the Remark were 2 all the way
  int escaped = 0;    ///< of these, by P that escaped to infinity
  long solutions = 0, cold = 0, samples = 0;  ///< algebraic equations solved, from nothing; samples taken
};

/// The four ranks of the Remark are 2 at x, and m_x M has the sign it had.
inline bool sound(const Plant& plant, const PlantSensor& sensor, const State& x, double& sign) {
  const auto at = jml::examine_sdc(plant, sensor, x);
  const double product = sensor.measurement_jacobian(x)(0) * sensor.measurement_sdc(x)(0);
  const bool crossed = sign * product < 0;  // a rank was lost between two samples
  sign = product;
  return !crossed && std::min({at.observable_sdc.rank, at.observable_jacobian.rank, at.controllable_sdc.rank,
                               at.controllable_jacobian.rank}) == 2;
}

/// Starts (i, j), i, j = -4 … 4. Truth from (2, 0), the pendulum's from (0.5, 0), for 40 s; samples every
/// 10 ms, y in straight lines between them. P_0 = I for the filters that carry a P. `watch`: look at the
/// ranks as well.
template <typename Method>
Basin basin(const Method& method, System system, double r, bool watch = false) {
  constexpr double dt = 0.01;
  constexpr std::size_t samples = 4000;
  const Plant plant{system};
  const PlantSensor sensor{system, r};
  std::vector<State> truth{system == System::pendulum ? State(0.5, 0) : State(2, 0)};
  for (std::size_t i = 0; i < samples; ++i) {
    State x = truth.back();
    const State a = plant.dynamics(x), b = plant.dynamics(State(x + dt / 2 * a)),
                c = plant.dynamics(State(x + dt / 2 * b)), d = plant.dynamics(State(x + dt * c));
    truth.push_back(x + dt / 6 * (a + 2 * b + 2 * c + d));
  }
  Basin out;
  for (int row = -4; row <= 4; ++row) {
    for (int column = -4; column <= 4; ++column) {
      const State start(row, column);
      const auto filter_from = [&] {
        if constexpr (requires { method.integrator; })
          return jml::Filter{method, plant, jml::Estimate<double, 2>{start, Riccati::Identity()}};
        else
          return jml::Filter{method, plant, start};
      };
      auto filter = filter_from();
      bool refused = false, full_rank = watch;
      double sign = 0;
      jml::Status last = jml::Status::ok;
      for (std::size_t i = 0; i < samples && !refused; ++i) {
        const double from = sensor.measurement(truth[i])(0), to = sensor.measurement(truth[i + 1])(0);
        const auto report = filter.step(sensor, jml::Line{from, to}, dt);
        last = report.status;
        refused = !jml::usable(last);
        out.at_start += refused && i == 0;
        ++out.samples;
        if (full_rank) full_rank = sound(plant, sensor, filter.x(), sign);
        if constexpr (requires { report.solutions; }) {
          out.solutions += report.solutions;
          out.cold += report.cold;
        }
      }
      State error = filter.x() - truth.back();
      if (system == System::pendulum) error(0) = std::remainder(error(0), 2 * std::numbers::pi);
      const bool found = !refused && error.norm() < 0.05;
      out.refused += refused;
      out.found += found;
      out.elsewhere += !refused && !found;
      out.full_rank += full_rank && !found;
      out.escaped += full_rank && last == jml::Status::riccati_escape;
    }
  }
  return out;
}

}  // namespace demo::claims
