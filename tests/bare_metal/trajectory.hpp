// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The runs that host and target both make: 200 filter steps on the Van der Pol oscillator from the same
/// measurements, of which every tenth estimate is kept.
#pragma once

#include <cstddef>
#include <jml/jml.hpp>

#include "models/continuous.hpp"

namespace bare_metal {

inline constexpr int steps = 200, kept_every = 10, numbers_kept = 6;

/// (x, P by columns) of the kept estimates.
using Table = double[steps / kept_every][numbers_kept];

/// One run; false as soon as a step is refused.
using Run = bool(const double (&y)[steps], Table& table);
Run ekf_double, ekf_float, factored_double, factored_float, ekf_6, factored_6, ekf_15, factored_15;
Run jml_double, jml_float, iterated_jml_double, iterated_jml_float;
Run runge_kutta_double, runge_kutta_float, davison_maki_double, davison_maki_float, algebraic_double,
    algebraic_float;
Run linearised_box_double, linearised_box_float, guaranteed_box_double, guaranteed_box_float;
Run strapdown_double, strapdown_float;
Run restored_ekf, restored_lag;

struct Case {
  const char* name;
  Run* run;
  double tolerance;  // of host against target, relative to the largest value of the column
};
inline constexpr Case cases[] = {
    // The target contracts a*b + c into one rounding and the host does not, so results are some roundings
    // apart (measured: 8e-16, float: 4e-7); the tolerance leaves room for other compilers. An iterated step
    // stops within its own tolerance of the root (1e-12, float: 1e-5), perhaps a sweep earlier or later.
    {"EKF, double", ekf_double, 1e-13},
    {"EKF, float", ekf_float, 1e-5},
    {"factored EKF, double", factored_double, 1e-13},
    {"factored EKF, float", factored_float, 1e-5},
    {"EKF, n = 6", ekf_6, 1e-12},
    {"factored EKF, n = 6", factored_6, 1e-12},
    {"EKF, n = 15", ekf_15, 1e-12},
    {"factored EKF, n = 15", factored_15, 1e-12},
    {"JML, double", jml_double, 1e-13},
    {"JML, float", jml_float, 1e-5},
    {"iterated JML, double", iterated_jml_double, 1e-11},
    {"iterated JML, float", iterated_jml_float, 1e-4},
    {"RNLS, RungeKutta4, double", runge_kutta_double, 1e-13},
    {"RNLS, RungeKutta4, float", runge_kutta_float, 1e-5},
    {"RNLS, DavisonMaki, double", davison_maki_double, 1e-12},
    {"RNLS, DavisonMaki, float", davison_maki_float, 1e-4},
    {"algebraic RNLS, double", algebraic_double, 1e-11},
    {"algebraic RNLS, float", algebraic_float, 1e-3},
    {"bounded noise, linearised, double", linearised_box_double, 1e-13},
    {"bounded noise, linearised, float", linearised_box_float, 1e-5},
    {"bounded noise, guaranteed, double", guaranteed_box_double, 1e-12},
    {"bounded noise, guaranteed, float", guaranteed_box_float, 1e-3},
    {"strapdown EKF, 15 degrees, double", strapdown_double, 1e-10},
    {"strapdown EKF, 15 degrees, float", strapdown_float, 1e-2},
    {"EKF, saved and restored", restored_ekf, 1e-13},
    {"fixed lag of 4, saved and restored", restored_lag, 1e-11},
};
inline constexpr std::size_t case_count = sizeof(cases) / sizeof(cases[0]);

/// Steps `filter` through the measurements and keeps x and `matrix()` of every tenth estimate.
template <typename Filter, typename Step, typename Matrix>
bool keep(const Filter& filter, const double (&y)[steps], Table& table, const Step& step,
          const Matrix& matrix) {
  for (int i = 0; i < steps; ++i) {
    if (!jml::usable(step(y[i]).status)) return false;
    if ((i + 1) % kept_every != 0) continue;
    double(&row)[numbers_kept] = table[i / kept_every];
    for (int k = 0; k < 2; ++k) row[k] = static_cast<double>(filter.x()(k));
    for (int k = 0; k < 4; ++k) row[2 + k] = static_cast<double>(matrix()(k % 2, k / 2));
  }
  return true;
}

template <typename Scalar>
jml::Estimate<Scalar, 2> start() {
  return {jml::Vector<Scalar, 2>(Scalar(0.5), Scalar(0)),
          Scalar(0.1) * jml::Matrix<Scalar, 2, 2>::Identity()};
}

template <typename Scalar, typename Rule>
bool run(const Rule& rule, const double (&y)[steps], Table& table) {
  jml::Filter filter{rule, models::VanDerPol{}, start<Scalar>()};
  return keep(
      filter, y, table,
      [&](double sample) { return filter.step(models::SaturatingPosition{}, static_cast<Scalar>(sample)); },
      [&] { return filter.P(); });
}

/// The same with bounds alone; the noise of the measurements is within ±0.1, and nothing disturbs. Kept: the
/// box.
struct Pushed : models::VanDerPol {
  jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(0.1); }
};
struct BoundedPosition : models::SaturatingPosition {
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(0.1); }
};

template <typename Scalar, typename Rule>
bool run_box(const Rule& rule, const double (&y)[steps], Table& table) {
  using State = jml::Vector<Scalar, 2>;
  const jml::Box box{State(Scalar(0.8), Scalar(-0.2)), State(Scalar(1.2), Scalar(0.2))};
  jml::Filter filter{rule, Pushed{}, box};
  return keep(
      filter, y, table,
      [&](double sample) { return filter.step(BoundedPosition{}, static_cast<Scalar>(sample)); },
      [&] {
        jml::Matrix<Scalar, 2, 2> sides;
        sides << filter.box().lower, filter.box().upper;
        return sides;
      });
}

/// The same in continuous time: the samples held over 50 ms each, white noise of the same power.
inline constexpr double dt = 0.05;
inline constexpr models::Oscillator oscillator{.c = 0.1, .k = 1};
inline constexpr models::SaturatingSignal signal{1e-3};

template <typename Scalar, typename Integrator>
bool run_continuous(const Integrator& integrator, const double (&y)[steps], Table& table) {
  jml::Filter filter{jml::Continuous{jml::Rnls{}, integrator}, oscillator, start<Scalar>()};
  return keep(
      filter, y, table,
      [&](double sample) {
        return filter.step(signal, static_cast<Scalar>(sample), static_cast<Scalar>(dt));
      },
      [&] { return filter.P(); });
}

template <typename Scalar>
bool run_algebraic(const double (&y)[steps], Table& table) {
  jml::Filter filter{jml::Algebraic{jml::Rnls{}, {.gain = jml::GainUpdate::every_sample}}, oscillator,
                     start<Scalar>().x};
  return keep(
      filter, y, table,
      [&](double sample) {
        return filter.step(signal, static_cast<Scalar>(sample), static_cast<Scalar>(dt));
      },
      [&] { return filter.P(); });
}

}  // namespace bare_metal
