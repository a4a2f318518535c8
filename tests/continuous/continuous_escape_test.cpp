// SPDX-License-Identifier: BSD-3-Clause
// Finite escapes of the Riccati equation are named before they happen, at any step length, and what is no
// escape is not.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "continuous/continuous_check.hpp"
#include "models/escaping.hpp"

namespace {

using jml::DavisonMaki;
using jml::RungeKutta4;
using jml::Status;
namespace reference = continuous_reference;

/// Steps of dt until the first refusal, at most until `last`; every answer on the way must be finite.
template <typename Filter, typename S, typename Y>
Status run(Filter& filter, const S& sensor, const Y& y, double dt, double last) {
  while (filter.time() < last) {
    const auto before = filter.estimate();
    const double time = filter.time();
    const Status status = filter.step(sensor, y, dt).status;
    if (status != Status::ok) {
      EXPECT_EQ(filter.x(), before.x);
      EXPECT_EQ(filter.P(), before.P);
      EXPECT_EQ(filter.time(), time);
      return status;
    }
    EXPECT_TRUE(jml::all_finite(filter.P()));
  }
  return Status::ok;
}

template <int n, typename Integrator>
void copies(const Integrator& integrator, double dt) {
  SCOPED_TRACE(testing::Message() << n << " copies, dt = " << dt << ", " << integrator.substeps
                                  << " substeps");
  using Square = jml::Matrix<double, n, n>;
  const jml::Vector<double, n> one = jml::Vector<double, n>::Ones();
  jml::Filter filter{jml::Continuous{jml::Rnls{}, integrator}, models::EscapingCopies<n>{}, jml::Estimate{one, 0.5 * Square::Identity()}};
  EXPECT_EQ(run(filter, models::EscapingCopiesSensor<n>{}, one, dt, 3), Status::riccati_escape);
  EXPECT_LT(filter.time(), reference::escaping_copies_time);
  // The pole may be named up to 2.5 substeps ahead, or a sixteenth of the largest piece, 1/16 s.
  EXPECT_GT(filter.time(), reference::escaping_copies_time - std::max(3.0 * dt, 0.07) - 1e-9);
  EXPECT_LT((filter.x() - one).norm(), 1e-10);  // rounding, times a gain that grows
}

TEST(Escape, CopiesByRungeKutta) {
  for (const double dt : {1e-4, 1e-3, 0.01, 0.1, 0.3, 0.7, 2.0, 50.0}) {
    copies<1>(RungeKutta4{}, dt);
    copies<2>(RungeKutta4{}, dt);
  }
  copies<1>(RungeKutta4{1000}, 1.0);
  copies<2>(RungeKutta4{1000}, 1.0);
}
TEST(Escape, CopiesByDavisonMaki) {
  for (const double dt : {1e-4, 1e-3, 0.01, 0.1, 0.3, 0.7, 2.0, 50.0}) {
    copies<1>(DavisonMaki{}, dt);
    copies<2>(DavisonMaki{}, dt);
  }
  copies<1>(DavisonMaki{100}, 1.0);
  copies<2>(DavisonMaki{100}, 1.0);
}

template <typename Integrator>
void pair(const Integrator& integrator, double dt) {
  SCOPED_TRACE(testing::Message() << "dt = " << dt << ", " << integrator.substeps << " substeps");
  const auto start = continuous_check::estimate_of(reference::escaping_pair_start);
  jml::Filter filter{jml::Continuous{jml::Rnls{}, integrator}, models::EscapingPair{}, start};
  EXPECT_EQ(run(filter, models::EscapingPairSensor{}, 0.328125, dt, 3), Status::riccati_escape);
  EXPECT_LT(filter.time(), reference::escaping_pair_time);
  EXPECT_GT(filter.time(), reference::escaping_pair_time - std::max(3.0 * dt, 0.07) - 1e-9);
  EXPECT_LT((filter.x() - start.x).norm(), 1e-10);
}
TEST(Escape, PairByEveryIntegrator) {
  for (const double dt : {1e-4, 1e-3, 0.01, 0.1, 0.3, 0.8, 2.0}) {
    pair(RungeKutta4{}, dt);
    pair(DavisonMaki{}, dt);
  }
  pair(RungeKutta4{1000}, 1.0);
  pair(DavisonMaki{100}, 1.0);
}

// Until close to the pole the solutions are the references.
TEST(Escape, RightUpToThePole) {
  const auto start = continuous_check::estimate_of(reference::escaping_pair_start);
  jml::Filter maki{jml::Continuous{jml::Rnls{}, DavisonMaki{}}, models::EscapingPair{}, start};
  jml::Filter runge{jml::Continuous{jml::Rnls{}, RungeKutta4{2000}}, models::EscapingPair{}, start};
  for (const auto& sample : reference::escaping_pair_rnls) {
    ASSERT_EQ(maki.step(models::EscapingPairSensor{}, 0.328125, sample.time - maki.time()).status,
              Status::ok);
    ASSERT_EQ(runge.step(models::EscapingPairSensor{}, 0.328125, sample.time - runge.time()).status,
              Status::ok);
    EXPECT_LT(continuous_check::distance(maki.estimate(), continuous_check::estimate_of(sample)), 1e-12);
    EXPECT_LT(continuous_check::distance(runge.estimate(), continuous_check::estimate_of(sample)), 1e-11);
  }
  using Square = jml::Matrix<double, 2, 2>;
  const jml::Vector<double, 2> one(1, 1);
  jml::Filter copies{jml::Continuous{jml::Rnls{}, DavisonMaki{}}, models::EscapingCopies<2>{}, jml::Estimate{one, 0.5 * Square::Identity()}};
  for (const double t : {0.2, 0.5, 0.6, 0.65, 0.66}) {
    ASSERT_EQ(copies.step(models::EscapingCopiesSensor<2>{}, one, t - copies.time()).status, Status::ok) << t;
    EXPECT_NEAR(copies.P()(1, 1) / reference::escaping_copies_variance(t), 1, 1e-12);
    EXPECT_EQ(copies.P()(0, 1), 0);
  }
}

/// ẋ = w, y = x + v: P tends to √(Q R) at the rate 2 √(Q/R) from any start.
struct Walk {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>&) const {
    return jml::Vector<T, 1>(T(0));
  }
  template <typename T>
  jml::Matrix<T, 1, 1> dynamics_sdc(const jml::Vector<T, 1>&) const {
    return jml::Matrix<T, 1, 1>(T(0));
  }
  jml::Matrix<double, 1, 1> disturbance_spectral_density() const { return jml::Matrix<double, 1, 1>(1); }
};
struct Position {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  template <typename T>
  jml::Matrix<T, 1, 1> measurement_sdc(const jml::Vector<T, 1>&) const {
    return jml::Matrix<T, 1, 1>(T(1));
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(1e-6); }
};

