// SPDX-License-Identifier: BSD-3-Clause
#include "models/dense.hpp"
#include "models/radar.hpp"
#include "trajectory.hpp"

namespace bare_metal {

bool factored_double(const double (&y)[steps], Table& table) {
  return run<double>(jml::Factored{jml::Ekf{}}, y, table);
}
bool factored_float(const double (&y)[steps], Table& table) {
  return run<float>(jml::Factored{jml::Ekf{}}, y, table);
}

namespace {

/// A larger model, seen with an error of its own making; kept: x_0, x_1 and their covariance.
template <typename Method, typename D, typename S, int n>
bool run_large(const Method& method, const D& dynamics, const S& sensor, jml::Vector<double, n> x,
               Table& table) {
  jml::Filter filter{
      method, dynamics,
      jml::Estimate{x, jml::Matrix<double, n, n>(1e-2 * jml::Matrix<double, n, n>::Identity())}};
  const double none[steps] = {};
  int i = 0;
  return keep(
      filter, none, table,
      [&](double) {
        x = dynamics.dynamics(x);
        auto y = sensor.measurement(x);
        const auto R = sensor.noise_covariance();
        for (int k = 0; k < S::measurements; ++k) y(k) += std::sqrt(R(k, k)) * std::sin(7.0 * ++i);
        return filter.step(sensor, y);
      },
      [&] { return filter.P(); });
}
template <typename Method>
bool run_6(const Method& method, Table& table) {
  models::BallisticTarget target;
  target.gravity = 0;
  jml::Vector<double, 6> x;
  x << 40, 25, 12, -0.4, 0.1, 0.02;
  return run_large(method, target, models::Radar{}, x, table);
}
template <typename Method>
bool run_15(const Method& method, Table& table) {
  jml::Vector<double, 15> x;
  for (int j = 0; j < 15; ++j) x(j) = std::sin(1.0 + j);
  return run_large(method, models::DenseDynamics<15>{}, models::DenseSensor<15, 6>{}, x, table);
}

}  // namespace

bool ekf_6(const double (&)[steps], Table& table) { return run_6(jml::Ekf{}, table); }
bool factored_6(const double (&)[steps], Table& table) { return run_6(jml::Factored{jml::Ekf{}}, table); }
bool ekf_15(const double (&)[steps], Table& table) { return run_15(jml::Ekf{}, table); }
bool factored_15(const double (&)[steps], Table& table) { return run_15(jml::Factored{jml::Ekf{}}, table); }

}  // namespace bare_metal
