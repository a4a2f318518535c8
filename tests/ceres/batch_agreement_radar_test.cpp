// SPDX-License-Identifier: BSD-3-Clause
// Two engines, one problem, six states: see batch_agreement_test.cpp.
#include <gtest/gtest.h>

#include "ceres/batch_flights.hpp"
#include "models/radar.hpp"

namespace {

using batch_flights::expect_agreement, batch_flights::Flight;

TEST(Agreement, Radar) {
  jml::Estimate<double, 6> prior;
  prior.x << 10, 5, 8, -0.3, 0.2, 0.4;
  prior.P = 0.01 * jml::Matrix<double, 6, 6>::Identity();
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    expect_agreement(Flight(models::BallisticTarget{}, models::Radar{}, prior, 200, seed));
}

}  // namespace
