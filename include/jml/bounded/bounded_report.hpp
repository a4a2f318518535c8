// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a bounded-noise step reports.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/report.hpp>

namespace jml {

/// Which bound was violated, and by how much: the reachable box and the measurement's do not meet.
template <typename Scalar>
struct Violation {
  int row = -1;       ///< of the measurement that contradicts; -1: none, or none alone
  int state = -1;     ///< where measurements together leave nothing of this state's bounds; -1: none
  Scalar excess = 0;  ///< the gap between the two, in the units of y(row), or of x(state)
};

/// What a bounded-noise method reports. status: accepted_without_measurement where a bound was violated; the
/// box is the predicted one. innovation: y - m(centre of the predicted box). No innovation matrix, no gate.
template <typename Scalar, int p>
struct BoundedReport : Report<Scalar, p> {
  Violation<Scalar> violation;  ///< none where the measurement fits
};

}  // namespace jml
#include <jml/warnings_end.hpp>