// P(0) = 1e6, R = 1e-6: a transient of 1e-12 s. With θ(t) = √(Q/R) t + artanh(√(QR)/P(0)) the solution is
// P = √(QR) coth θ, and x - y falls as 1/sinh θ.
TEST(NoFalseAlarm, StiffTransientByDavisonMaki) {
  for (const double dt : {1e-5, 1e-3, 0.1, 1.0}) {
    jml::Filter filter{jml::Continuous{jml::Rnls{}, DavisonMaki{}}, Walk{}, jml::Estimate{jml::Vector<double, 1>(5), jml::Matrix<double, 1, 1>(1e6)}};
    const auto report = filter.step(Position{}, 2.0, dt);
    ASSERT_EQ(report.status, Status::ok) << jml::describe(report.status);
    const double start = std::atanh(1e-9), theta = 1e3 * dt + start;
    EXPECT_NEAR(filter.P()(0, 0) * std::tanh(theta), 1e-3, 1e-12) << dt;
    EXPECT_NEAR(filter.x()(0), 2 + 3 * std::sinh(start) / std::sinh(theta), 1e-12) << dt;
  }
}

// A fixed explicit step that is too long for the gain says so, and does not call it an escape; a shorter one
// works.
TEST(NoFalseAlarm, StiffTransientByRungeKutta) {
  const jml::Estimate start{jml::Vector<double, 1>(5), jml::Matrix<double, 1, 1>(1e-2)};
  for (const double dt : {1e-3, 0.1}) {  // P/R = 1e4
    jml::Filter filter{jml::Continuous{jml::Rnls{}, RungeKutta4{}}, Walk{}, start};
    EXPECT_EQ(filter.step(Position{}, 2.0, dt).status, Status::step_too_long);
    EXPECT_EQ(filter.P(), start.P);
    EXPECT_EQ(filter.time(), 0);
  }
  jml::Filter filter{jml::Continuous{jml::Rnls{}, RungeKutta4{100}}, Walk{}, start};
  EXPECT_EQ(filter.step(Position{}, 2.0, 1e-3).status, Status::ok);
  // P(t) = s tanh(s t/R + artanh(P0/s)) for P0 < s; here P0 > s: coth. s = √(QR) = 1e-3.
  EXPECT_NEAR(filter.P()(0, 0), 1e-3 / std::tanh(1 + std::atanh(0.1)), 1e-8);
}

// The chapter's example from a poor start, [3, -1] with P = I: P falls by 1e5 in microseconds, no rule is
// alarmed.
TEST(NoFalseAlarm, ChapterExampleFromAPoorStart) {
  const continuous_check::OscillatorCase c{};
  jml::Estimate<double, 2> start;
  start.x << 3, -1;
  start.P.setIdentity();
  jml::Filter filter{jml::Continuous{jml::Rnls{}, DavisonMaki{}}, c.dynamics, start};
  for (int i = 0; i < 2000; ++i) {
    const auto y = c.y(filter.time());
    ASSERT_EQ(filter.step(c.sensor, y, 1e-2).status, Status::ok) << filter.time();
  }
}

}  // namespace
