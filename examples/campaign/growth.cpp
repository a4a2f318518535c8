// SPDX-License-Identifier: BSD-3-Clause
// The univariate nonstationary growth model of the EKF/UKF toolbox manual (Hartikainen, Solin and Särkkä
// 2011), 500 steps: two peaks of the density most of the time.
#include <models/growth.hpp>

#include "make_study.hpp"

namespace study {

namespace {

using X = jml::Vector<double, 1>;

struct Flights {
  static constexpr int states = 1, measurements = 1;
  models::Growth growth{};
  models::SquareSensor sensor{};
  std::string name{};
  int steps = 500;
  double dt = 1;  // the model's time is the number of the sample
  jml::Estimate<double, 1> start{X(0.1), X(1)};

  void fly(jml::CounterNoise& noise, jml::Flight<1, 1>& flight) const {
    jml::simulate(growth, sensor, start.x, jml::GaussianNoise{}, jml::GaussianNoise{}, noise, flight);
  }
};

/// Does not look at the data.
struct Zero {
  struct Report {
    jml::Status status = jml::Status::ok;
  };
  static Report step(const models::SquareSensor&, const X&, double) { return {}; }
  static X x() { return X(0.0); }
};

}  // namespace

std::vector<Study> growth() {
  const Flights flights;
  const auto& d = flights.growth;
  const auto& start = flights.start;
  return {
      make({.key = "growth",
            .sentence = "the univariate nonstationary growth model",
            .stresses = "a sensor blind to the sign, two lobes: the density has two peaks, an estimate here "
                        "follows one",
            .error = "state",
            .unit = "",
            .runs = 400,
            .baseline = "zero, always",
            .note = "The truth starts at 0.1 in every run, as published. \"zero, always\" does not look at "
                    "the data: who is not better than that has no estimate."},
           flights, filter("EKF", jml::Ekf{}, d, start, jml::OneStep{}),
           filter("IEKF", jml::Iekf{}, d, start), filter("SDDRE", jml::Sddre{}, d, start, jml::OneStep{}),
           filter("JML", jml::Jml{}, d, start, jml::OneStep{}),
           filter("iterated JML", jml::IteratedJml{}, d, start, jml::OneStep{}),
           filter("iterated JML about the estimate", jml::IteratedJml{jml::AboutEstimate{}}, d, start,
                  jml::OneStep{}),
           lag_20<models::SquareSensor>(d, start),
           jml::Estimator{"zero, always", [](const auto&) { return Zero{}; }})};
}

}  // namespace study
