// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The classical fourth-order Runge-Kutta step, in fixed time.
#pragma once

namespace jml {

/// `substeps` equal steps over an interval, control held: order 4, explicit, four evaluations each.
struct RungeKutta4 {
  int substeps = 1;
};

}  // namespace jml
