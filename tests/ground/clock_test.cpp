// SPDX-License-Identifier: BSD-3-Clause
// Time is not accumulated by +=: of the clock alone, and of everything that has one.
#include <gtest/gtest.h>

#include <jml/clock.hpp>
#include <jml/jml.hpp>

#include "models/linear.hpp"

namespace {

/// Exact in integers: `count` steps of 2^-k-free decimal length, as the nearest double to dt times count.
TEST(Clock, AMillionSteps) {
  jml::Clock clock(1e9);
  for (int i = 0; i < 1000000; ++i) clock.advance(1e-3);
  EXPECT_EQ(clock.time(), 1e9 + 1000);
}

TEST(Clock, StepsBelowTheRoundingOfTime) {
  jml::Clock clock(1.7e9);
  for (int i = 0; i < 10000000; ++i) clock.advance(1e-7);
  EXPECT_EQ(clock.time(), 1.7e9 + 1);
}

TEST(Clock, FromZeroAndBelow) {
  jml::Clock clock(-1);
  for (int i = 0; i < 20; ++i) clock.advance(0.1);
  EXPECT_NEAR(clock.time(), 1, 1e-15);
  jml::Clock zero;
  for (int i = 0; i < 10; ++i) zero.advance(0.1);
  EXPECT_EQ(zero.time(), 1) << "a plain sum is 0.9999999999999999";
}

TEST(Clock, UntilKnowsWhatTimeCannotShow) {
  jml::Clock clock(1.7e9);
  clock.advance(1e-8);
  EXPECT_EQ(clock.time(), 1.7e9);
  EXPECT_NEAR(clock.until(1.7e9), -1e-8, 1e-17);
  EXPECT_NEAR(clock.until(1.7e9 + 1), 1 - 1e-8, 1e-15);
}

struct Still {
  static constexpr int states = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At&) const {
    return x;
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(1e-12); }
  jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(0.0); }
};
struct Position {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(1); }
};

// shared case S9: a million predictions of 1 ms from 1e9 s.
TEST(Clock, EveryEstimatorsTime) {
  const jml::Estimate<double, 1> start{0.0, 1.0};
  const auto go = [](auto& filter, const char* name) {
    for (int i = 0; i < 1000000; ++i) {
      if (!jml::usable(filter.predict(1e-3))) FAIL() << name << i;
    }
    EXPECT_EQ(filter.time(), 1e9 + 1000) << name;
  };
  jml::Filter ekf{jml::Ekf{}, Still{}, start, 1e9};
  go(ekf, "EKF");
  jml::Filter box{jml::Linearised{}, Still{}, jml::Box<double, 1>{0.0, 1.0}, 1e9};
  go(box, "box");
  jml::Filter lag{jml::FixedLag<3>{}, Still{}, jml::sensors<Position>, start, 1e9};
  go(lag, "fixed lag");
  EXPECT_EQ(lag.time(0), 1e9 + 1000);
  EXPECT_NEAR(lag.time(1), 1e9 + 999.999, 2e-7) << "to the spacing of doubles there";
  jml::Batch batch{Still{}, jml::sensors<Position>, start, {1000000, 1}, 1e9};
  go(batch, "batch");
  EXPECT_EQ(batch.time(500000), 1e9 + 500);
  jml::Smoother smoother{jml::Filter{jml::Ekf{}, Still{}, start, 1e9}, 1000000};
  go(smoother, "smoother");
}

}  // namespace
