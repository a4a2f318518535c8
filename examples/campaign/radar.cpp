// SPDX-License-Identifier: BSD-3-Clause
// A ballistic target with drag, tracked by a radar: the flights of demo_radar, from this campaign's numbers.
#include <models/radar.hpp>

#include "make_study.hpp"

namespace study {

namespace {

struct Flights {
  static constexpr int states = 6, measurements = 3;
  models::BallisticTarget target{};
  models::Radar sensor{};
  std::string name{};
  int steps = 600;
  double dt = target.dt, lost = 5000;
  jml::Estimate<double, 6> start{jml::Vector<double, 6>{40, 15, 14, -0.8, 0.05, 0.3},
                                 jml::Vector<double, 6>{0.25, 0.25, 0.25, 0.01, 0.01, 0.01}.asDiagonal()};

  void fly(jml::CounterNoise& noise, jml::Flight<6, 3>& flight) const {
    jml::simulate(target, sensor, draw(start, noise), jml::GaussianNoise{}, jml::GaussianNoise{}, noise,
                  flight);
  }
  static double error(const jml::Vector<double, 6>& x, const jml::Vector<double, 6>& truth) {
    return 1e3 * (x - truth).head<3>().norm();
  }
};

}  // namespace

std::vector<Study> radar() {
  const Flights flights;
  const auto& d = flights.target;
  const auto& start = flights.start;
  const jml::AboutPoint beginning{start.x};
  return {make({.key = "radar",
                .sentence = "a ballistic target with drag, tracked by a radar for a minute (6 states)",
                .stresses = "polar measurements; little, at these ranges and this noise",
                .error = "position",
                .unit = "m",
                .runs = 100},
               flights, filter("EKF", jml::Ekf{}, d, start, jml::OneStep{}),
               filter("IEKF", jml::Iekf{}, d, start),
               filter("SDDRE about the start", jml::Sddre{beginning}, d, start, jml::OneStep{}),
               filter("JML about the start", jml::Jml{beginning}, d, start, jml::OneStep{}),
               filter("JML about the origin", jml::Jml{}, d, start, jml::OneStep{}),
               filter("iterated JML about the start", jml::IteratedJml{beginning}, d, start, jml::OneStep{}),
               filter("iterated JML about the estimate", jml::IteratedJml{jml::AboutEstimate{}}, d, start,
                      jml::OneStep{}),
               lag_20<models::Radar>(d, start))};
}

}  // namespace study
