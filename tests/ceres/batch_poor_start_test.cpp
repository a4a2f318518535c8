// SPDX-License-Identifier: BSD-3-Clause
// From a poor start J has several minima, or a Gauss-Newton step leads nowhere: does the library's own engine
// end as low as Ceres? Both begin at the same states, the prediction from a prior mean that is wrong by two
// standard deviations or so. Plain Gauss-Newton, every step taken whole, is counted beside them.
#include <gtest/gtest.h>

#include <cstdio>
#include <jml/interval/ceres.hpp>
#include <jml/campaign/noise.hpp>
#include <map>
#include <string>

#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using Batch = jml::Batch<models::VanDerPol, jml::Sensors<models::SaturatingPosition>>;

/// The truth begins at (2, 0), on the limit cycle.
Batch flight(const models::VanDerPol& dynamics, const jml::Vector<double, 2>& mean, int steps,
             jml::Noise& noise) {
  const models::SaturatingPosition sensor{1e-3};
  const jml::Matrix<double, 2, 2> P = 4 * jml::Matrix<double, 2, 2>::Identity();
  Batch batch{dynamics, jml::sensors<models::SaturatingPosition>, jml::Estimate{mean, P}, {steps}};
  batch.start = jml::Start::prediction;
  jml::Vector<double, 2> x(2, 0);
  for (int k = 0; k < steps; ++k) {
    const double w = std::sqrt(dynamics.q_c / dynamics.dt) * noise.normal();
    x = (dynamics.dynamics(x) + dynamics.disturbance_input() * w).eval();
    const double v = std::sqrt(sensor.r) * noise.normal();
    EXPECT_EQ(batch.step(sensor, sensor.measurement(x)(0) + v), jml::Status::ok);
  }
  return batch;
}

/// J after at most 100 whole Gauss-Newton steps; NaN where they do not settle.
double plain_gauss_newton(Batch batch) {
  batch.options.newton = false;
  batch.options.max_iterations = 1;  // one step, which solve() takes whole from states that are a guess
  double before = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 100; ++i) {
    const double cost = batch.solve().cost;
    if (std::abs(cost - before) <= 1e-9 * cost) return cost;
    before = cost;
    batch.start = jml::Start::given;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

struct Count {
  int runs = 0, lower = 0, equal = 0, higher = 0, neither = 0, plain = 0;
  std::map<std::string, int> swept, ceres;

  void add(const Batch& start) {
    Batch by_sweep = start, by_ceres = start;
    const auto own = by_sweep.solve();
    const auto other = jml::solve_with_ceres(by_ceres);
    ++runs;
    ++swept[describe(own.status)];
    ++ceres[describe(other.status)];
    if (!usable(own.status) && !usable(other.status)) {
      ++neither;
    } else if (!usable(other.status) || own.cost < other.cost * (1 - 1e-6)) {
      ++lower;
    } else if (!usable(own.status) || own.cost > other.cost * (1 + 1e-6)) {
      ++higher;
    } else {
      ++equal;
    }
    plain += plain_gauss_newton(start) <= std::min(own.cost, other.cost) * (1 + 1e-6);
  }
  void judge(const char* name) const {
    std::printf("%s, %d runs: J lower than Ceres' in %d, equal in %d, higher in %d, neither solved in %d; ",
                name, runs, lower, equal, higher, neither);
    std::printf("plain Gauss-Newton as low in %d\n", plain);
    for (const auto& [status, count] : swept) std::printf("  own engine: %s: %d\n", status.c_str(), count);
    for (const auto& [status, count] : ceres) std::printf("  Ceres: %s: %d\n", status.c_str(), count);
    EXPECT_LE(higher, 0.02 * runs);
    EXPECT_LE(neither, 0.02 * runs);  // where the prediction itself leaves all bounds
    EXPECT_LE(plain, 0.75 * runs);    // else the start is not poor
  }
};

// The prior mean is drawn from P_0 = 4 I about the truth.
TEST(PoorStart, UnknownPhase) {
  Count count;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    jml::Noise noise(seed);
    const jml::Vector<double, 2> mean = jml::Vector<double, 2>(2, 0) + 2 * noise.normal_vector<2>();
    count.add(flight({.dt = 0.02, .c = 1}, mean, 300, noise));
  }
  count.judge("unknown phase");
}

// A stiffer oscillator (c = 2), whose prior is on the other side of the limit cycle.
TEST(PoorStart, Antiphase) {
  Count count;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    jml::Noise noise(seed);
    const jml::Vector<double, 2> mean = jml::Vector<double, 2>(-2, 0) + 0.3 * noise.normal_vector<2>();
    count.add(flight({.dt = 0.05, .c = 2}, mean, 200, noise));
  }
  count.judge("antiphase");
}

}  // namespace
