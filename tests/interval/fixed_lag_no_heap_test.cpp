// SPDX-License-Identifier: BSD-3-Clause
// A fixed-lag filter never touches the heap, its constructor included; and it works in single precision.
#include <gtest/gtest.h>

#include <cstdlib>
#include <jml/interval/fixed_lag.hpp>

#include "heap_trap.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using heap_trap::allocations, heap_trap::Armed;
using jml::usable;

TEST(FixedLagNoHeap, TheTrapWorks) {
  Armed trap;
  void* volatile block = std::malloc(8);
  std::free(block);
  EXPECT_EQ(allocations, 1);
}

/// Construction, every verb, refusals, covariances, a copy, a new start: until well after the window slides.
template <int L, typename D, typename S, typename Scalar, int n, int p>
void expect_no_allocation(const D& dynamics, const S& sensor, const jml::Estimate<Scalar, n>& start,
                          const jml::Vector<Scalar, p>& y) {
  int done = 0, refused = 0;
  bool finite = true;
  {
    Armed trap;
    jml::Filter filter{jml::FixedLag<L, 2>{}, dynamics, jml::sensors<S>, start};
    filter.gate = {0.9999999};
    filter.method().options.loss = jml::Loss::huber(3);
    for (int k = 0; k < 3 * L; ++k) {
      done += usable(filter.step(sensor, y).status);
      done += usable(filter.predict());
      done += usable(filter.update(sensor, y).status);
      done += usable(filter.update(sensor, y, jml::age(filter.depth() / 2)).status);
      for (int age = 0; age <= filter.depth(); ++age) finite &= jml::all_finite(filter.P(age));
    }
    jml::Vector<Scalar, p> bad = y;
    bad(0) = std::numeric_limits<Scalar>::quiet_NaN();
    refused += filter.step(sensor, bad).status == jml::Status::invalid_measurement;
    refused += filter.update(sensor, y, jml::age(L + 1)).status == jml::Status::older_than_window;
    auto copy = filter;
    refused += copy.step(sensor, bad).status == jml::Status::invalid_measurement;
    done += usable(filter.reset(start, 0));
    finite &= jml::all_finite(filter.estimate().P);
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(done, 12 * L + 1);
  EXPECT_EQ(refused, 3);
  EXPECT_TRUE(finite);
}

TEST(FixedLagNoHeap, VanDerPol) {
  const jml::Estimate<double, 2> start{{1.5, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};
  expect_no_allocation<8>(models::VanDerPol{}, models::SaturatingPosition{}, start,
                          jml::Vector<double, 1>(0.6));
}

TEST(FixedLagNoHeap, Radar) {
  jml::Estimate<double, 6> start;
  start.x << 40, 25, 12, -0.4, 0.1, 0.02;
  start.P = 1e-2 * jml::Matrix<double, 6, 6>::Identity();
  const models::BallisticTarget dynamics;
  const models::Radar sensor;
  expect_no_allocation<4>(dynamics, sensor, start,
                          jml::Vector<double, 3>(sensor.measurement(dynamics.dynamics(start.x))));
}

// The same oscillator in float, with its Jacobians derived.

struct FloatVanDerPol {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    const T acceleration = -x(0) - 0.2F * (x(0) * x(0) - 1.0F) * x(1);
    return {x(0) + 0.05F * x(1), x(1) + 0.05F * acceleration};
  }
  jml::Matrix<float, 2, 1> disturbance_input() const { return {0.0F, 0.05F}; }
  jml::Matrix<float, 1, 1> disturbance_covariance() const { return jml::Matrix<float, 1, 1>(20.0F); }
};

struct FloatSaturatingPosition {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0F + x(0) * x(0)));
  }
  jml::Matrix<float, 1, 1> noise_covariance() const { return jml::Matrix<float, 1, 1>(0.02F); }
};

const jml::Estimate<float, 2> float_start{{1.5F, 0.5F}, 0.3F * jml::Matrix<float, 2, 2>::Identity()};

TEST(FixedLagFloat, NoHeap) {
  expect_no_allocation<8>(FloatVanDerPol{}, FloatSaturatingPosition{}, float_start,
                          jml::Vector<float, 1>(0.6F));
}

// Default options and to convergence: in float the tolerance is below rounding, which must end the sweeps.
TEST(FixedLagFloat, AgreesWithDouble) {
  const jml::Estimate<double, 2> start{float_start.x.cast<double>(), float_start.P.cast<double>()};
  for (const int sweeps : {2, 50}) {
    SCOPED_TRACE(sweeps);
    jml::Filter filter{jml::FixedLag<8, 2>{}, models::VanDerPol{}, jml::sensors<models::SaturatingPosition>,
                         start};
    jml::Filter single{jml::FixedLag<8, 2>{}, FloatVanDerPol{}, jml::sensors<FloatSaturatingPosition>,
                         float_start};
    filter.method().options.sweeps = single.method().options.sweeps = sweeps;
    int passes = 0;
    for (int k = 0; k < 200; ++k) {
      const double y = 0.6 * std::sin(0.05 * k) + 0.1 * std::cos(1.7 * k);
      ASSERT_TRUE(usable(filter.step(models::SaturatingPosition{}, y).status)) << k;
      const auto report = single.step(FloatSaturatingPosition{}, static_cast<float>(y));
      ASSERT_TRUE(usable(report.status)) << k << jml::describe(report.status);
      passes += report.sweeps;
      for (const int age : {0, filter.depth()}) {
        ASSERT_LT((single.x(age).cast<double>() - filter.x(age)).norm(), 1e-4) << k;
        ASSERT_LT((single.P(age).cast<double>() - filter.P(age)).norm(), 1e-4) << k;
      }
    }
    EXPECT_LT(passes, 200 * 6);
  }
}

}  // namespace
