// SPDX-License-Identifier: BSD-3-Clause
// A campaign with every recursive estimator of a discrete model, on one thread and on two: wall clock, and
// the share of the time that is spent inside the estimators.
#include <benchmark/benchmark.h>

#include <jml/campaign/campaign.hpp>
#include <jml/jml.hpp>
#include <string>

#include "../tests/models/van_der_pol.hpp"

namespace {

using State = jml::Vector<double, 2>;
const jml::Estimate prior{State(1, 0), 0.1 * jml::Matrix<double, 2, 2>::Identity()};

struct Flights {
  static constexpr int states = 2, measurements = 1;
  std::string name = "Van der Pol";
  int steps = 120;
  double dt = 0.05;
  models::SaturatingPosition sensor{};
  void fly(jml::CounterNoise& noise, jml::Flight<2, 1>& flight) const {
    const State start = prior.x + noise.normal_vector<2>(prior.P);
    jml::simulate(models::VanDerPol{}, sensor, start, jml::GaussianNoise{}, jml::GaussianNoise{}, noise,
                  flight);
  }
};

template <typename Rule>
auto recursive(const char* name, const Rule& rule) {
  return jml::Estimator{name, [rule](const auto&) { return jml::Filter{rule, models::VanDerPol{}, prior}; }};
}

void campaign(benchmark::State& state, int threads) {
  jml::Campaign campaign{Flights{},
                         recursive("EKF", jml::Ekf{}),
                         recursive("IEKF", jml::Iekf{}),
                         recursive("SDDRE", jml::Sddre{}),
                         recursive("JML", jml::Jml{}),
                         recursive("iterated JML", jml::IteratedJml{}),
                         jml::Estimator{"fixed lag 20", [](const auto&) {
                                          return jml::Filter{jml::FixedLag<20>{}, models::VanDerPol{},
                                                             jml::sensors<models::SaturatingPosition>, prior};
                                        }}};
  campaign.options = {.runs = 512, .threads = threads, .blocks = 64, .progress = false};
  double share = 0;
  for (auto _ : state) {
    const auto result = campaign.run();
    if (!result.ok()) state.SkipWithError(result.message());
    share = result.share_inside();
  }
  state.counters["share_inside"] = share;
  state.SetItemsProcessed(state.iterations() * campaign.options.runs);
}

BENCHMARK_CAPTURE(campaign, threads1, 1)
    ->Name("campaign/threads1")
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(campaign, threads2, 2)
    ->Name("campaign/threads2")
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
