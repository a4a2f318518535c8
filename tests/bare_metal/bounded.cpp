// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory.hpp"

namespace bare_metal {

bool linearised_box_double(const double (&y)[steps], Table& table) {
  return run_box<double>(jml::Linearised{}, y, table);
}
bool linearised_box_float(const double (&y)[steps], Table& table) {
  return run_box<float>(jml::Linearised{}, y, table);
}
bool guaranteed_box_double(const double (&y)[steps], Table& table) {
  return run_box<double>(jml::Guaranteed{}, y, table);
}
bool guaranteed_box_float(const double (&y)[steps], Table& table) {
  return run_box<float>(jml::Guaranteed{}, y, table);
}

}  // namespace bare_metal
