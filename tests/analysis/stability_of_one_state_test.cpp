// SPDX-License-Identifier: BSD-3-Clause
// The region of stability of ẋ = a x, h = x - x³, by hand and by the library; and what is refused.
#include <gtest/gtest.h>

#include <jml/analysis/stability_region.hpp>

#include "analysis/scalar_by_hand.hpp"
#include "models/linear.hpp"
#include "models/stability.hpp"

namespace {

using V1 = jml::Vector<double, 1>;
using by_hand::Scalar;
using jml::StabilityLimit;

// a > 0: the sensor is blind at x = 1, where V is infinite. The limit of 1e4 on V is met at 1 - x = 3e-3, and
// there S lacks (1-x)³ of its level.
TEST(OneState, UnstableIsCertifiedUpToWhereTheSensorIsBlind) {
  const Scalar hand{0.5, 1, 0.3};
  const auto region = jml::stability_region(models::Copies<1>{V1(0.5), V1(1)},
                                            models::TurningSignals<1>{V1(0.3)}, {.box = V1(3)});
  ASSERT_EQ(region.status, jml::Status::ok);
  EXPECT_EQ(region.limit, StabilityLimit::covariance);
  EXPECT_NEAR(region.level, hand.level(1), 2e-6 * hand.level(1));
  EXPECT_LT(region.level, hand.level(1));
  ASSERT_EQ(region.boundary.size(), 2u);
  EXPECT_NEAR(region.boundary[0].x(0), 1, 5e-3);
  EXPECT_NEAR(region.boundary[1].x(0), -1, 5e-3);
  EXPECT_EQ(region.printed_level, region.level);  // p = n: here the print certifies as much
  EXPECT_EQ(region.printed_failures, 0);
  EXPECT_LT(region.hamiltonian, 2e-5);  // (start radius)², at the start
  // The points of the rays before the end: S, λ and dS/dt = -√(a² + q H²/r) x²/V by hand.
  for (const auto& ray : region.rays) {
    for (const auto& point : ray.points) {
      const double x = point.x(0), H = 1 - x * x;
      if (point.level > 0.95 * region.level || point.level < 1e-3) continue;
      EXPECT_NEAR(point.level, hand.level(std::abs(x)), 1e-7 * point.level);
      EXPECT_NEAR(point.lambda(0), x * hand.inverse(x), 1e-7 * std::abs(point.lambda(0)));
      const double rate = -std::sqrt(0.25 + H * H / 0.3) * x * x * hand.inverse(x);
      EXPECT_NEAR(point.rate, rate, 1e-6 * std::abs(rate));
    }
  }
}

TEST(OneState, StableHasNoLimitButTheBox) {  // a < 0: V exists where the sensor is blind, and beyond
  const Scalar hand{-0.5, 1, 0.3};
  const auto region = jml::stability_region(models::Copies<1>{V1(-0.5), V1(1)},
                                            models::TurningSignals<1>{V1(0.3)}, {.box = V1(3)});
  EXPECT_EQ(region.limit, StabilityLimit::box);
  EXPECT_NEAR(region.level, hand.level(3), 1e-8 * hand.level(3));
  const auto wanted =
      jml::stability_region(models::Copies<1>{V1(-0.5), V1(1)}, models::TurningSignals<1>{V1(0.3)},
                            {.box = V1(3), .largest_level = 0.5});
  EXPECT_EQ(wanted.limit, StabilityLimit::none);
  EXPECT_EQ(wanted.level, 0.5);
}

// Near x = 1, Ṡ vanishes and S waits: a point falls short of the level that was asked for, and that level is
// not certified by it.
TEST(OneState, SlowAndUnstableIsNotCertifiedBeyondTheBlindPoint) {
  const auto region = jml::stability_region(models::Copies<1>{V1(0.01), V1(0.7)},
                                            models::TurningSignals<1>{V1(0.3)}, {.box = V1(2)});
  EXPECT_EQ(region.limit, StabilityLimit::covariance);
  const double truth = Scalar{0.01, 0.7, 0.3}.level(1);
  EXPECT_NEAR(truth, 0.5385473412, 1e-10);
  EXPECT_LE(region.level, truth);
  EXPECT_GE(region.level, (1 - 1e-6) * truth);
  EXPECT_LE(region.level, region.limiting_point.level);
}

// The truth is the level at the box or, for a > 0, at the blind point if that comes first. It is never
// exceeded, whatever the pace, the noises, the units and the start, and nearly reached.
TEST(OneState, TheCertifiedLevelIsNeverAboveTheTruth) {
  jml::Noise noise(5);
  for (int run = 0; run < 60; ++run) {
    const auto power = [&noise](double decades) {
      return std::pow(10.0, decades * std::erf(noise.normal()));
    };
    const double a = power(2.5) * (run % 4 == 0 ? -0.3 : 0.1), q = power(1), r = power(1), s = power(3);
    const double half_width = 2 * power(0.6), start = run % 3 == 0 ? 0.1 * power(1) : 1e-3;
    const Scalar hand{a, q, r};
    const bool blind = a > 0 && half_width > 1;
    const double truth = hand.level(blind ? 1 : half_width);
    const auto region = jml::stability_region(models::Copies<1>{V1(a), V1(q * s * s)},
                                              models::TurningSignals<1>{V1(r * s * s), V1(s)},
                                              {.box = V1(half_width * s), .start = start / 2});
    ASSERT_EQ(region.status, jml::Status::ok) << run;
    EXPECT_LE(region.level, truth * (1 + 1e-13)) << run << " " << a << " " << region.level / truth - 1;
    // a < 0 has no limit of its own at x = 1, but that of V where a is slow.
    EXPECT_TRUE(region.level >= (1 - 1e-5) * truth || (a < 0 && region.limit == StabilityLimit::covariance))
        << run << " " << a << " " << start << " " << region.level / truth - 1;
  }
}

TEST(OneState, UnitsDoNotMatter) {  // x in thousandths, time in milliseconds, y in another unit
  const auto region =
      jml::stability_region(models::Copies<1>{V1(0.5e-3), V1(1e3)},
                            models::TurningSignals<1>{V1(0.3 * 1e9), V1(1e3)}, {.box = V1(3e3)});
  EXPECT_EQ(region.limit, StabilityLimit::covariance);
  const double level = Scalar{0.5, 1, 0.3}.level(1);
  EXPECT_NEAR(region.level, level, 2e-6 * level);
}

struct Biased : models::TurningSignals<1> {
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) + 1.0);
  }
};

