// SPDX-License-Identifier: BSD-3-Clause
// The region of stability of the Van der Pol filter: the full condition beside the printed one, starts on the
// certified boundary, and how much farther out convergence is really lost.
#include <gtest/gtest.h>

#include <jml/analysis/stability_region.hpp>
#include <tuple>
#include <vector>

#include "models/continuous.hpp"

namespace {

using V2 = jml::Vector<double, 2>;
using jml::StabilityLimit;

const models::Oscillator mild{1, 0.1, 1, 1};
const models::SaturatingSignal coarse{0.1};

std::vector<V2> positions(const jml::StabilityRegion<2>& region) {
  std::vector<V2> out;
  for (std::size_t i = 0; i < region.boundary.size(); i += 8) out.push_back(region.boundary[i].x);
  return out;
}

TEST(VanDerPol, TheFullConditionCertifiesWhatThePrintedOneCannot) {
  // The chapter's parameters; the box is where the swing of the oscillator lives.
  const auto region =
      jml::stability_region(models::Oscillator{}, models::SaturatingSignal{}, {.box = V2(3, 3)});
  ASSERT_EQ(region.status, jml::Status::ok);
  EXPECT_EQ(region.limit, StabilityLimit::box);
  EXPECT_GT(region.level, 50);
  EXPECT_EQ(region.printed_limit, StabilityLimit::condition);
  EXPECT_EQ(region.printed_level, 0);
  EXPECT_GT(region.definiteness, 0.5);
  for (const auto& ray : region.rays) {
    for (const auto& point : ray.points) EXPECT_LT(point.rate, 0);
    EXPECT_NEAR(ray.points.front().covariance, 1, 1e-5);  // V(x) → V(0)
  }
}

// (13) fails in a strip beside h = 0, however near the origin: no point of it is needed on h = 0 itself. The
// full condition holds there. The strip is as narrow as V(x) is near V(0), so the front is sampled finely.
TEST(VanDerPol, ThePrintedConditionFailsBesideABlindDirectionNearTheOrigin) {
  const auto region = jml::stability_region(mild, coarse,
                                            {.box = V2(0.3, 0.3),
                                             .start = 0.1,
                                             .level_ratio = 2,
                                             .largest_gap = 0.005,
                                             .max_rays = 4000,
                                             .integrator = {jml::CvodeMethod::adams, 1e-8, 1e-10}});
  double smallest = 1e9;
  int strict = 0;
  for (const auto& ray : region.rays) {
    for (const auto& point : ray.points) {
      if (!(point.printed > 0)) continue;
      ++strict;
      EXPECT_LT(point.rate, 0);
      smallest = std::min(smallest, point.x.norm());
    }
  }
  EXPECT_GT(strict, 0);
  EXPECT_LT(smallest, 0.2);
}

// The level of the milder filter in a wide box, where the condition itself is the limit: an independent
// computation (SciPy: solve_ivp, solve_continuous_are, a scan over directions) gives 6.849152 at
// (-2.5496, -0.6224).
TEST(VanDerPol, TheConditionLimitsTheMilderFilterWhereAnIndependentComputationSays) {
  const auto region = jml::stability_region(mild, coarse, {.box = V2(6, 12), .refinements = 8});
  EXPECT_EQ(region.limit, StabilityLimit::condition);
  EXPECT_NEAR(region.level, 6.849152, 2e-5);  // rays a last gap / 256 beside the worst direction
  EXPECT_NEAR(std::abs(region.limiting_point.x(0)), 2.5496, 1e-2);
  EXPECT_NEAR(std::abs(region.limiting_point.x(1)), 0.6224, 1e-2);
  EXPECT_EQ(region.printed_level, 0);
  const auto factors = jml::convergence_factors(mild, coarse, positions(region), 4);
  for (const double factor : factors) EXPECT_GT(factor, 1);
}

// The worse the measurement, the smaller the region; the manifold has no fold near the origin, which a front
// that is sampled badly there would show.
TEST(VanDerPol, TheLevelFallsWithTheNoise) {
  double last = std::numeric_limits<double>::infinity();
  for (const double r : {0.5, 1.0, 2.0}) {
    const auto region = jml::stability_region(mild, models::SaturatingSignal{r}, {.box = V2(6, 12)});
    EXPECT_EQ(region.limit, StabilityLimit::condition) << r;
    EXPECT_GT(region.level, 0.4) << r;
    EXPECT_LT(region.level, last) << r;
    last = region.level;
  }
}

TEST(VanDerPol, AThousandStartsOnTheBoundaryConverge) {
  std::size_t starts = 0;
  for (const auto& [d, s, box] : {std::tuple{mild, coarse, V2(6, 12)},
                                  std::tuple{models::Oscillator{}, models::SaturatingSignal{}, V2(3, 3)}}) {
    const auto region = jml::stability_region(d, s,
                                              {.box = box,
                                               .start = 0.01,
                                               .level_ratio = 2,
                                               .largest_gap = 0.0125,
                                               .max_rays = 4000,
                                               .integrator = {jml::CvodeMethod::adams, 1e-8, 1e-10}});
    starts += region.boundary.size();
    for (const auto& point : region.boundary) {
      EXPECT_NEAR(point.level, region.level, 1e-6 * region.level);
      EXPECT_LT(point.rate, 1e-6 * region.level);
      EXPECT_TRUE(jml::run_without_input(d, s, point.x).converged) << point.x.transpose();
    }
  }
  EXPECT_GE(starts, 1000u);
}

}  // namespace
