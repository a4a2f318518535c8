// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory.hpp"

namespace bare_metal {

bool iterated_jml_double(const double (&y)[steps], Table& table) {
  return run<double>(jml::IteratedJml{}, y, table);
}
bool iterated_jml_float(const double (&y)[steps], Table& table) {
  return run<float>(jml::IteratedJml{}, y, table);
}

}  // namespace bare_metal
