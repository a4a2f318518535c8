// SPDX-License-Identifier: BSD-3-Clause
// A small campaign to be killed, and to be run on ranks:
//   campaign_program <result> <runs> <threads> [<journal> [<milliseconds a run>]]
// writes <result>.csv and <result>.json. No journal: "". Milliseconds below zero: some runs throw.
// Built with JML_ON_RANKS it runs under mpirun.
#include <chrono>
#include <cstdlib>
#include <thread>

#include "campaign/walk.hpp"
#ifdef JML_ON_RANKS
#include <jml/campaign/campaign_mpi.hpp>
#endif

namespace {

struct Slow : walk::Scenario {
  int milliseconds = 0;
  void fly(jml::CounterNoise& noise, jml::Flight<1, 1>& flight) const {
    walk::Scenario::fly(noise, flight);
    if (milliseconds < 0 && flight.y[1](0) > 4) throw std::runtime_error("y is too large");
    if (milliseconds > 0) std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
  }
};

}  // namespace

int main(int count, char** arguments) {
#ifdef JML_ON_RANKS
  const jml::MpiSession session(&count, &arguments);
#endif
  if (count < 4) return 2;
  Slow scenario;
  if (count > 5) scenario.milliseconds = std::atoi(arguments[5]);
  jml::Campaign campaign{scenario, walk::kalman(), walk::brittle(4.5)};
  campaign.options = {
      .runs = std::atoi(arguments[2]), .seed = 9, .threads = std::atoi(arguments[3]), .blocks = 40};
  if (count > 4) campaign.options.journal = arguments[4];
#ifdef JML_ON_RANKS
  const jml::CampaignResult result = jml::run_on_ranks(campaign);
#else
  const jml::CampaignResult result = campaign.run();
#endif
  if (!result.ok()) {
    std::fprintf(stderr, "%s\n", result.message());
    return 1;
  }
  const std::string name = arguments[1];
  std::printf("%d blocks taken over\n", static_cast<int>(result.blocks_taken_over()));
  return result.write_csv(name + ".csv") && result.write_json(name + ".json") ? 0 : 1;
}
