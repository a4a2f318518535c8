// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory.hpp"

namespace bare_metal {

bool algebraic_double(const double (&y)[steps], Table& table) { return run_algebraic<double>(y, table); }
bool algebraic_float(const double (&y)[steps], Table& table) { return run_algebraic<float>(y, table); }

}  // namespace bare_metal
