// SPDX-License-Identifier: BSD-3-Clause
// A fixed lag within bounds never touches the heap, nor a batch after its constructor; passes are bounded;
// and the answer is in single precision what it is in double. On the reactor of Haseltine and Rawlings (2005,
// section 2.1), whose filter without bounds ends at a negative pressure.
#include <gtest/gtest.h>

#include <jml/campaign/noise.hpp>
#include <jml/interval/bounded_batch.hpp>

#include "heap_trap.hpp"

namespace {

using namespace jml::operators;
using heap_trap::allocations, heap_trap::Armed;
using jml::usable;

/// 2A -> B; x: partial pressures, atm.
struct Reactor {
  static constexpr int states = 2, disturbances = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    constexpr double a = 0.016;
    const T left = 1.0 + 2.0 * a * x(0);
    return {x(0) / left, x(1) + a * x(0) * x(0) / left};
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    return 1e-6 * jml::Matrix<double, 2, 2>::Identity();
  }
};
struct Gauge {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0) + x(1));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.01); }
};

template <typename Scalar>
struct Place {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<Scalar, 1, 1> noise_covariance() const { return jml::Matrix<Scalar, 1, 1>(Scalar(0.04)); }
};

jml::Bounds<2, 2> bounds() {
  jml::Bounds<2, 2> of;
  of.lower << 0, 0;
  of.w_lower << -2e-3, -1e-3;
  of.w_upper << 2e-3, 1e-3;
  return of;
}
jml::Estimate<double, 2> start() { return {{0.1, 4.5}, 36 * jml::Matrix<double, 2, 2>::Identity()}; }
auto make_lag() {
  return jml::Filter{jml::Bounded{jml::FixedLag<10, 2>{}, bounds()}, Reactor{}, jml::sensors<Gauge>, start()};
}

struct Flight {
  jml::Noise noise{1};
  jml::Vector<double, 2> x{3, 1};
  double next() {
    x = Reactor{}.dynamics(x) +
        jml::Vector<double, 2>(noise.uniform(-2e-3, 2e-3), noise.uniform(-1e-3, 1e-3));
    return x(0) + x(1) + 0.1 * noise.normal();
  }
};
template <typename X>
bool positive(const X& x) {
  return x(0) >= 0 && x(1) >= 0;
}

TEST(BoundsNoHeap, Lag) {
  Flight flight;
  int done = 0, refused = 0, most = 0, inside = 0, acting = 0;
  {
    Armed trap;
    auto lag = make_lag();
    lag.gate = {0.9999999};
    for (int k = 0; k < 100; ++k) {
      const double y = flight.next();
      const auto report = lag.step(Gauge{}, y);
      done += usable(report.status);
      most = std::max(most, report.sweeps);
      done += usable(lag.update(Gauge{}, y, jml::age(lag.depth() / 2)).status);
      done += usable(lag.predict());
      for (int age = 0; age <= lag.depth(); ++age) {
        inside += positive(lag.x(age)) && jml::all_finite(lag.P(age));
        acting += !(lag.belief().multiplier(age).squaredNorm() <= 0);
      }
    }
    refused += lag.step(Gauge{}, std::numeric_limits<double>::quiet_NaN()).status ==
               jml::Status::invalid_measurement;
    lag.method().bounds.upper(0) = -1;
    refused += lag.predict() == jml::Status::invalid_option;
    lag.method().bounds = bounds();
    lag.method().bounds.lower(0) = 1e3;  // from a pressure of some atm
    const jml::Vector<double, 2> before = lag.x();
    refused += lag.predict() == jml::Status::no_feasible_point;
    inside += lag.x() == before;
    auto copy = lag;
    done += usable(copy.reset(start(), 0));
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(done, 301);
  EXPECT_EQ(refused, 3);
  EXPECT_EQ(inside, 1100 - 8 - 6 - 4 - 2 + 1);  // until the window is full
  EXPECT_GT(acting, 3);
  EXPECT_LE(most, 100);
}
TEST(BoundsNoHeap, BatchAfterItsConstructor) {
  Flight flight;
  jml::BoundedBatch batch{Reactor{}, jml::sensors<Gauge>, start(), {.steps = 100}, bounds()};
  int done = 0;
  {
    Armed trap;
    for (int k = 0; k < 100; ++k) done += usable(batch.step(Gauge{}, flight.next()).status);
    done += usable(batch.solve().status);
    for (int k = 0; k <= 100; ++k) done += positive(batch.x(k));
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(done, 202);
  EXPECT_NEAR(batch.x()(0), flight.x(0), 0.1);
}

/// A mass pushed at random, seen by its place.
template <typename Scalar>
struct Mass {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + Scalar(0.125) * x(1), x(1)};
  }
  jml::Matrix<Scalar, 2, 1> disturbance_input() const { return {0, Scalar(0.125)}; }
  jml::Matrix<Scalar, 1, 1> disturbance_covariance() const { return jml::Matrix<Scalar, 1, 1>(8); }
};
template <typename Scalar>
auto make_stop() {
  jml::Bounds<2, 1, Scalar> stop;
  stop.upper << Scalar(0.5), jml::Bounds<2, 1, Scalar>::infinite;
  stop.w_lower << -2;
  return jml::Filter{jml::Bounded{jml::FixedLag<8>{}, stop}, Mass<Scalar>{}, jml::sensors<Place<Scalar>>,
                     jml::Estimate<Scalar, 2>{{0, 0}, jml::Matrix<Scalar, 2, 2>::Identity()}};
}
TEST(BoundsFloat, AgreesWithDouble) {
  auto lag = make_stop<double>();
  auto single = make_stop<float>();
  int acting = 0, most = 0;
  for (int k = 0; k < 100; ++k) {
    const double y = std::sin(0.1 * k) + 0.2 * std::cos(1.7 * k);
    ASSERT_TRUE(usable(lag.step(Place<double>{}, y).status));
    const auto report = single.step(Place<float>{}, static_cast<float>(y));
    ASSERT_TRUE(usable(report.status)) << k << jml::describe(report.status);
    most = std::max(most, report.sweeps);
    for (int age = 0; age <= lag.depth(); ++age) {
      ASSERT_LE(single.x(age)(0), 0.5F);
      ASSERT_LT((single.x(age).cast<double>() - lag.x(age)).norm(), 2e-3) << k;
      acting += lag.x(age)(0) >= 0.5;
    }
  }
  EXPECT_GT(acting, 50);
  EXPECT_LT(most, 60);
}

}  // namespace
