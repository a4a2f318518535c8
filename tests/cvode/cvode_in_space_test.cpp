// SPDX-License-Identifier: BSD-3-Clause
// CVODE moves a state in its space, from chart to chart where an interval turns it further than one reaches.
#include <gtest/gtest.h>

#include <jml/continuous/cvode.hpp>
#include <jml/filter/compare.hpp>

#include "heap_trap.hpp"
#include "space/gyro_attitude.hpp"

namespace {

using namespace gyro_attitude;

Vector3 seen(double t) { return {0.6 * std::cos(t), 0.5 * std::sin(2 * t), 0.8}; }
auto filter_by(double tolerance, jml::CvodeMethod method = jml::CvodeMethod::adams, int max_steps = 100000) {
  jml::Cvode cvode;
  cvode.relative_tolerance = tolerance;
  cvode.method = method;
  cvode.max_steps = max_steps;
  return jml::Filter{jml::Continuous{jml::Ekf{}, cvode}, Gyro{}, start()};
}

TEST(CvodeInSpace, IsRightToItsToleranceHoweverLongTheGapIs) {
  for (const double span : {1.0, 10.0}) {  // at 10 s it has turned by 20 rad
    ByHand right{start().x, start().P};
    right.move(0, span, int(4000 * span));
    for (const double tolerance : {1e-6, 1e-10}) {
      for (const auto method : {jml::CvodeMethod::adams, jml::CvodeMethod::bdf}) {
        auto filter = filter_by(tolerance, method);
        ASSERT_EQ(filter.predict(span), jml::Status::ok);
        const Error error = off(filter.x(), filter.P(), right);
        EXPECT_LT(std::max(error.x, error.P), 500 * span * tolerance) << span << " s, " << tolerance;
        EXPECT_NEAR(filter.x().head<4>().norm(), 1, 1e-15);
      }
    }
  }
}

TEST(CvodeInSpace, FollowsASignalAndTakesSamples) {
  ByHand right{start().x, start().P};
  auto filter = filter_by(1e-9);
  long steps = 0;
  for (int k = 0; k < 4; ++k) {
    const auto report = filter.step(Signal{}, seen, 1.5);
    ASSERT_EQ(report.status, jml::Status::ok);
    steps += report.steps;
    right.move(1.5 * k, 1.5, 6000, seen);
    ASSERT_EQ(filter.step(Samples{}, seen(k), 0.0).status, jml::Status::ok);
    right.correct(seen(k));
  }
  const Error error = off(filter.x(), filter.P(), right);
  EXPECT_LT(error.x, 1e-6);
  EXPECT_LT(error.P, 1e-6);
  EXPECT_GT(steps, 100);
}

TEST(CvodeInSpace, KeepsAllWhereItRefuses) {
  auto hurried = filter_by(1e-8, jml::CvodeMethod::adams, 5);
  EXPECT_EQ(hurried.predict(10.0), jml::Status::step_limit);
  auto filter = filter_by(1e-8);
  EXPECT_TRUE(jml::same_bits(hurried, filter));
  ASSERT_EQ(filter.predict(0.1), jml::Status::ok);
  const auto before = filter;
  auto twin = filter;
  EXPECT_EQ(filter.step(Signal{}, seen(0) * std::nan(""), 0.1).status, jml::Status::invalid_measurement);
  EXPECT_EQ(
      filter
          .step(
              Signal{}, [](double t) { return Vector3(Vector3::Constant(t < 1 ? 0.3 : std::nan(""))); }, 10.0)
          .status,
      jml::Status::invalid_measurement);
  EXPECT_TRUE(jml::same_bits(filter, before));
  EXPECT_EQ(filter.predict(0.1), jml::Status::ok);
  EXPECT_EQ(twin.predict(0.1), jml::Status::ok);
  EXPECT_LT((filter.P() - twin.P()).norm(), 1e-8);
}

TEST(CvodeInSpace, WithAdamsTouchesNoHeapAfterItsFirstInterval) {
  auto filter = filter_by(1e-8);
  ASSERT_EQ(filter.step(Signal{}, seen, 0.1).status, jml::Status::ok);
  int good = 0;
  {
    heap_trap::Armed trap;
    good += filter.step(Signal{}, seen, 3.0).status == jml::Status::ok;
    good += filter.predict(3.0) == jml::Status::ok;
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  EXPECT_EQ(good, 2);
}

}  // namespace