TEST(Refusals, HaveNames) {
  const models::Copies<1> d{V1(0.5), V1(1)};
  const models::TurningSignals<1> s{V1(0.3)};
  const auto status = [](const auto& region) {
    EXPECT_EQ(region.level, 0);
    EXPECT_EQ(region.limit, StabilityLimit::no_start);
    EXPECT_TRUE(region.rays.empty());
    return region.status;
  };
  EXPECT_EQ(status(jml::stability_region(d, s, {})), jml::Status::invalid_option);
  EXPECT_EQ(status(jml::stability_region(d, s, {.box = V1(3), .level_ratio = 1})),
            jml::Status::invalid_option);
  EXPECT_EQ(status(jml::stability_region(models::Copies<1>{V1(0.5), V1(-1)}, s, {.box = V1(3)})),
            jml::Status::invalid_disturbance_covariance);
  EXPECT_EQ(status(jml::stability_region(d, models::TurningSignals<1>{V1(0)}, {.box = V1(3)})),
            jml::Status::invalid_noise_covariance);
  // Stable and without noise: V(0) = 0, and S has no start.
  EXPECT_EQ(status(jml::stability_region(models::Copies<1>{V1(-0.5), V1(0)}, s, {.box = V1(3)})),
            jml::Status::covariance_lost);
  EXPECT_EQ(status(jml::stability_region(d, Biased{{V1(0.3)}}, {.box = V1(3)})), jml::Status::invalid_state);
}

}  // namespace
