// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Range-only localisation, Plaza 1: a robot driven by its odometry, ranging radios with an unknown bias
/// each.
#pragma once

#include <cmath>
#include <jml/model/instant.hpp>

namespace models {

/// x = (x, y, heading, one range bias per tag): m, m, rad, m. Control: (distance m, heading change rad) of
/// one odometry row. The disturbance is the odometry's error and a random walk of the biases, per row.
template <int tags>
struct PlazaRobot {
  static constexpr int states = 3 + tags, disturbances = 2 + tags, controls = 2;
  using At = jml::Instant<double, 2>;
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

}  // namespace models
