// SPDX-License-Identifier: BSD-3-Clause
// Three ways to give the 100 Hz of the log of a car (car_log.hpp) to an estimator: a step each sample, a step
// each fix that integrates the samples between, and a step each fix with these samples integrated once.
#pragma once

#include <cmath>
#include <jml/jml.hpp>
#include <vector>

#include "../../navigation/strapdown.hpp"
#include "car_log.hpp"
#include "statistics.hpp"

namespace demo {

using Vector3 = jml::Vector<double, 3>;
using CarState = navigation::State<double>;
using CarEstimate = jml::Estimate<double, navigation::numbers, navigation::degrees>;

/// What is believed of the noises; the log's metadata give the first two and the walks.
struct CarNoise {
  double gyro, force;           // densities, rad/s/√Hz and m/s²/√Hz
  double horizontal, vertical;  // of a fix, standard deviations, m
  double gyro_walk, force_walk;

  /// A variance of 0.07 m² of a fix, which gtsam's example has.
  static CarNoise of_metadata(const CarLog& log) {
    return {log.gyro_noise, log.force_noise, std::sqrt(0.07), std::sqrt(0.07), log.gyro_walk, log.force_walk};
  }
  [[nodiscard]] navigation::Grade grade() const { return {gyro, force, gyro_walk, force_walk}; }
  [[nodiscard]] navigation::GnssPosition sensor() const { return {{0, 0, 0}, horizontal, vertical}; }
};

constexpr double car_gravity = 9.8;  // m/s², as in gtsam's example; the rest is the accelerometers' bias

/// One inertial sample a step.
struct EverySample : navigation::Strapdown {
  EverySample(const CarLog&, const CarNoise& noise) : Strapdown{noise.grade(), car_gravity} {}
  [[nodiscard]] static jml::Vector<double, 6> control_of(const CarLog& log, std::size_t k, std::size_t) {
    return log.samples[k].rate_and_force;
  }
};

/// All samples between two fixes in one step: control = (the first, how many). The noise of the gyros and
/// accelerometers is held over the step, with the covariance of its mean: that of the position is a quarter
/// too small.
struct EveryFix : navigation::Strapdown {
  static constexpr int controls = 2;
  const CarLog* log;
  EveryFix(const CarLog& of, const CarNoise& noise) : Strapdown{noise.grade(), car_gravity}, log(&of) {}
  [[nodiscard]] static jml::Vector<double, 2> control_of(const CarLog&, std::size_t first,
                                                         std::size_t count) {
    return {static_cast<double>(first), static_cast<double>(count)};
  }

  template <typename T>
  navigation::State<T> dynamics(const navigation::State<T>& x, const jml::Vector<T, 12>& w,
                                const auto& at) const {
    const auto first = static_cast<std::size_t>(at.control(0)),
               count = static_cast<std::size_t>(at.control(1));
    jml::Vector<T, 12> held = w;
    for (int i = 6; i < 12; ++i) held(i) = T(0);
    navigation::State<T> next = x;
    for (std::size_t k = first; k < first + count; ++k) {
      const auto& sample = log->samples[k];
      next =
          Strapdown::dynamics(next, held, jml::StepContext<double, 6>{0, sample.dt, sample.rate_and_force});
    }
    for (int i = 0; i < 6; ++i) next(navigation::gyro_bias + i) = next(navigation::gyro_bias + i) + w(6 + i);
    return next;
  }
};

/// What the samples between two fixes say, from the axes of the body at the first: turn, way and change of
/// velocity without gravity, their slopes by the biases, and the covariance of their noise.
struct Increment {
  using Square = jml::Matrix<double, navigation::degrees, navigation::degrees>;
  CarState x = navigation::Space::origin<double>();
  Square slope = Square::Zero(), Q = Square::Zero();

