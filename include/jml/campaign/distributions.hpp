// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What is drawn from standard uniform and normal numbers, whatever makes these.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/factors.hpp>

namespace jml {

/// Base of a source of random numbers, which has uniform() in (0, 1) and normal() of mean 0 and variance 1.
template <typename Source>
class Distributions {
 public:
  /// Uniform in (low, high).
  double uniform(double low, double high) { return low + (high - low) * source().uniform(); }

  /// n independent standard normals.
  template <int n>
  Vector<double, n> normal_vector() {
    Vector<double, n> out;
    for (int i = 0; i < n; ++i) out(i) = source().normal();
    return out;
  }

  /// Normal with mean 0 and covariance `covariance`, n×n, symmetric positive semidefinite.
  template <int n>
  Vector<double, n> normal_vector(const Matrix<double, n, n>& covariance) {
    return kernel::SemidefiniteFactor<double, n>(covariance).L * normal_vector<n>();
  }

 private:
  Source& source() { return static_cast<Source&>(*this); }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
