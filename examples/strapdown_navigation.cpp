// SPDX-License-Identifier: BSD-3-Clause
// Inertial navigation with GNSS: a state with an attitude in it, a filter and a fixed lag, no Jacobian.
#include <cmath>
#include <cstdio>
#include <jml/campaign/noise.hpp>

#include "navigation/trajectory.hpp"

using namespace navigation;

namespace {

/// Prints error and 3σ of attitude (degrees) and position (m); true where the errors are within 5σ.
bool show(const char* name, const State<double>& truth, const auto& filter) {
  const jml::Vector<double, degrees> error = Space::minus(truth, filter.x());  // in the tangent, as P is
  const jml::Vector<double, degrees> sigma = filter.P().diagonal().cwiseSqrt();
  constexpr double degree = 3.14159265358979 / 180;
  bool within = true;
  std::printf("%4.0f s  %-10s attitude (deg)", filter.time(), name);
  for (int i = 0; i < 3; ++i) std::printf(" %6.2f (%.2f)", error(i) / degree, 3 * sigma(i) / degree);
  std::printf("  position (m)");
  for (int i = 3; i < 6; ++i) std::printf(" %6.2f (%.2f)", error(i), 3 * sigma(i));
  std::printf("\n");
  for (int i = 0; i < degrees; ++i) within = within && std::abs(error(i)) < 5 * sigma(i);
  return within;
}

}  // namespace

int main() {
  // A flight of 60 s, with an inertial unit of 100 Hz.
  jml::Noise random(1);
  const Strapdown unit;
  const Path path(Liveliness{}, random);
  const double dt = 0.01;
  const jml::Vector<double, 6> biases{0.003, -0.002, 0.004, 0.05, 0.02, -0.04};
  const Flight flight = fly(unit, path, biases, dt, 6000, random);

  // What is known at first: everything to these standard deviations, and biases of about zero.
  jml::Vector<double, degrees> sigma;
  sigma << 0.02, 0.02, 0.1, 1, 1, 1, 0.1, 0.1, 0.1, 0.005, 0.005, 0.005, 0.05, 0.05, 0.05;
  jml::Vector<double, degrees> off = sigma.cwiseProduct(random.normal_vector<degrees>());
  off.tail<6>() = biases;
  const State<double> x0 = Space::plus(flight.truth.front(), jml::Vector<double, degrees>(-off));
  const jml::Matrix<double, degrees, degrees> P0 = sigma.cwiseAbs2().asDiagonal();

  // [filters]
  jml::Filter ekf{jml::Ekf{}, unit, jml::Estimate{x0, P0}};
  jml::Filter lag{jml::FixedLag<20>{}, unit, jml::sensors<GnssFix>, jml::Estimate{x0, P0}};
  const GnssFix gnss{{0.5, 0, -1}};
  // [/filters]
  bool sound = true;
  for (int k = 1; k <= flight.steps(); ++k) {
    const auto now = static_cast<std::size_t>(k);
    sound = sound && jml::usable(ekf.predict(dt, flight.inertial[now - 1]));
    sound = sound && jml::usable(lag.predict(dt, flight.inertial[now - 1]));
    if (k % 100 != 0) continue;
    const jml::Vector<double, 6> y = measure(gnss, flight, k, random);
    sound = sound && jml::usable(ekf.update(gnss, y));
    sound = sound && jml::usable(lag.update(gnss, y));
    if (k % 1000 != 0) continue;
    sound = show("EKF", flight.truth[now], ekf) && sound;
    sound = show("fixed lag", flight.truth[now], lag) && sound;
  }
  return sound ? 0 : 1;
}
