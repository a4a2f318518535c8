// SPDX-License-Identifier: BSD-3-Clause
// Bounds: without any, FixedLag and Batch to the bit; what is refused, and that it leaves the filter as it
// was; and that x keeps within them whatever happens.
#include <gtest/gtest.h>

#include <jml/interval/bounded_batch.hpp>

#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;
using jml::Status;
using models::SaturatingPosition, models::VanDerPol;
using One = jml::Vector<double, 1>;
using Square = jml::Matrix<double, 2, 2>;

constexpr double infinite = std::numeric_limits<double>::infinity(),
                 nan = std::numeric_limits<double>::quiet_NaN();

double swing(int k) { return 0.6 * std::sin(0.05 * k) + 0.1 * std::cos(1.7 * k); }

TEST(BoundsUnused, ALagIsFixedLagToTheBit) {
  const jml::Estimate<double, 2> start{{1.5, 0.5}, 0.3 * Square::Identity()};
  jml::Filter plain{jml::FixedLag<6>{}, VanDerPol{}, jml::sensors<SaturatingPosition>, start};
  jml::Bounds<2, 1> far;
  far.lower << -100, -infinite;
  far.w_upper << 1e3;
  jml::Filter none{jml::Bounded{jml::FixedLag<6>{}, jml::Bounds<2>{}}, VanDerPol{},
                   jml::sensors<SaturatingPosition>, start};
  jml::Filter wide{jml::Bounded{jml::FixedLag<6>{}, far}, VanDerPol{}, jml::sensors<SaturatingPosition>,
                   start};
  for (int k = 0; k < 40; ++k) {
    const auto expected = plain.step(SaturatingPosition{}, swing(k));
    for (const auto& report :
         {none.step(SaturatingPosition{}, swing(k)), wide.step(SaturatingPosition{}, swing(k))}) {
      ASSERT_EQ(report.status, expected.status);
      ASSERT_EQ(report.cost, expected.cost);
      ASSERT_EQ(report.sweeps, expected.sweeps);
    }
    for (int age = 0; age <= plain.depth(); ++age) {
      ASSERT_EQ(none.x(age), plain.x(age));
      ASSERT_EQ(wide.x(age), plain.x(age));
      ASSERT_EQ(wide.P(age), plain.P(age));
    }
  }
}
TEST(BoundsUnused, ABatchIsBatchToTheBit) {
  const jml::Estimate<double, 2> start{{1.5, 0.5}, 0.3 * Square::Identity()};
  jml::Batch plain{VanDerPol{}, jml::sensors<SaturatingPosition>, start, {.steps = 100}};
  jml::BoundedBatch none{
      VanDerPol{}, jml::sensors<SaturatingPosition>, start, {.steps = 100}, jml::Bounds<2, 1>{}};
  for (int k = 0; k < 100; ++k) {
    ASSERT_EQ(plain.step(SaturatingPosition{}, swing(k)), Status::ok);
    ASSERT_EQ(none.step(SaturatingPosition{}, swing(k)), Status::ok);
  }
  for (const auto from : {jml::Start::filter, jml::Start::several}) {
    plain.start = none.start = from;
    const auto expected = plain.solve(), report = none.solve();
    EXPECT_EQ(report.status, expected.status);
    EXPECT_EQ(report.cost, expected.cost);
    EXPECT_EQ(report.iterations, expected.iterations);
    for (int k = 0; k <= 100; ++k) ASSERT_EQ(none.x(k), plain.x(k));
    for (int k = 0; k < 100; ++k) ASSERT_EQ(none.w(k), plain.w(k));
  }
}

/// x grows by one a step, and by w.
struct Drift {
  static constexpr int states = 1, disturbances = 1;
  double variance = 0;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) + 1.0);
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(variance); }
};
struct Place {
  static constexpr int measurements = 1;
  template <typename T, int n>
  jml::Vector<T, 1> measurement(const jml::Vector<T, n>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.01); }
};
/// Two numbers that never change.
struct Still {
  static constexpr int states = 2, disturbances = 0;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return x;
  }
};

template <int n, int q>
jml::Bounds<n, q> up_to(double upper) {
  jml::Bounds<n, q> bounds;
  bounds.upper(0) = upper;
  return bounds;
}
jml::Estimate<double, 1> at(double x, double P) { return {One(x), jml::Matrix<double, 1, 1>(P)}; }

