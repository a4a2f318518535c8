// SPDX-License-Identifier: BSD-3-Clause
// The continuous EKF over states in a space: an attitude with the bias of its gyroscope, against the same
// estimate written out by hand, without a chart (gyro_attitude.hpp).
#include <gtest/gtest.h>

#include <jml/filter/check_method.hpp>
#include <jml/filter/compare.hpp>
#include <jml/model/discretize.hpp>
#include <jml/riccati/davison_maki.hpp>

#include "heap_trap.hpp"
#include "space/gyro_attitude.hpp"

namespace {

using namespace gyro_attitude;

// What a direction would look like to a body that does not turn as ours does: the innovations stay large.
Vector3 seen(double t) { return {0.6 * std::cos(t), 0.5 * std::sin(2 * t), 0.8}; }

template <typename Integrator>
auto filter_by(const Integrator& integrator) {
  return jml::Filter{jml::Continuous{jml::Ekf{}, integrator}, Gyro{}, start()};
}
ByHand by_hand(double span) {
  ByHand right{start().x, start().P};
  right.move(0, span, 4000);
  return right;
}
template <typename Integrator>
Error error_of(const Integrator& integrator, int steps, double span, const ByHand& right) {
  auto filter = filter_by(integrator);
  for (int k = 0; k < steps; ++k) EXPECT_EQ(filter.predict(span / steps), jml::Status::ok);
  EXPECT_NEAR(filter.x().template head<4>().norm(), 1, 1e-15);
  EXPECT_TRUE(filter.P() == filter.P().transpose());
  return off(filter.x(), filter.P(), right);
}

TEST(ContinuousInSpace, RungeKuttaHasItsOrderInAttitudeAndCovariance) {
  const ByHand right = by_hand(2);
  const Error coarse = error_of(jml::RungeKutta4{}, 20, 2, right),
              fine = error_of(jml::RungeKutta4{}, 40, 2, right);
  EXPECT_LT(fine.x, 1e-7);
  EXPECT_LT(fine.P, 1e-7);
  EXPECT_NEAR(std::log2(coarse.x / fine.x), 4, 0.2);
  EXPECT_NEAR(std::log2(coarse.P / fine.P), 4, 0.2);
  // Eight substeps in one chart, for 0.5 s and nearly 1 rad.
  const Error substeps = error_of(jml::RungeKutta4{8}, 4, 2, right);
  EXPECT_LT(std::max(substeps.x, substeps.P), 2e-7);
}

TEST(ContinuousInSpace, DavisonMakiHasItsOrder) {
  const ByHand right = by_hand(2);
  const Error coarse = error_of(jml::DavisonMaki{}, 20, 2, right),
              fine = error_of(jml::DavisonMaki{}, 40, 2, right);
  EXPECT_LT(fine.P, 1e-3);
  EXPECT_NEAR(std::log2(coarse.x / fine.x), 2, 0.1);
  EXPECT_NEAR(std::log2(coarse.P / fine.P), 2, 0.1);
}

TEST(ContinuousInSpace, UnderASignalItHasTheOrderToo) {
  ByHand right{start().x, start().P};
  right.move(0, 1, 4000, seen);
  Error error[2];
  for (int i = 0; i < 2; ++i) {
    const int steps = 40 << i;
    auto filter = filter_by(jml::RungeKutta4{});
    for (int k = 0; k < steps; ++k) {
      const auto report = filter.step(Signal{}, seen, 1.0 / steps);
      ASSERT_EQ(report.status, jml::Status::ok);
      if (k == 0) {
        const Vector3 innovation = seen(0) - rotation(start().x.head<4>()).transpose() * direction;
        EXPECT_LT((report.innovation - innovation).norm(), 1e-14);
        EXPECT_EQ(report.gain.rows(), 6);
      }
    }
    error[i] = off(filter.x(), filter.P(), right);
  }
  EXPECT_LT(error[1].x, 1e-6);
  EXPECT_LT(error[1].P, 1e-6);
  EXPECT_NEAR(std::log2(error[0].x / error[1].x), 4, 0.4);
  EXPECT_NEAR(std::log2(error[0].P / error[1].P), 4, 0.4);
}

TEST(ContinuousInSpace, TakesSamples) {
  auto filter = filter_by(jml::RungeKutta4{4});
  ByHand right{start().x, start().P};
  for (int k = 1; k <= 20; ++k) {
    const Vector3 y = 0.7 * seen(0.1 * k);
    ASSERT_EQ(filter.step(Samples{}, y, 0.1).status, jml::Status::ok);
    right.move(0.1 * (k - 1), 0.1, 50);
    right.correct(y);
  }
  const Error error = off(filter.x(), filter.P(), right);
  EXPECT_LT(error.x, 1e-7);
  EXPECT_LT(error.P, 1e-7);
}

TEST(ContinuousInSpace, IsTheLimitOfTheDiscretisedFilter) {
  const ByHand right = by_hand(1);
  Error error[2];
  for (int i = 0; i < 2; ++i) {
    const int steps = 50 << i;
    jml::Filter filter{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(Gyro{}), start()};
    for (int k = 0; k < steps; ++k) EXPECT_EQ(filter.predict(1.0 / steps), jml::Status::ok);
    error[i] = off(filter.x(), filter.P(), right);
  }
  // x by the same step; a disturbance that is held adds to P with an error of the second order.
  EXPECT_LT(error[1].x, 1e-7);
  EXPECT_LT(error[1].P, 1e-5);
  EXPECT_NEAR(std::log2(error[0].P / error[1].P), 2, 0.2);
}

struct Dense : Look {
  double dt;
  Matrix3 noise_covariance() const { return 0.02 / dt * Matrix3::Identity(); }
};
TEST(ContinuousInSpace, UnderASignalItIsTheLimitOfEverDenserSamples) {
  auto filter = filter_by(jml::RungeKutta4{});
  for (int k = 0; k < 200; ++k) ASSERT_EQ(filter.step(Signal{}, seen, 0.005).status, jml::Status::ok);
  const ByHand right{filter.x(), filter.P()};
  Error error[2];
  for (int i = 0; i < 2; ++i) {
    const int steps = 500 << i;
    jml::Filter samples{jml::Ekf{}, jml::discretize<jml::RungeKutta4>(Gyro{}), start()};
    for (int k = 1; k <= steps; ++k)
      ASSERT_EQ(samples.step(Dense{{}, 1.0 / steps}, seen(double(k) / steps), 1.0 / steps).status,
                jml::Status::ok);
    error[i] = off(samples.x(), samples.P(), right);
  }
  EXPECT_LT(error[1].x, 0.02);
  EXPECT_LT(error[1].P, 0.02);
  EXPECT_NEAR(std::log2(error[0].x / error[1].x), 1, 0.1);
  EXPECT_NEAR(std::log2(error[0].P / error[1].P), 1, 0.1);
}

TEST(ContinuousInSpace, RefusesATurnBeyondItsChart) {
  auto filter = filter_by(jml::RungeKutta4{100});
  ASSERT_EQ(filter.predict(0.1), jml::Status::ok);
  const auto before = filter;
  EXPECT_EQ(filter.predict(20.0), jml::Status::step_too_long);
  EXPECT_EQ(filter.step(Samples{}, seen(0), 20.0).status, jml::Status::step_too_long);
  EXPECT_EQ(filter.step(Signal{}, seen(0), 20.0).status, jml::Status::step_too_long);
  EXPECT_TRUE(jml::same_bits(filter, before));
  EXPECT_EQ(filter.predict(0.5), jml::Status::ok);
}

TEST(ContinuousInSpace, KeepsWhatAFilterPromises) {
  const auto filter = filter_by(jml::RungeKutta4{});
  const auto samples = jml::check_method(filter, Samples{}, {seen(0), seen(0.1), seen(0.2)}, 0.1);
  EXPECT_TRUE(samples) << samples.what << " at " << samples.at;
  const auto signal = jml::check_method(filter, Signal{}, {seen(0), seen(0.1), seen(0.2)}, 0.1);
  EXPECT_TRUE(signal) << signal.what << " at " << signal.at;
  Vector7 stretched = start().x;
  stretched(0) += 0.1;
  const jml::Filter outside{jml::Continuous{jml::Ekf{}}, Gyro{}, jml::Estimate{stretched, start().P}};
  EXPECT_EQ(outside.status(), jml::Status::invalid_state);
}

TEST(ContinuousInSpace, TouchesNoHeap) {
  int good = 0;
  {
    heap_trap::Armed trap;
    auto filter = filter_by(jml::RungeKutta4{});
    for (int k = 0; k < 3; ++k) {
      good += filter.predict(0.01) == jml::Status::ok;
      good += filter.step(Samples{}, seen(0), 0.01).status == jml::Status::ok;
      good += filter.step(Signal{}, seen, 0.01).status == jml::Status::ok;
      good += filter.predict(20.0) == jml::Status::step_too_long;
    }
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  EXPECT_EQ(good, 12);
}

}  // namespace
