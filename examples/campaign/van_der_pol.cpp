// SPDX-License-Identifier: BSD-3-Clause
// The Van der Pol oscillator of the discrete paper (Rusnak 2015, eqs. (19)-(23)) and its saturating position
// sensor: weak and strong nonlinearity, small and large noise.
#include <models/continuous.hpp>
#include <models/van_der_pol.hpp>

#include "make_study.hpp"

namespace study {

namespace {

struct Flights {
  static constexpr int states = 2, measurements = 1;
  models::VanDerPol oscillator{};
  models::SaturatingPosition sensor{};
  std::string name{};
  int steps = 400;
  double dt = 0.05, lost = 100;
  jml::Estimate<double, 2> start{{1, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};

  void fly(jml::CounterNoise& noise, jml::Flight<2, 1>& flight) const {
    jml::simulate(oscillator, sensor, draw(start, noise), jml::GaussianNoise{}, jml::GaussianNoise{}, noise,
                  flight);
  }
  static double error(const jml::Vector<double, 2>& x, const jml::Vector<double, 2>& truth) {
    return std::abs(x(0) - truth(0));
  }
};

/// c of the oscillator; the densities q_c of the acceleration noise and r_c of the measurement noise.
Study oscillator(const std::string& key, const std::string& sentence, const std::string& stresses, double c,
                 double q_c, double r_c) {
  Flights flights;
  flights.oscillator.c = c;
  flights.oscillator.q_c = q_c;
  flights.sensor.r = r_c / flights.dt;
  const models::Oscillator continuous{.mu = 1, .c = c, .k = 1, .q = q_c};
  const auto& d = flights.oscillator;
  const auto& start = flights.start;
  return make(
      {.key = key,
       .sentence = sentence,
       .stresses = stresses,
       .error = "position",
       .unit = "",
       .runs = 300,
       .note =
           "RNLS and the algebraic filter integrate the differential equation, the truth is its Euler model: "
           "that error is part of their figures, and most of them where the noise is small."},
      flights, filter("EKF", jml::Ekf{}, d, start, jml::OneStep{}), filter("IEKF", jml::Iekf{}, d, start),
      filter("SDDRE", jml::Sddre{}, d, start, jml::OneStep{}),
      filter("JML", jml::Jml{}, d, start, jml::OneStep{}),
      filter("iterated JML", jml::IteratedJml{}, d, start, jml::OneStep{}),
      filter("iterated JML about the estimate", jml::IteratedJml{jml::AboutEstimate{}}, d, start,
             jml::OneStep{}),
      lag_20<models::SaturatingPosition>(d, start),
      jml::Estimator{"RNLS, continuous",
                     [continuous, start](const auto&) {
                       return jml::Filter{jml::Continuous{jml::Rnls{}, jml::DavisonMaki{}}, continuous, start};
                     }},
      jml::Estimator{"algebraic SDDRE, continuous", [continuous, start](const auto&) {
                       return jml::Filter{jml::Algebraic{jml::Sddre{}}, continuous, start.x};
                     }});
}

}  // namespace

std::vector<Study> van_der_pol() {
  return {oscillator("van_der_pol_weak_small",
                     "Van der Pol oscillator, c = 0.1, small noise (Q_c = 0.01, R_c = 1e-5)",
                     "little: a saturating sensor on a good prediction", 0.1, 0.01, 1e-5),
          oscillator("van_der_pol_weak_large",
                     "Van der Pol oscillator, c = 0.1, the noise of the discrete paper (Q_c = 1, R_c = 1e-3)",
                     "a sensor that is nearly blind at the turning points", 0.1, 1, 1e-3),
          oscillator("van_der_pol_strong_small",
                     "Van der Pol oscillator, c = 1, small noise (Q_c = 0.01, R_c = 1e-5)",
                     "dynamics that are strongly nonlinear, between fast and slow", 1, 0.01, 1e-5),
          oscillator("van_der_pol_strong_large",
                     "Van der Pol oscillator, c = 1, large noise (Q_c = 1, R_c = 1e-3)",
                     "both: nonlinear dynamics and a sensor that is nearly blind at the turning points", 1, 1,
                     1e-3)};
}

}  // namespace study
