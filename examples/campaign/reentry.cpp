// SPDX-License-Identifier: BSD-3-Clause
// The reentry vehicle of the EKF/UKF toolbox manual (Hartikainen, Solin and Särkkä 2011), flown as published:
// the truth's drag parameter is fixed, 0.6932 away from what the filters believe.
#include <models/reentry.hpp>

#include "make_study.hpp"

namespace study {

namespace {

struct Flights {
  static constexpr int states = 5, measurements = 2;
  models::ReentryVehicle vehicle{};
  models::GroundRadar sensor{};
  std::string name{};
  int steps = 2000;
  double dt = vehicle.dt, lost = 1;
  jml::Estimate<double, 5> start{jml::Vector<double, 5>{6500.4, 349.14, -1.8093, -6.7967, 0},
                                 jml::Vector<double, 5>{1e-6, 1e-6, 1e-6, 1e-6, 1}.asDiagonal()};

  void fly(jml::CounterNoise& noise, jml::Flight<5, 2>& flight) const {
    models::ReentryVehicle truth = vehicle;
    truth.parameter_variance = 0;
    jml::Vector<double, 5> x = start.x;
    for (int i = 0; i < 4; ++i) x(i) += 1e-3 * noise.normal();
    x(4) = 0.6932;
    jml::simulate(truth, sensor, x, jml::GaussianNoise{}, jml::GaussianNoise{}, noise, flight);
  }
  static double error(const jml::Vector<double, 5>& x, const jml::Vector<double, 5>& truth) {
    return (x - truth).head<2>().norm();
  }
};

}  // namespace

std::vector<Study> reentry() {
  const Flights flights;
  const auto& d = flights.vehicle;
  const auto& start = flights.start;
  const jml::AboutPoint beginning{start.x};
  return {make(
      {.key = "reentry",
       .sentence = "a vehicle that enters the atmosphere, seen by a radar on the ground (5 states)",
       .stresses = "a drag parameter that is learnt on the way; a step is nearly linear",
       .error = "position",
       .unit = "km",
       .runs = 64,
       .note = "Flown as in the manual that published it: the true parameter is the same in every run "
               "and does not move, while the filters give it noise; so their NEES need not be 1."},
      flights, filter("EKF", jml::Ekf{}, d, start, jml::OneStep{}), filter("IEKF", jml::Iekf{}, d, start),
      filter("SDDRE about the start", jml::Sddre{beginning}, d, start, jml::OneStep{}),
      filter("JML about the start", jml::Jml{beginning}, d, start, jml::OneStep{}),
      filter("iterated JML about the estimate", jml::IteratedJml{jml::AboutEstimate{}}, d, start,
             jml::OneStep{}),
      lag_20<models::GroundRadar>(d, start, false))};
}

}  // namespace study
