// SPDX-License-Identifier: BSD-3-Clause
// Two engines, one problem: Batch::solve() and Ceres share the model and the recording, and no line of the
// minimisation. Noise of rank one and two, P_0 of every rank, robust losses, and what is frozen along the
// way.
#include <gtest/gtest.h>

#include "ceres/batch_flights.hpp"
#include "models/pendulum.hpp"
#include "models/van_der_pol.hpp"

namespace {

using batch_flights::expect_agreement, batch_flights::Flight;
using Square = jml::Matrix<double, 2, 2>;

jml::Estimate<double, 2> oscillator(double p11, double p12, double p22) {
  jml::Estimate<double, 2> out{{1, 0}, Square::Zero()};
  out.P << p11, p12, p12, p22;
  return out;
}

TEST(Agreement, VanDerPol) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto report = expect_agreement(
        Flight(models::VanDerPol{}, models::SaturatingPosition{}, oscillator(0.3, 0, 0.3), 300, seed));
    EXPECT_LE(report.rounds, 3);
  }
}
TEST(Agreement, VanDerPolFromAKnownState) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Flight flight(models::VanDerPol{}, models::SaturatingPosition{}, oscillator(0, 0, 0), 300, seed);
    expect_agreement(flight);
    auto batch = flight.batch();
    EXPECT_EQ(jml::solve_with_ceres(batch).status, jml::Status::ok);
    EXPECT_EQ(batch.x(0), flight.prior.x);
  }
}
TEST(Agreement, VanDerPolFromAKnownLine) {  // P_0 of rank one, along no axis
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    expect_agreement(
        Flight(models::VanDerPol{}, models::SaturatingPosition{}, oscillator(0.09, 0.12, 0.16), 300, seed));
}
#ifdef JML_BY_NIGHT
TEST(Agreement, RegularNoiseIsOneRound) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto report = expect_agreement(
        Flight(models::VanDerPolWhite{}, models::SaturatingPosition{}, oscillator(0.3, 0, 0.3), 300, seed));
    EXPECT_EQ(report.rounds, 1);
  }
}
TEST(Agreement, Pendulum) {  // rank-one noise along no axis
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    expect_agreement(Flight(models::Pendulum{}, models::SineSensor{}, oscillator(0.1, 0, 0.1), 300, seed));
}
#endif
TEST(Agreement, RobustLosses) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Flight flight(models::VanDerPol{}, models::SaturatingPosition{}, oscillator(0.3, 0, 0.3), 300, seed,
                        10);
    const double robust = expect_agreement(flight, jml::Loss::huber(2)).cost;
    EXPECT_LT(robust, 0.5 * expect_agreement(flight).cost);  // thirty outliers of ten standard deviations
    expect_agreement(flight, jml::Loss::cauchy(3));

    ::ceres::HuberLoss own(2);  // a loss of the user's takes the place of the batch's
    auto batch = flight.batch();
    batch.options.loss = jml::Loss::cauchy(1);
    jml::CeresOptions options;
    options.loss = &own;
    EXPECT_NEAR(jml::solve_with_ceres(batch, options).cost, robust, 1e-12 * robust);
  }
}

#ifdef JML_BY_NIGHT
TEST(Agreement, CeresDefaultTrustRegion) {
  const Flight flight(models::Pendulum{}, models::SineSensor{}, oscillator(0.1, 0, 0.1), 300, 1);
  jml::CeresOptions options;
  options.solver.initial_trust_region_radius = ::ceres::Solver::Options{}.initial_trust_region_radius;
  auto by_sweep = flight.batch(), by_ceres = flight.batch();
  expect_agreement(by_sweep, by_ceres, options);
}
#endif

}  // namespace
