// SPDX-License-Identifier: BSD-3-Clause
// A linear system: every rule is the Kalman filter there, and the Kalman filter is the best there is.
#include <models/linear.hpp>

#include "make_study.hpp"

namespace study {

namespace {

using Sensor = models::LinearSensor<4, 2>;

/// Constant velocity in the plane, both positions measured with a standard deviation of 1 m.
struct Flights {
  static constexpr int states = 4, measurements = 2;
  models::ConstantVelocity vehicle{};
  Sensor sensor{jml::Matrix<double, 2, 4>{{1, 0, 0, 0}, {0, 0, 1, 0}}, jml::Matrix<double, 2, 2>::Identity()};
  std::string name{};
  int steps = 100;
  double dt = 0.5;
  jml::Estimate<double, 4> start{jml::Vector<double, 4>(0, 10, 0, -5),
                                 jml::Vector<double, 4>(100, 4, 100, 4).asDiagonal()};

  void fly(jml::CounterNoise& noise, jml::Flight<4, 2>& flight) const {
    jml::simulate(vehicle, sensor, draw(start, noise), jml::GaussianNoise{}, jml::GaussianNoise{}, noise,
                  flight);
  }
  static double error(const jml::Vector<double, 4>& x, const jml::Vector<double, 4>& truth) {
    return std::hypot(x(0) - truth(0), x(2) - truth(2));
  }
};

}  // namespace

std::vector<Study> linear() {
  const Flights flights;
  const auto& d = flights.vehicle;
  const auto& start = flights.start;
  return {make({.key = "linear",
                .sentence = "a vehicle in the plane with random accelerations, both positions measured",
                .stresses = "nothing: all estimators must give the same answer, and a consistent one",
                .error = "position",
                .unit = "m",
                .runs = 200},
               flights, filter("EKF", jml::Ekf{}, d, start, jml::OneStep{}),
               filter("Kalman", jml::Kalman{}, d, start, jml::OneStep{}),
               filter("IEKF", jml::Iekf{}, d, start), filter("SDDRE", jml::Sddre{}, d, start, jml::OneStep{}),
               filter("JML", jml::Jml{}, d, start, jml::OneStep{}),
               filter("iterated JML", jml::IteratedJml{}, d, start, jml::OneStep{}),
               lag_20<Sensor>(d, start))};
}

}  // namespace study
