// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory.hpp"

namespace bare_metal {

bool runge_kutta_double(const double (&y)[steps], Table& table) {
  return run_continuous<double>(jml::RungeKutta4{8}, y, table);
}
bool runge_kutta_float(const double (&y)[steps], Table& table) {
  return run_continuous<float>(jml::RungeKutta4{8}, y, table);
}
bool davison_maki_double(const double (&y)[steps], Table& table) {
  return run_continuous<double>(jml::DavisonMaki{}, y, table);
}
bool davison_maki_float(const double (&y)[steps], Table& table) {
  return run_continuous<float>(jml::DavisonMaki{}, y, table);
}

}  // namespace bare_metal
