// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a scenario of a campaign has `void fly(jml::CounterNoise&, jml::Flight<states, measurements, controls>&) const`
#include <jml/campaign/campaign.hpp>

#include "parts.hpp"

namespace scenario_flies_not_const {

struct Scenario {
  static constexpr int states = 2, measurements = 1;
  const char* name = "";
  int steps = 1;
  double dt = 1;
  parts::Sensor sensor{};
#ifdef MISTAKE
  void fly(jml::CounterNoise&, jml::Flight<2, 1>&) {}
#else
  void fly(jml::CounterNoise&, jml::Flight<2, 1>&) const {}
#endif
};
struct Nothing {
  struct Report {
    jml::Status status = jml::Status::ok;
  };
  static Report step(const parts::Sensor&, const jml::Vector<double, 1>&) { return {}; }
  static jml::Vector<double, 2> x() { return {0, 0}; }
};

inline bool run() {
  return jml::Campaign{Scenario{}, jml::Estimator{"none", [](const auto&) { return Nothing{}; }}}.run().ok();
}

}  // namespace scenario_flies_not_const
