// SPDX-License-Identifier: BSD-3-Clause
// A pendulum of which only the angle is measured; of the disturbance and the noise the bounds are known, and
// they are uniform within.
#include <jml/bounded/bounded_noise.hpp>
#include <models/bounded.hpp>

#include "make_study.hpp"

namespace study {

namespace {

using State = jml::Vector<double, 2>;

struct Flights {
  static constexpr int states = 2, measurements = 1;
  models::BoundedPendulum pendulum{};
  models::BoundedAngleSensor sensor{};
  std::string name{};
  int steps = 400;
  double dt = pendulum.dt;
  jml::Box<double, 2> box{State(0.7, -0.3), State(1.3, 0.3)};

  void fly(jml::CounterNoise& noise, jml::Flight<2, 1>& flight) const {
    State x;
    for (int i = 0; i < 2; ++i) x(i) = noise.uniform(box.lower(i), box.upper(i));
    jml::simulate(pendulum, sensor, x, jml::UniformNoise{}, jml::UniformNoise{}, noise, flight);
  }
  static double error(const State& x, const State& truth) { return std::abs(x(1) - truth(1)); }
  /// The same box for who thinks in covariances: bound²/3.
  jml::Estimate<double, 2> start() const {
    const State half = box.width() / 2;
    return {box.centre(), jml::Matrix<double, 2, 2>((half.cwiseAbs2() / 3).asDiagonal())};
  }
};

}  // namespace

std::vector<Study> bounded() {
  const Flights flights;
  const auto& d = flights.pendulum;
  const jml::Estimate<double, 2> start = flights.start();
  const auto boxed = [d, box = flights.box](std::string name, auto rule) {
    return jml::Estimator{std::move(name),
                          [d, box, rule](const auto&) { return jml::Filter{rule, d, box}; }};
  };
  return {make(
      {.key = "bounded",
       .sentence = "a pendulum of which only the angle is measured, with uniform disturbance and noise",
       .stresses = "noise that is not normal, and a rate that is not measured",
       .error = "rate",
       .unit = "rad/s",
       .runs = 400,
       .note = "The covariances of the filters are bound²/3, those of the uniform densities."},
      flights, filter("EKF", jml::Ekf{}, d, start, jml::OneStep{}), filter("IEKF", jml::Iekf{}, d, start),
      filter("SDDRE", jml::Sddre{}, d, start, jml::OneStep{}),
      filter("JML", jml::Jml{}, d, start, jml::OneStep{}),
      filter("iterated JML", jml::IteratedJml{}, d, start, jml::OneStep{}),
      lag_20<models::BoundedAngleSensor>(d, start), boxed("bounded noise, linearised", jml::Linearised{}),
      boxed("bounded noise, guaranteed", jml::Guaranteed{}))};
}

}  // namespace study
