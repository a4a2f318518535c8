// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory.hpp"

namespace bare_metal {

bool ekf_double(const double (&y)[steps], Table& table) { return run<double>(jml::Ekf{}, y, table); }
bool ekf_float(const double (&y)[steps], Table& table) { return run<float>(jml::Ekf{}, y, table); }

}  // namespace bare_metal