  /// Two filters without measurements do it: one without noise, from P = I, in whose P the slopes are the
  /// covariances with the biases, and one with noise, from next to nothing.
  void integrate(const CarLog& log, const CarNoise& noise, std::size_t first, std::size_t count) {
    const CarState still = navigation::Space::origin<double>();
    const navigation::Grade none{0, 0, 0, 0};
    jml::Filter biased{jml::Ekf{}, navigation::Strapdown{none, 0}, CarEstimate{still, Square::Identity()}};
    jml::Filter noisy{jml::Ekf{}, navigation::Strapdown{noise.grade(), 0},
                      CarEstimate{still, 1e-14 * Square::Identity()}};
    for (std::size_t k = first; k < first + count; ++k) {
      static_cast<void>(biased.predict(log.samples[k].dt, log.samples[k].rate_and_force));
      static_cast<void>(noisy.predict(log.samples[k].dt, log.samples[k].rate_and_force));
    }
    x = noisy.x();
    slope = biased.P();
    Q = noisy.P();
  }
};

/// The samples between two fixes integrated once, before (Lupton and Sukkarieh 2012, Forster et al. 2017): to
/// first order in the biases. control = (number of the first sample, how many).
struct Preintegrated {
  using Space = navigation::Space;
  static constexpr int disturbances = navigation::degrees, controls = 2;
  const std::vector<Increment>* increments;  // by the first sample

  explicit Preintegrated(const std::vector<Increment>& of) : increments(&of) {}
  [[nodiscard]] static jml::Vector<double, 2> control_of(const CarLog& log, std::size_t first,
                                                         std::size_t count) {
    return EveryFix::control_of(log, first, count);
  }

  /// w: in the tangent at what the samples say, with the steps of the biases' walks.
  template <typename T>
  navigation::State<T> dynamics(const navigation::State<T>& x, const jml::Vector<T, disturbances>& w,
                                const auto& at) const {
    using namespace navigation;
    const Increment& by = (*increments)[static_cast<std::size_t>(at.control(0))];
    jml::Vector<T, degrees> off = jml::Vector<T, degrees>::Zero();
    for (int i = 0; i < 9; ++i) {
      off(i) = w(i);
      for (int j = 0; j < 6; ++j) off(i) = off(i) + x(gyro_bias + j) * by.slope(i, 9 + j);
    }
    State<T> said;
    for (int i = 0; i < numbers; ++i) said(i) = T(by.x(i));
    said = Space::plus(said, off);

    const jml::Vector<T, 4> q = attitude_of(x);
    const jml::Vector<T, 3> way = jml::rotate(q, jml::Vector<T, 3>(said.template segment<3>(position)));
    const jml::Vector<T, 3> change = jml::rotate(q, jml::Vector<T, 3>(said.template segment<3>(velocity)));
    const double dt = at.dt;
    State<T> next;
    next.template head<4>() = jml::quaternion_product(q, attitude_of(said));
    for (int i = 0; i < 3; ++i) {
      next(position + i) = x(position + i) + x(velocity + i) * dt + way(i);
      next(velocity + i) = x(velocity + i) + change(i);
    }
    next(position + 2) = next(position + 2) - car_gravity * dt * dt / 2;
    next(velocity + 2) = next(velocity + 2) - car_gravity * dt;
    for (int i = 0; i < 6; ++i) next(gyro_bias + i) = x(gyro_bias + i) + w(9 + i);
    return next;
  }
  [[nodiscard]] Increment::Square disturbance_covariance(const CarState&, const auto& at) const {
    return (*increments)[static_cast<std::size_t>(at.control(0))].Q;
  }
};

/// Of every step from a fix to the next, by its first sample. `watch`: of one.
inline std::vector<Increment> increments_of(const CarLog& log, const CarNoise& noise, Stopwatch& watch) {
  std::vector<Increment> out(log.samples.size());
  for (std::size_t i = CarLog::first + 1; i < log.fixes.size(); ++i) {
    const std::size_t first = log.fixes[i - 1].sample + 1;
    watch.start();
    out[first].integrate(log, noise, first, log.fixes[i].sample + 1 - first);
    watch.stop();
  }
  return out;
}

}  // namespace demo
