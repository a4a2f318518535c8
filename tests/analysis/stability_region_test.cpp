// SPDX-License-Identifier: BSD-3-Clause
// Regions of stability that can be worked out by hand: two copies of ẋ = a x,
// h = x - x³, and a linear system.
#include <gtest/gtest.h>

#include <jml/analysis/stability_region.hpp>

#include "analysis/scalar_by_hand.hpp"
#include "models/stability.hpp"

namespace {

using namespace jml::operators;

using by_hand::Scalar;
using V2 = jml::Vector<double, 2>;
using jml::StabilityLimit;

// {S₁(x₁) + S₂(x₂) ≤ γ} leaves (-1, 1)² where the first copy to fail does.
TEST(TwoCopies, AreLimitedByTheFirstToFail) {
  const auto region = jml::stability_region(models::Copies<2>{V2(0.5, 0.3), V2(1, 1)},
                                            models::TurningSignals<2>{V2(0.3, 0.5)}, {.box = V2(3, 3)});
  const double level = Scalar{0.3, 1, 0.5}.level(1);
  ASSERT_LT(level, (Scalar{0.5, 1, 0.3}.level(1)));
  EXPECT_EQ(region.limit, StabilityLimit::covariance);
  EXPECT_NEAR(region.level, level, 2e-6 * level);
  EXPECT_NEAR(std::abs(region.limiting_point.x(1)), 1, 5e-3);
  EXPECT_NEAR(region.limiting_point.x(0), 0, 1e-6);
  EXPECT_GT(region.definiteness, 0.1);
  EXPECT_LE(region.largest_gap, 0.1);
  const Scalar first{0.5, 1, 0.3}, second{0.3, 1, 0.5};
  for (const auto& point : region.boundary) {
    const double sum = first.level(std::abs(point.x(0))) + second.level(std::abs(point.x(1)));
    EXPECT_NEAR(sum, region.level, 1e-5 * region.level);
  }
}

TEST(TwoCopies, AreLimitedByTheBoxWhereItIsSmaller) {
  const Scalar first{0.5, 1, 0.3}, second{0.3, 1, 0.5};
  const auto region = jml::stability_region(models::Copies<2>{V2(0.5, 0.3), V2(1, 1)},
                                            models::TurningSignals<2>{V2(0.3, 0.5)}, {.box = V2(0.3, 0.9)});
  EXPECT_EQ(region.limit, StabilityLimit::box);
  const double level = std::min(first.level(0.3), second.level(0.9));
  EXPECT_NEAR(region.level, level, 1e-6 * level);
}

// S = ½ xᵀV⁻¹x everywhere, dS/dt = -½|G'λ|² - ½|h|²/r; a fast and a slow direction, ten to one, whose rays
// all end up along the fast one: without new rays the front would be empty elsewhere.
TEST(Linear, IsCertifiedUpToTheBoxWithAFrontThatStaysFull) {
  const models::LinearFlow<2, 2> d{jml::Matrix<double, 2, 2>{{-0.6, 0.3}, {0, -6}},
                                   jml::Matrix<double, 2, 2>{{0.1, 0}, {0.2, 3}}};
  const models::LinearSignal<2, 1> s{{1, 0.4}, 2};
  const auto region =
      jml::stability_region(d, s, {.box = V2(2, 5), .start = 0.01, .level_ratio = 1.3, .max_rays = 4000});
  ASSERT_EQ(region.limit, StabilityLimit::box);
  EXPECT_LE(region.largest_gap, 0.1);
  EXPECT_EQ(region.printed_level, 0);  // one measurement for two states
  // V from the test's own iteration of the differential equation to its rest.
  jml::Matrix<double, 2, 2> V = jml::Matrix<double, 2, 2>::Zero();
  const jml::Matrix<double, 2, 2> noise = d.G * d.G.transpose();
  for (int k = 0; k < 40000; ++k) {
    const V2 gain = V * s.M.transpose();
    V += 0.01 * (d.F * V + V * d.F.transpose() + noise - gain * gain.transpose() / s.r);
  }
  EXPECT_LT((region.origin_covariance - V).norm(), 1e-12 * V.norm());
  const double level = std::min(4 / V(0, 0), 25 / V(1, 1)) / 2;  // the ellipsoid that touches the box
  EXPECT_NEAR(region.level, level, 1e-6 * level);
  const jml::Matrix<double, 2, 2> information = V.inverse();
  double largest = -1e9;
  for (const auto& ray : region.rays) {
    for (const auto& point : ray.points) {
      const V2 lambda = information * point.x;
      const double seen = (s.M * point.x)(0);
      const double rate = -0.5 * lambda.dot(noise * lambda) - 0.5 * seen * seen / s.r;
      EXPECT_NEAR(point.level, 0.5 * point.x.dot(lambda), 1e-7 * point.level);
      EXPECT_LT((point.lambda - lambda).norm(), 1e-7 * lambda.norm());
      EXPECT_NEAR(point.rate, rate, 1e-6 * std::abs(rate));
      largest = std::max(largest, point.rate);
    }
  }
  EXPECT_LT(largest, 0);
  EXPECT_LT(region.hamiltonian, 1e-7);
}

}  // namespace
