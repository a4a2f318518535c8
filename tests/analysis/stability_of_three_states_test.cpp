// SPDX-License-Identifier: BSD-3-Clause
// Three copies of ẋ = a x, h = x - x³: the front is a triangulated sphere.
#include <gtest/gtest.h>

#include <jml/analysis/stability_region.hpp>

#include "analysis/scalar_by_hand.hpp"
#include "models/stability.hpp"

namespace {

using by_hand::Scalar;
using V3 = jml::Vector<double, 3>;
const models::Copies<3> copies{V3(0.5, 0.3, 0.4), V3(1, 1, 1)};
const models::TurningSignals<3> signals{V3(0.3, 0.5, 0.4)};

TEST(ThreeCopies, AreLimitedByTheFirstToFail) {
  const auto region =
      jml::stability_region(copies, signals, {.box = V3(3, 3, 3), .level_ratio = 1.3, .largest_gap = 0.5});
  const Scalar hand[3] = {{0.5, 1, 0.3}, {0.3, 1, 0.5}, {0.4, 1, 0.4}};
  const double level = hand[1].level(1);
  ASSERT_LT(level, std::min(hand[0].level(1), hand[2].level(1)));
  EXPECT_EQ(region.limit, jml::StabilityLimit::covariance);
  EXPECT_NEAR(region.level, level, 2e-6 * level);
  EXPECT_NEAR(std::abs(region.limiting_point.x(1)), 1, 5e-3);
  EXPECT_LE(region.largest_gap, 0.5);
  for (std::size_t i = 0; i < region.boundary.size(); i += 10) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += hand[k].level(std::abs(region.boundary[i].x(k)));
    EXPECT_NEAR(sum, region.level, 1e-5 * region.level);
  }
}

TEST(ThreeCopies, AreLimitedByTheBoxAndTheMeshIsClosed) {
  const auto region =
      jml::stability_region(copies, signals, {.box = V3(3, 3, 0.5), .level_ratio = 1.5, .largest_gap = 0.5});
  EXPECT_EQ(region.limit, jml::StabilityLimit::box);
  const double level = Scalar{0.4, 1, 0.4}.level(0.5);
  EXPECT_NEAR(region.level, level, 1e-6 * level);
  // A closed triangulated sphere: F = 2 V - 4, and its boundary points fill the level set.
  EXPECT_EQ(region.mesh.size(), 2 * region.rays.size() - 4);
  EXPECT_EQ(region.boundary.size(), region.rays.size());
}

}  // namespace
