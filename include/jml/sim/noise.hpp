// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random numbers that do not depend on the standard library (log and cos may differ in the last place), for
/// tests, demos and campaigns.
#pragma once

#include <cmath>
#include <cstdint>
#include <jml/factors.hpp>
#include <random>

namespace jml {

/// Standard uniform and normal numbers from std::mt19937_64, whose output the C++ standard fixes; the
/// standard's distributions are not fixed, so these are Box and Muller's. Draw one number a statement: the
/// order in which function arguments are evaluated is not fixed either.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in (0, 1).
  double uniform() { return (static_cast<double>(engine_() >> 12) + 0.5) * 0x1p-52; }
  /// Uniform in (low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Normal, mean 0, variance 1.
  double normal() {
    const double radius = std::sqrt(-2 * std::log(uniform()));
    const double angle = 6.283185307179586 * uniform();
    return radius * std::cos(angle);
  }

  /// n independent standard normals.
  template <int n>
  Vector<double, n> normal_vector() {
    Vector<double, n> out;
    for (int i = 0; i < n; ++i) out(i) = normal();
    return out;
  }

  /// Normal with mean 0 and covariance `covariance`, n×n, symmetric positive semidefinite.
  template <int n>
  Vector<double, n> normal_vector(const Matrix<double, n, n>& covariance) {
    return kernel::SemidefiniteFactor<double, n>(covariance).L * normal_vector<n>();
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace jml
