// SPDX-License-Identifier: BSD-3-Clause
// A way out of a refusal that keeps x: P inflated, or the variance of one state given anew.
#include <gtest/gtest.h>

#include <jml/filter/way_out.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <limits>

namespace {

using jml::Status;
using Vector2 = jml::Vector<double, 2>;
using Matrix2 = jml::Matrix<double, 2, 2>;

struct Drift {
  static constexpr int states = 2, disturbances = 0;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + 0.5 * x(1), x(1)};
  }
};
struct Position {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.25); }
};

Matrix2 prior() { return (Matrix2() << 4, 1, 1, 9).finished(); }

template <typename Filter>
void expect_way_out(Filter filter) {
  const Vector2 x = filter.x();
  EXPECT_EQ(filter.inflate(Vector2(-1, 0)), Status::invalid_option);
  EXPECT_EQ(filter.inflate(Vector2(0, std::numeric_limits<double>::quiet_NaN())), Status::invalid_option);
  EXPECT_EQ(filter.reset_variance(2, 1), Status::invalid_option);
  EXPECT_EQ(filter.reset_variance(-1, 1), Status::invalid_option);
  EXPECT_EQ(filter.reset_variance(0, -1), Status::invalid_option);
  EXPECT_LT((filter.P() - prior()).norm(), 1e-14);
  ASSERT_EQ(filter.inflate(Vector2(0.5, 2)), Status::ok);
  EXPECT_LT((filter.P() - (Matrix2() << 4.5, 1, 1, 11).finished()).norm(), 1e-14);
  ASSERT_EQ(filter.reset_variance(1, 100), Status::ok);
  EXPECT_LT((filter.P() - (Matrix2() << 4.5, 0, 0, 100).finished()).norm(), 1e-12);
  EXPECT_EQ(filter.x(), x);
  // K of the correction that follows is that of P as it now is: 4.5 / (4.5 + .25).
  ASSERT_TRUE(jml::usable(filter.update(Position{}, x(0) + 1)));
  EXPECT_NEAR(filter.x()(0), x(0) + 4.5 / 4.75, 1e-12);
  EXPECT_NEAR(filter.x()(1), x(1), 1e-12);
}

TEST(WayOut, ChangesPAndKeepsX) {
  const jml::Estimate<double, 2> start{Vector2(3, -2), prior()};
  expect_way_out(jml::Filter{jml::Kalman{}, Drift{}, start});
  expect_way_out(jml::Filter{jml::Jml{}, Drift{}, start});
  expect_way_out(jml::Filter{jml::Factored{jml::Kalman{}}, Drift{}, start});
  expect_way_out(jml::Filter{jml::FixedLag<3>{}, Drift{}, jml::sensors<Position>, start});
}

// A factored filter forgets a state altogether: the next two positions give its velocity without any prior.
TEST(WayOut, AFactoredFilterForgetsAState) {
  jml::Filter filter{jml::Factored{jml::Kalman{}}, Drift{}, jml::Estimate<double, 2>{Vector2(3, -2), prior()}};
  ASSERT_EQ(filter.reset_variance(0, std::numeric_limits<double>::infinity()), Status::ok);
  ASSERT_EQ(filter.reset_variance(1, std::numeric_limits<double>::infinity()), Status::ok);
  ASSERT_EQ(filter.update(Position{}, 1.0).status, Status::ok);
  EXPECT_EQ(filter.x()(0), 1.0);
  ASSERT_EQ(filter.step(Position{}, 2.0).status, Status::ok);
  EXPECT_NEAR(filter.x()(0), 2, 1e-15);
  EXPECT_NEAR(filter.x()(1), 2, 1e-15);  // (2 - 1) / .5
  const Matrix2 P = (Matrix2() << 0.25, 0.5, 0.5, 2).finished();  // of y_1, (y_1 - y_0)/.5
  EXPECT_LT((filter.P() - P).norm(), 1e-15);
}

}  // namespace
