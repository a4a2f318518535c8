// SPDX-License-Identifier: BSD-3-Clause
// NaN, +Inf and -Inf in every position of every input of every kind of method: refused by a name that fits,
// with belief and time as they were, and the steps that follow those of a filter that never saw it.
#include <gtest/gtest.h>

#include <jml/jml.hpp>
#include <limits>

namespace {

using jml::Status;
using Vector2 = jml::Vector<double, 2>;
using Matrix2 = jml::Matrix<double, 2, 2>;

struct Cart {
  static constexpr int states = 2, disturbances = 1, controls = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    using std::sin;
    return {x(0) + at.dt * x(1), x(1) + at.dt * (at.control(0) - sin(x(0)) + 0.5 * at.control(1))};
  }
  jml::Matrix<double, 2, 1> disturbance_input() const { return {0, 0.1}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(1.0); }
  jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(1.0); }
};
struct Both {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return x;
  }
  Matrix2 noise_covariance() const { return 0.01 * Matrix2::Identity(); }
  Vector2 noise_bound() const { return {0.3, 0.3}; }
};

const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                      -std::numeric_limits<double>::infinity()};

template <typename F>
bool same(const F& a, const F& b) {
  bool equal = a.x() == b.x() && a.time() == b.time();
  if constexpr (requires { a.P(); }) equal = equal && a.P() == b.P();
  return equal;
}

template <typename F>
void sweep(F filter) {
  const Vector2 y(0.1, 0.2), u(0.3, -0.1);
  ASSERT_TRUE(jml::usable(filter.step(Both{}, y, 0.1, u).status));
  F untouched = filter;
  const auto expect = [&](Status status, Status wanted) {
    EXPECT_EQ(status, wanted) << jml::describe(status);
    EXPECT_TRUE(same(filter, untouched));
  };
  for (const double number : bad) {
    for (int i = 0; i < 2; ++i) {
      Vector2 wrong = y;
      wrong(i) = number;
      expect(filter.step(Both{}, wrong, 0.1, u).status, Status::invalid_measurement);
      expect(filter.update(Both{}, wrong).status, Status::invalid_measurement);
      wrong = u;
      wrong(i) = number;
      expect(filter.step(Both{}, y, 0.1, wrong).status, Status::invalid_control);
      expect(filter.predict(0.1, wrong), Status::invalid_control);
    }
    expect(filter.step(Both{}, y, number, u).status, Status::invalid_time_step);
    expect(filter.predict(number, u), Status::invalid_time_step);
    expect(filter.step(Both{}, y, jml::at_time(number), u).status, Status::invalid_time_step);
    expect(filter.update(Both{}, y, jml::at_time(number)).status, Status::invalid_time_step);
    filter.gate = {number};
    if constexpr (requires { filter.P(); })
      expect(filter.step(Both{}, y, 0.1, u).status, Status::invalid_option);
    filter.gate = {};
  }
  ASSERT_TRUE(jml::usable(filter.step(Both{}, y, 0.1, u).status));
  ASSERT_TRUE(jml::usable(untouched.step(Both{}, y, 0.1, u).status));
  EXPECT_TRUE(same(filter, untouched));
}

template <typename F>
void bad_starts(F filter, bool takes_infinite_variances) {
  const jml::Estimate<double, 2> good{Vector2(0, 0), Matrix2::Identity()};
  for (const double number : bad) {
    for (int i = 0; i < 2; ++i) {
      auto wrong = good;
      wrong.x(i) = number;
      EXPECT_EQ(filter.reset(wrong, 0), Status::invalid_state);
      EXPECT_EQ(filter.predict(0.1), Status::invalid_state);
      for (int j = 0; j < 2; ++j) {
        wrong = good;
        wrong.P(i, j) = number;
        const bool taken = takes_infinite_variances && i == j && number > 0;
        EXPECT_EQ(filter.reset(wrong, 0), taken ? Status::ok : Status::invalid_covariance)
            << number << i << j;
      }
    }
    EXPECT_EQ(filter.reset(good, number), Status::invalid_time_step);
    EXPECT_EQ(filter.reset(good, 0), Status::ok);
  }
}

TEST(BadNumbers, InEveryPosition) {
  const jml::Estimate<double, 2> start{Vector2(0, 0), Matrix2::Identity()};
  jml::Filter ekf{jml::Ekf{}, Cart{}, start};
  jml::Filter jml_step{jml::IteratedJml{}, Cart{}, start};
  jml::Filter factored{jml::Factored{jml::Ekf{}}, Cart{}, start};
  jml::Filter lag{jml::FixedLag<3, 2>{}, Cart{}, jml::sensors<Both>, start};
  sweep(ekf);
  sweep(jml_step);
  sweep(factored);
  sweep(lag);
  sweep(jml::Filter{jml::Linearised{}, Cart{}, jml::Box{Vector2(-1, -1), Vector2(1, 1)}});
  sweep(jml::Filter{jml::Guaranteed{}, Cart{}, jml::Box{Vector2(-1, -1), Vector2(1, 1)}});
  bad_starts(ekf, false);
  bad_starts(jml_step, false);
  bad_starts(factored, true);
  bad_starts(lag, true);
}

}  // namespace