TEST(Bounds, ThatAreNoneAreRefusedByName) {
  const auto bad = [](double lower, double upper, double w_lower, double w_upper) {
    jml::Bounds<1, 1> bounds;
    bounds.lower << lower;
    bounds.upper << upper;
    bounds.w_lower << w_lower;
    bounds.w_upper << w_upper;
    return bounds;
  };
  for (const auto& bounds :
       {bad(1, 0, -1, 1), bad(nan, 0, -1, 1), bad(0, nan, -1, 1), bad(-1, 1, 2, 1), bad(-1, 1, nan, 1),
        bad(infinite, infinite, -1, 1), bad(-infinite, -infinite, -1, 1)}) {
    EXPECT_FALSE(bounds.valid());
    jml::Filter lag{jml::Bounded{jml::FixedLag<3>{}, bounds}, Drift{1}, jml::sensors<Place>, at(0, 1)};
    EXPECT_EQ(lag.predict(), Status::invalid_option);
    EXPECT_EQ(lag.step(Place{}, 0.0).status, Status::invalid_option);
    EXPECT_EQ(lag.update(Place{}, 0.0).status, Status::invalid_option);
    EXPECT_EQ(lag.update(Place{}, 0.0, jml::age(0)).status, Status::invalid_option);
    EXPECT_EQ(lag.x()(0), 0.0);
    jml::BoundedBatch batch{Drift{1}, jml::sensors<Place>, at(0, 1), {.steps = 3}, bounds};
    EXPECT_EQ(batch.step(Place{}, 0.0), Status::ok);
    EXPECT_EQ(batch.solve().status, Status::invalid_option);
  }
  jml::Filter lag{jml::Bounded{jml::FixedLag<3>{}, jml::Bounds<1>{}}, Drift{1}, jml::sensors<Place>,
                  at(0, 1)};
  lag.method().most = 0;
  EXPECT_EQ(lag.predict(), Status::invalid_option);
  jml::BoundedBatch batch{Drift{1}, jml::sensors<Place>, at(0, 1), {.steps = -3}, jml::Bounds<1>{}};
  EXPECT_EQ(batch.solve().status, Status::invalid_option);
}

/// Steps until one is refused, which must change nothing; with wider bounds it goes on as if it had not been
/// tried.
template <typename Filter, typename Wider>
void expect_no_feasible_point(Filter filter, const Wider& wider, int after) {
  const double y = filter.x()(0);
  Status status = Status::ok;
  int done = 0;
  auto before = filter;
  for (; done < 20 && usable(status); ++done) {
    before = filter;
    status = done % 2 == 0 ? filter.predict() : filter.step(Place{}, y).status;
  }
  EXPECT_EQ(status, Status::no_feasible_point) << jml::describe(status);
  EXPECT_EQ(done, after + 1);
  ASSERT_EQ(filter.depth(), before.depth());
  EXPECT_EQ(filter.time(), before.time());
  for (int age = 0; age <= filter.depth(); ++age) {
    EXPECT_EQ(filter.x(age), before.x(age));
    EXPECT_EQ(filter.P(age), before.P(age));
    EXPECT_EQ(filter.belief().multiplier(age), before.belief().multiplier(age));
  }
  filter.method().bounds = before.method().bounds = wider;
  for (int k = 0; k < 5; ++k) {
    const auto report = filter.step(Place{}, y + k), expected = before.step(Place{}, y + k);
    EXPECT_TRUE(usable(report.status)) << jml::describe(report.status);
    EXPECT_EQ(report.cost, expected.cost);
    for (int age = 0; age <= filter.depth(); ++age) EXPECT_EQ(filter.x(age), before.x(age));
  }
}
TEST(Bounds, AKnownStateThatLeavesThemIsRefused) {  // 0, 1, 2, and 3 is too much
  expect_no_feasible_point(
      jml::Filter{jml::Bounded{jml::FixedLag<4>{}, up_to<1, 0>(2.5)}, Drift{}, jml::sensors<Place>, at(0, 0)},
      jml::Bounds<1>{}, 2);
}
TEST(Bounds, DisturbancesTooSmallToKeepThemAreRefused) {  // at most 0.6 back for each one ahead: 0.4 k ≤ 2.5
  auto bounds = up_to<1, 1>(2.5);
  bounds.w_lower << -0.6;
  expect_no_feasible_point(
      jml::Filter{jml::Bounded{jml::FixedLag<9>{}, bounds}, Drift{1}, jml::sensors<Place>, at(0, 0)},
      jml::Bounds<1, 1>{}, 6);
}
TEST(Bounds, ThatContradictAPriorOfRankOneAreRefused) {  // x_0 = x_1 whatever they are
  jml::Bounds<2> bounds;
  bounds.upper << 1, infinite;
  bounds.lower << -infinite, 2;
  Square P;
  P << 4, 4, 4, 4;
  const jml::Estimate<double, 2> start{{0.5, 0.5}, P};
  expect_no_feasible_point(
      jml::Filter{jml::Bounded{jml::FixedLag<3>{}, bounds}, Still{}, jml::sensors<Place>, start},
      up_to<2, 0>(1), 0);
  jml::BoundedBatch batch{Still{}, jml::sensors<Place>, start, {.steps = 5}, bounds};
  for (int k = 0; k < 5; ++k) ASSERT_EQ(batch.step(Place{}, 0.5), Status::ok);
  EXPECT_EQ(batch.solve().status, Status::no_feasible_point);
  batch.bounds.lower(1) = 0.9;
  EXPECT_TRUE(usable(batch.solve().status));
  EXPECT_EQ(batch.x(3)(1), 0.9);
  EXPECT_NEAR(batch.x(3)(0), 0.9, 1e-8);
}

