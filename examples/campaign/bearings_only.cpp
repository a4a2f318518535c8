// SPDX-License-Identifier: BSD-3-Clause
// Bearings-only tracking of the EKF/UKF toolbox manual (Hartikainen, Solin and Särkkä 2011), flown as
// published: the target makes three turns of which the filters' model knows nothing.
#include <models/bearings_only.hpp>

#include "make_study.hpp"

namespace study {

namespace {

struct Flights {
  static constexpr int states = 4, measurements = 2;
  using State = jml::Vector<double, 4>;
  models::WhiteAcceleration target{};
  models::DirectionFinders sensor{};
  std::string name{};
  int steps = 500;
  double dt = target.dt, lost = 10;
  jml::Estimate<double, 4> start{State::Zero(), State(0.1, 0.1, 10, 10).asDiagonal()};

  /// Straight, with right turns of a quarter circle in samples 50-100, 200-250, 350-400.
  void fly(jml::CounterNoise& noise, jml::Flight<4, 2>& flight) const {
    const double quarter = 1.5707963267948966 / 51 / dt;
    flight.truth[0] = State(0, 0, 1, 0);
    for (std::size_t k = 1; k <= static_cast<std::size_t>(steps); ++k) {
      const bool turning = (k >= 50 && k <= 100) || (k >= 200 && k <= 250) || (k >= 350 && k <= 400);
      const double rate = turning ? quarter + 0.01 * noise.normal() : 0;
      const double c = std::cos(rate * dt), s = std::sin(rate * dt);
      const double along = rate > 0 ? s / rate : dt, across = rate > 0 ? (1 - c) / rate : 0;
      const State& x = flight.truth[k - 1];
      flight.truth[k] = State(x(0) + along * x(2) + across * x(3), x(1) - across * x(2) + along * x(3),
                              c * x(2) + s * x(3), c * x(3) - s * x(2));
      flight.y[k] = sensor.measurement(flight.truth[k]) + sensor.sd * noise.normal_vector<2>();
    }
  }
  static double error(const State& x, const State& truth) { return (x - truth).head<2>().norm(); }
};

}  // namespace

std::vector<Study> bearings_only() {
  const Flights flights;
  const auto& d = flights.target;
  const auto& start = flights.start;
  const jml::AboutPoint beginning{start.x};
  return {make(
      {.key = "bearings_only",
       .sentence = "a target seen by two direction finders, turning three times",
       .stresses = "bearings alone, a poor start, and a truth that the model does not describe",
       .error = "position",
       .unit = "",
       .runs = 200,
       .note = "Flown as in the manual that published it: the truth starts at the same state in every "
               "run and turns, while the filters believe in white accelerations; so their NEES need "
               "not be 1."},
      flights, filter("EKF", jml::Ekf{}, d, start, jml::OneStep{}), filter("IEKF", jml::Iekf{}, d, start),
      filter("SDDRE about the start", jml::Sddre{beginning}, d, start, jml::OneStep{}),
      filter("JML about the start", jml::Jml{beginning}, d, start, jml::OneStep{}),
      filter("iterated JML about the estimate", jml::IteratedJml{jml::AboutEstimate{}}, d, start,
             jml::OneStep{}),
      lag_20<models::DirectionFinders>(d, start))};
}

}  // namespace study
