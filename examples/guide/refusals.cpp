// SPDX-License-Identifier: BSD-3-Clause
// What a step that is refused leaves behind, a gate, and the ways out that keep x.
#include <cmath>
#include <cstdio>
#include <jml/jml.hpp>
#include <limits>

#include "models/van_der_pol.hpp"

using models::SaturatingPosition, models::VanDerPol;

int main() {
  const SaturatingPosition sensor;
  const jml::Estimate start{jml::Vector<double, 2>(1, 0), jml::Matrix<double, 2, 2>::Identity()};
  const double y = std::nan("");

  // [refused]
  jml::Filter filter{jml::Ekf{}, VanDerPol{}, start};
  if (jml::usable(filter.status())) {                // a bad start does not throw: status() names it
    const auto report = filter.step(sensor, y);      // y is a NaN
    if (!jml::usable(report.status)) {               // jml::Status::invalid_measurement
      std::puts(jml::describe(report.status));       // x, P and time are what they were
      if (!jml::usable(filter.predict())) return 1;  // on without the measurement
    }
  }
  // [/refused]

  // [gate]
  filter.gate = {0.999};  // a probability: the chi-square tail with the sensor's degrees of freedom
  const auto report = filter.step(sensor, 25.0);
  if (report.gate == jml::Verdict::rejected)  // the status stays ok, and the filter keeps its prediction
    std::printf("innovation %.2f, NIS %.0f: rejected\n", report.innovation(0), report.nis());
  // [/gate]

  // [way_out]
  const jml::Status larger = filter.inflate(jml::Vector<double, 2>(4, 1));  // P ← P + diag(4, 1)
  const jml::Status anew = filter.reset_variance(1, 9.0);                   // of state 1, and no covariances
  const jml::Status reset = filter.reset({filter.x(), start.P}, filter.time());  // another P
  // [/way_out]

  // [factored]
  const double nothing_known = std::numeric_limits<double>::infinity();
  jml::Matrix<double, 2, 2> P0 = jml::Matrix<double, 2, 2>::Zero();
  P0(0, 0) = nothing_known;
  P0(1, 1) = 0.1;
  jml::Filter factored{jml::Factored{jml::Ekf{}}, VanDerPol{},
                       jml::Estimate{jml::Vector<double, 2>(0, 0), P0}};
  const auto first = factored.update(sensor, 0.3);
  // [/factored]
  std::printf("of nothing known: position %.3f ± %.3f\n", factored.x()(0), std::sqrt(factored.P()(0, 0)));

  const bool out = jml::usable(larger) && jml::usable(anew) && jml::usable(reset);
  return report.gate == jml::Verdict::rejected && out && jml::usable(first.status) && factored.P()(0, 0) < 1
             ? 0
             : 1;
}
