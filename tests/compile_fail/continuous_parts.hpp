// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A correct continuous model of one measurement and one of two, and their sensors.
#pragma once

#include <jml/continuous/continuous.hpp>

#include "parts.hpp"

namespace parts {

struct Flow : WithInput {
  using time_domain = jml::ContinuousTime;
  static constexpr bool linear = true;
  Matrix1 disturbance_spectral_density() const { return Matrix1(1); }
};
struct LinearPosition : Position {
  static constexpr bool linear = true;
};
struct Signal : LinearPosition {
  Matrix1 noise_spectral_density() const { return Matrix1(1); }
};
struct Signals {
  static constexpr int measurements = 2;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return x;
  }
  Matrix2 noise_spectral_density() const { return Matrix2::Identity(); }
};

}  // namespace parts
