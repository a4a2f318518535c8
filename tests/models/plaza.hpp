// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Range-only localisation, Plaza 1: a robot driven by its odometry, ranging radios with an unknown bias
/// each.
#pragma once

#include <cmath>
#include <jml/model/step_context.hpp>

namespace models {

/// x = (x, y, heading, one range bias per tag): m, m, rad, m. Control: (distance m, heading change rad) of
/// one odometry row. The disturbance is the odometry's error and a random walk of the biases, per row.
template <int tags>
struct PlazaRobot {
  static constexpr int states = 3 + tags, disturbances = 2 + tags, controls = 2;
  using At = jml::StepContext<double, 2>;
  double distance_sd = 0.005, distance_sd_slope = 0.05, turn_sd = 0.004, bias_walk = 1e-4;

  template <typename T>
  jml::Vector<T, states> dynamics(const jml::Vector<T, states>& x, const At& at) const {
    using std::cos, std::sin;
    const T middle = x(2) + 0.5 * at.control(1);
    jml::Vector<T, states> out = x;
    out(0) += at.control(0) * cos(middle);
    out(1) += at.control(0) * sin(middle);
    out(2) += at.control(1);
    return out;
  }
  jml::Matrix<double, states, disturbances> disturbance_input(const jml::Vector<double, states>& x,
                                                              const At& at) const {
    jml::Matrix<double, states, disturbances> G = jml::Matrix<double, states, disturbances>::Zero();
    const double middle = x(2) + 0.5 * at.control(1);
    G(0, 0) = std::cos(middle);
    G(1, 0) = std::sin(middle);
    G(0, 1) = -0.5 * at.control(0) * G(1, 0);
    G(1, 1) = 0.5 * at.control(0) * G(0, 0);
    G(2, 1) = 1;
    for (int i = 0; i < tags; ++i) G(3 + i, 2 + i) = 1;
    return G;
  }
  jml::Matrix<double, disturbances, disturbances> disturbance_covariance(const jml::Vector<double, states>&,
                                                                         const At& at) const {
    jml::Matrix<double, disturbances, disturbances> Q =
        bias_walk * jml::Matrix<double, disturbances, disturbances>::Identity();
    const double sd = distance_sd + distance_sd_slope * std::abs(at.control(0));
    Q(0, 0) = sd * sd;
    Q(1, 1) = turn_sd * turn_sd;
    return Q;
  }
};

/// Range to one tag, m: distance plus that tag's bias, the state 3 + index (tags = 0: no bias is modelled).
template <int tags>
struct RangeToTag {
  static constexpr int measurements = 1;
  jml::Vector<double, 2> position;
  int index = 0;
  double variance = 1;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 3 + tags>& x) const {
    using std::sqrt;
    const T east = x(0) - position(0), north = x(1) - position(1);
    T range = sqrt(east * east + north * north);
    if constexpr (tags > 0) range += x(3 + index);
    return jml::Vector<T, 1>(range);
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(variance); }
};

/// The same robot known by bounds: x = (x, y, heading); the disturbance is the error of an odometry row along
/// and across the heading (m) and of the turn (rad). Its push to second order, turn error times way, is below
/// a tenth of a millimetre a row.
struct BoundedPlazaRobot {
  static constexpr int states = 3, disturbances = 3, controls = 2;
  using At = jml::StepContext<double, 2>;
  double bound, bound_slope;  // m, m per m driven
  double turn_bound = 1e-6;   // rad; the rounding of the recording

  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x, const At& at) const {
    using std::cos, std::sin;
    const T middle = x(2) + 0.5 * at.control(1);
    return {x(0) + at.control(0) * cos(middle), x(1) + at.control(0) * sin(middle), x(2) + at.control(1)};
  }
  template <typename T>
  jml::Matrix<T, 3, 3> disturbance_input(const jml::Vector<T, 3>& x, const At& at) const {
    using std::cos, std::sin;
    const T east = cos(x(2) + 0.5 * at.control(1)), north = sin(x(2) + 0.5 * at.control(1));
    jml::Matrix<T, 3, 3> G;
    G << east, -north, T(0), north, east, T(0), T(0), T(0), T(1);
    return G;
  }
  jml::Vector<double, 3> disturbance_bound(const jml::Vector<double, 3>&, const At& at) const {
    const double way = bound + bound_slope * std::abs(at.control(0));
    return {way, way, turn_bound};
  }
};

/// Range to one tag with an error in offset ± bound, m.
struct BoundedRangeToTag {
  static constexpr int measurements = 1;
  jml::Vector<double, 2> position;
  double offset = 2.75, bound = 4.25;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 3>& x) const {
    using std::hypot;
    return jml::Vector<T, 1>(hypot(x(0) - position(0), x(1) - position(1)) + offset);
  }
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(bound); }
};

}  // namespace models
