// SPDX-License-Identifier: BSD-3-Clause
// scaling_campaign RUNS THREADS: s of wall clock for a campaign of three estimators, on so many threads of
// each rank; printed by rank 0. Under mpirun it is dealt to the ranks.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <jml/campaign/campaign.hpp>
#ifdef JML_SCALING_MPI
#include <jml/campaign/campaign_mpi.hpp>
#endif
#include <jml/jml.hpp>
#include <models/van_der_pol.hpp>
#include <string>

namespace {

const jml::Estimate<double, 2> prior{{1, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};

struct Flights {
  static constexpr int states = 2, measurements = 1;
  std::string name = "Van der Pol";
  int steps = 120;
  double dt = 0.05;
  models::SaturatingPosition sensor{};
  void fly(jml::CounterNoise& noise, jml::Flight<2, 1>& flight) const {
    const jml::Vector<double, 2> start = prior.x + noise.normal_vector<2>(prior.P);
    jml::simulate(models::VanDerPol{}, sensor, start, jml::GaussianNoise{}, jml::GaussianNoise{}, noise,
                  flight);
  }
};

template <typename Rule>
auto recursive(const char* name, const Rule& rule) {
  return jml::Estimator{name, [rule](const auto&) { return jml::Filter{rule, models::VanDerPol{}, prior}; }};
}

}  // namespace

int main(int argc, char** argv) {
#ifdef JML_SCALING_MPI
  const jml::MpiSession session(&argc, &argv);
#endif
  if (argc < 3) return 2;
  jml::Campaign campaign{Flights{}, recursive("EKF", jml::Ekf{}), recursive("JML", jml::Jml{}),
                         recursive("iterated JML", jml::IteratedJml{})};
  campaign.options = {
      .runs = std::atoi(argv[1]), .threads = std::atoi(argv[2]), .blocks = 64, .progress = false};
  const auto begin = std::chrono::steady_clock::now();
#ifdef JML_SCALING_MPI
  const auto result = jml::run_on_ranks(campaign);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
#else
  const auto result = campaign.run();
  const int rank = 0;
#endif
  const auto end = std::chrono::steady_clock::now();
  if (!result.ok()) {
    std::fprintf(stderr, "%s\n", result.message());
    return 3;
  }
  if (rank == 0) std::printf("%.6g\n", std::chrono::duration<double>(end - begin).count());
}
