// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A model with parts of it taken away, to see what the library derives in their place.
#pragma once

#include <jml/model/functions.hpp>

namespace models {

/// The dynamics alone: no Jacobian, no SDC.
template <typename Model>
struct Bare {
  static constexpr int states = Model::states, disturbances = Model::disturbances;
  Model model{};
  template <typename T>
  jml::Vector<T, states> dynamics(const jml::Vector<T, states>& x) const {
    return model.dynamics(x);
  }
  auto disturbance_input() const { return model.disturbance_input(); }
  auto disturbance_covariance() const { return model.disturbance_covariance(); }
};

/// Dynamics and Jacobian in double only, as older code has them: no dual number can pass.
template <typename Model>
struct DoubleOnly {
  static constexpr int states = Model::states, disturbances = Model::disturbances;
  Model model{};
  jml::Vector<double, states> dynamics(const jml::Vector<double, states>& x) const { return model.dynamics(x); }
  jml::Matrix<double, states, states> dynamics_jacobian(const jml::Vector<double, states>& x) const { return model.dynamics_jacobian(x); }
  auto disturbance_input() const { return model.disturbance_input(); }
  auto disturbance_covariance() const { return model.disturbance_covariance(); }
};

/// The measurement alone, with its residual where it has one.
template <typename Model>
struct BareSensor {
  static constexpr int measurements = Model::measurements;
  Model model{};
  template <typename T, int n>
  jml::Vector<T, measurements> measurement(const jml::Vector<T, n>& x) const {
    return model.measurement(x);
  }
  template <typename T>
  jml::Vector<T, measurements> residual(const jml::Vector<T, measurements>& y, const jml::Vector<T, measurements>& predicted) const {
    return jml::measurement_residual(model, y, predicted);
  }
  auto noise_covariance() const { return model.noise_covariance(); }
};

}  // namespace models
