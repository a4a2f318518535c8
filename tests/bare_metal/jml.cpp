// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory.hpp"

namespace bare_metal {

bool jml_double(const double (&y)[steps], Table& table) { return run<double>(jml::Jml{}, y, table); }
bool jml_float(const double (&y)[steps], Table& table) { return run<float>(jml::Jml{}, y, table); }

}  // namespace bare_metal