TEST(Bounds, RefusalsLeaveThemAsTheyAct) {
  jml::Filter lag{jml::Bounded{jml::FixedLag<4, 2>{}, up_to<1, 0>(2.5)}, Drift{0.1}, jml::sensors<Place>,
                  at(0, 0.1)};
  const auto expect_as_before = [](const auto& after, const auto& before) {
    ASSERT_EQ(after.depth(), before.depth());
    for (int age = 0; age <= before.depth(); ++age) {
      EXPECT_EQ(after.x(age), before.x(age));
      EXPECT_EQ(after.belief().multiplier(age), before.belief().multiplier(age));
    }
  };
  int refusals = 0;
  for (int k = 0; k < 12; ++k) {
    const auto before = lag;
    EXPECT_EQ(lag.step(Place{}, nan).status, Status::invalid_measurement);
    expect_as_before(lag, before);
    lag.method().most = 1;  // two passes do not find what a measurement so far away asks for
    const bool refused = lag.update(Place{}, k % 2 == 0 ? -100.0 : 100.0).status == Status::not_converged;
    refusals += refused;
    if (refused) expect_as_before(lag, before);
    lag = before;
    auto untried = before;
    (void)lag.step(Place{}, nan);
    const auto report = lag.step(Place{}, 2.4 + 0.2 * (k % 3)),
               expected = untried.step(Place{}, 2.4 + 0.2 * (k % 3));
    ASSERT_TRUE(usable(report.status));
    EXPECT_EQ(report.cost, expected.cost);
    EXPECT_EQ(report.sweeps, expected.sweeps);
    expect_as_before(lag, untried);
  }
  EXPECT_GT(refusals, 8);
  EXPECT_GT(lag.belief().multiplier(1)(0), 0.1);
}

TEST(Bounds, AGateThatRejectsLeavesAnAnswerWithinThem) {
  jml::Filter lag{jml::Bounded{jml::FixedLag<4>{}, up_to<1, 0>(2.5)}, Drift{0.1}, jml::sensors<Place>,
                  at(0, 0.1)};
  lag.gate = {0.99};
  for (int k = 0; k < 6; ++k) {
    auto predicted = lag;
    ASSERT_TRUE(usable(predicted.predict()));
    const auto report = lag.step(Place{}, 100.0);
    ASSERT_TRUE(usable(report.status));
    EXPECT_EQ(report.gate, jml::Verdict::rejected);
    ASSERT_EQ(lag.depth(), predicted.depth());
    for (int age = 0; age <= lag.depth(); ++age) {
      EXPECT_EQ(lag.x(age), predicted.x(age));
      EXPECT_LE(lag.x(age)(0), 2.5);
    }
  }
  EXPECT_EQ(lag.x()(0), 2.5);
  jml::Filter free{jml::FixedLag<4>{}, Drift{0.1}, jml::sensors<Place>, at(0, 0.1)};
  for (int k = 0; k < 6; ++k) (void)free.predict();
  for (int age = 0; age <= 4; ++age) EXPECT_EQ(lag.P(age), free.P(age));  // of the problem without bounds
}

}  // namespace
