// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// When the sweeps of jml::sweep end, and how they ended.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/kernels.hpp>
#include <jml/status.hpp>
#include <limits>

namespace jml {

/// When the sweeps end.
struct SweptOptions {
  int max_sweeps = 200;  ///< sweeps at most
  double tolerance = 0;  ///< of report.step; 0 asks for the default, 1e-10 (float: 1e-4)
  /// In their range.
  [[nodiscard]] bool valid() const { return max_sweeps > 0 && tolerance >= 0 && tolerance < 1; }
};

/// How the sweeps ended.
template <typename Scalar, int n>
struct SweptReport {
  /// ok: the tolerance is met. not_converged: out of sweeps. riccati_escape: P of (19) has a pole inside the
  /// interval, along this trajectory. The states of a refusal are no answer.
  Status status = Status::ok;
  int sweeps = 0;  ///< made
  /// The largest change of a state in the last sweep, relative to its largest value.
  Scalar step = std::numeric_limits<Scalar>::quiet_NaN();
  Scalar cost = std::numeric_limits<Scalar>::quiet_NaN();  ///< J; of a trajectory only where it has converged
  /// P of (19) at the end: of a nonsymmetric rule not symmetric, no covariance.
  Matrix<Scalar, n, n> P = kernel::filled<Matrix<Scalar, n, n>>(std::numeric_limits<Scalar>::quiet_NaN());
};

}  // namespace jml
#include <jml/warnings_end.hpp>
