// SPDX-License-Identifier: BSD-3-Clause
// A sensor in operation: counts, a jump of the truth behind a gate, a burst of outliers, blocks of a
// measurement, a gate for late ones, underweighting, parameters changed in flight.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>

#include "figure.hpp"
#include "models/radar.hpp"

namespace {

using jml::Status, jml::Verdict;
using models::BallisticTarget, models::Radar;
using Vector6 = jml::Vector<double, 6>;
using Vector3 = jml::Vector<double, 3>;
using Matrix6 = jml::Matrix<double, 6, 6>;
using Filter = decltype(jml::Filter{jml::Ekf{}, BallisticTarget{}, jml::Estimate<double, 6>{}});

jml::Estimate<double, 6> start() {
  Vector6 x, variances;
  x << 40, 30, 5, -0.3, -0.2, 0.4;
  variances << 1, 1, 1, 0.01, 0.01, 0.01;
  return {x, Matrix6(variances.asDiagonal())};
}

/// The truth and its measurements.
struct Flight {
  explicit Flight(std::uint64_t seed) : noise(seed) {
    x = start().x;
    for (int i = 0; i < 6; ++i) x(i) += std::sqrt(start().P(i, i)) * noise.normal();
  }
  Vector3 next() {
    jml::Vector<double, 6> kick = Vector6::Zero();
    for (int i = 0; i < 3; ++i) kick(3 + i) = target.dt * 1e-2 * noise.normal();
    x = target.dynamics(x) + kick;
    Vector3 y = Radar{}.measurement(x);
    y(0) += 0.02 * noise.normal();
    for (int i = 1; i < 3; ++i) y(i) += 2e-3 * noise.normal();
    return y;
  }
  jml::Noise noise;
  BallisticTarget target;
  Vector6 x;
};

/// √P_ii of the predicted position at sample 250, of a filter without faults.
Vector3 steady_deviation() {
  Flight flight(1);
  Filter filter{jml::Ekf{}, BallisticTarget{}, start()};
  for (int k = 0; k < 249; ++k) EXPECT_EQ(filter.step(Radar{}, flight.next(), 0.1).status, Status::ok);
  EXPECT_EQ(filter.predict(0.1), Status::ok);
  return filter.P().diagonal().head<3>().cwiseSqrt();
}

/// The policy of the two tests below: a run of twenty opens the gate, and P gets what a jump may be.
jml::Lockout<6> policy() {
  jml::Lockout<6> lockout{.after = 20, .recovery = jml::Recovery::inflate};
  lockout.variances << 100, 100, 100, 1, 1, 1;
  return lockout;
}

/// The largest |x̂ - x|/σ of the three positions, σ of the steady prediction.
double distance(const Filter& filter, const Flight& flight, const Vector3& sd) {
  double most = 0;
  for (int i = 0; i < 3; ++i) most = std::max(most, std::abs(filter.x()(i) - flight.x(i)) / sd(i));
  return most;
}

TEST(Channel, AJumpOfTheTruthBehindAGate) {
  const Vector3 sd = steady_deviation();
  int latest = 0;
  for (const bool with_policy : {false, true}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Flight flight(seed);
      Filter filter{jml::Ekf{}, BallisticTarget{}, start()};
      jml::Channel radar{Radar{}, with_policy ? policy() : jml::Lockout<6>{}};
      radar.gate = {0.999};
      int rejected = 0, back = -1;
      for (int k = 0; k < 500; ++k) {
        if (k == 250) {
          for (int i = 0; i < 3; ++i) flight.x(i) += 100 * sd(i);
        }
        const auto report = radar.step(filter, flight.next(), 0.1);
        ASSERT_EQ(report.status, Status::ok);
        rejected += k >= 250 && report.gate == Verdict::rejected;
        if (k >= 250 && back < 0 && distance(filter, flight, sd) < 3) back = k - 250;
      }
      EXPECT_EQ(radar.tally().accepted + radar.tally().rejected, 500U);
      if (with_policy) {
        EXPECT_GE(back, 19);
        EXPECT_LE(back, 60) << seed;
        latest = std::max(latest, back);
        EXPECT_EQ(radar.tally().recovered, 1U);
        EXPECT_LT(distance(filter, flight, sd), 5) << seed;
      } else {
        EXPECT_EQ(back, -1);
        EXPECT_GE(rejected, 248);
      }
    }
  }
  figure::print("back_after", latest, "samples");
}

// Pulled: away from a filter that is told which measurements are outliers. (From one that got all of them
// good it is away by what twenty lost measurements cost.)
TEST(Channel, ABurstOfOutliersAtTheSamePolicy) {
  const Vector3 sd = steady_deviation();
  double pulled = 0, away = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Flight flight(seed);
    Filter filter{jml::Ekf{}, BallisticTarget{}, start()}, told = filter, clean = filter;
    jml::Channel radar{Radar{}, policy()}, by_one_who_knows{Radar{}, policy()}, good{Radar{}, policy()};
    radar.gate = by_one_who_knows.gate = good.gate = {0.999};
    jml::Noise places(seed + 1000);
    int left = 20;  // outliers, among the samples 250 … 289
    for (int k = 0; k < 320; ++k) {
      Vector3 y = flight.next();
      ASSERT_EQ(good.step(clean, y, 0.1).status, Status::ok);
      const bool outlier = k >= 250 && k < 290 && places.uniform() * (290 - k) < left;
      left -= outlier;
      by_one_who_knows.use = outlier ? jml::Use::inhibit : jml::Use::accept;
      for (int i = 0; i < 3 && outlier; ++i)
        y(i) += 50 * (i == 0 ? 0.02 : 2e-3) * (places.uniform() < 0.5 ? -1 : 1);
      ASSERT_EQ(by_one_who_knows.step(told, y, 0.1).status, Status::ok);
      ASSERT_EQ(radar.step(filter, y, 0.1).status, Status::ok);
      for (int i = 0; i < 3; ++i) {
        pulled = std::max(pulled, std::abs(filter.x()(i) - told.x()(i)) / sd(i));
        away = std::max(away, std::abs(filter.x()(i) - clean.x()(i)) / sd(i));
      }
    }
    EXPECT_EQ(left, 0);
    EXPECT_EQ(radar.tally().recovered, 0U);
    EXPECT_GE(radar.tally().rejected, 20U);
  }
  std::printf("pulled by at most %.2g deviations in 200 bursts; away from all measurements good by %.2f\n",
              pulled, away);
  figure::print("burst_pulls_by", pulled, "deviations");
  EXPECT_LT(pulled, 3);
}

TEST(Channel, SpendsItsRecoveriesAndSaysThatItIsShut) {
  for (const jml::Recovery how : {jml::Recovery::report, jml::Recovery::widen, jml::Recovery::accept}) {
    Filter filter{jml::Ekf{}, BallisticTarget{}, start()};
    jml::Channel radar{Radar{},
                       jml::Lockout<>{.after = 5, .recovery = how, .probability = 0.9999, .times = 2}};
    radar.gate = {0.999};
    const Vector6 far = start().x + 100 * Vector6::Ones();
    int first = -1;
    for (int k = 0; k < 30 && first < 0; ++k) {
      if (radar.step(filter, Radar{}.measurement(far), 0.1).gate == Verdict::accepted) first = k;
    }
    EXPECT_TRUE(filter.gate.off());                           // the filter's own is as it was
    EXPECT_EQ(first, how == jml::Recovery::accept ? 4 : -1);  // the fifth in a row
    EXPECT_EQ(radar.shut(), how != jml::Recovery::accept);
    EXPECT_EQ(radar.tally().recovered > 0, how != jml::Recovery::report);
  }
}

TEST(Channel, IsShutOrForcedAndCounts) {
  Flight flight(4);
  Filter filter{jml::Ekf{}, BallisticTarget{}, start()}, predicted = filter;
  jml::Channel radar{Radar{}};
  radar.gate = {0.999};
  radar.use = jml::Use::inhibit;
  Vector3 y = flight.next();
  EXPECT_EQ(radar.step(filter, y, 0.1).gate, Verdict::inhibited);
  EXPECT_EQ(predicted.predict(0.1), Status::ok);
  EXPECT_EQ(filter.x(), predicted.x());
  EXPECT_EQ(filter.P(), predicted.P());
  EXPECT_EQ(filter.time(), 0.1);
  EXPECT_EQ(radar.update(filter, y).gate, Verdict::inhibited);
  EXPECT_EQ(filter.x(), predicted.x());
  radar.use = jml::Use::force;
  y = flight.next();
  y(0) += 8;  // of a deviation of one
  Filter open = filter;
  EXPECT_EQ(open.step(Radar{}, y, 0.1).status, Status::ok);
  Filter closed = filter;
  closed.gate = {0.999};
  EXPECT_EQ(closed.step(Radar{}, y, 0.1).gate, Verdict::rejected);
  EXPECT_EQ(radar.step(filter, y, 0.1).gate, Verdict::accepted);
  EXPECT_EQ(filter.x(), open.x());
  // What is not finite is not forced: the prediction stands, and time goes on.
  y(1) = std::nan("");
  EXPECT_EQ(open.predict(0.1), Status::ok);
  EXPECT_EQ(radar.step(filter, y, 0.1).status, Status::invalid_measurement);
  EXPECT_EQ(filter.x(), open.x());
  EXPECT_NEAR(filter.time(), 0.3, 1e-15);
  EXPECT_NEAR(radar.since_accepted(filter.time()), 0.1, 1e-15);
  EXPECT_EQ(radar.tally().inhibited, 2U);
  EXPECT_EQ(radar.tally().accepted, 1U);
  EXPECT_EQ(radar.tally().refused, 1U);
  EXPECT_EQ(radar.rejected_in_a_row(), 0);
}

TEST(Channel, OneBadAzimuthKeepsTheRange) {
  Flight flight(5);
  Filter filter{jml::Ekf{}, BallisticTarget{}, start()};
  jml::Channel radar{Radar{}, jml::Lockout{}, jml::blocks(jml::only(0), jml::only(1), jml::only(2))};
  radar.gate = {0.999};
  for (int k = 0; k < 50; ++k) ASSERT_EQ(radar.step(filter, flight.next(), 0.1).status, Status::ok);
  const auto before = radar.tally();
  Filter by_hand = filter;
  Vector3 y = flight.next();
  y(1) += 0.5;
  ASSERT_EQ(by_hand.predict(0.1), Status::ok);
  ASSERT_EQ(by_hand.update(Radar{}, y, jml::only(0, 2)).status, Status::ok);
  const auto report = radar.step(filter, y, 0.1);
  EXPECT_EQ(report.gate, Verdict::rejected);
  EXPECT_GT(report.innovation(1), 0.4);  // that of all rows
  EXPECT_EQ(filter.x(), by_hand.x());
  EXPECT_EQ(filter.P(), by_hand.P());
  EXPECT_EQ(radar.tally().partial, before.partial + 1);
  EXPECT_EQ(radar.rejected_in_a_row(), 1);
  // A policy does not offer again what was used in part; it says that the gate has shut.
  radar.lockout = {.after = 2, .recovery = jml::Recovery::accept};
  y = flight.next();
  y(1) += 0.5;
  ASSERT_EQ(by_hand.predict(0.1), Status::ok);
  ASSERT_EQ(by_hand.update(Radar{}, y, jml::only(0, 2)).status, Status::ok);
  EXPECT_EQ(radar.step(filter, y, 0.1).gate, Verdict::rejected);
  EXPECT_EQ(filter.P(), by_hand.P());
  EXPECT_TRUE(radar.shut());
}

TEST(Channel, AGateForALateMeasurement) {
  Flight flight(6);
  const jml::FixedLag<6, 2> method{jml::LagOptions{.sweeps = 10}};
  jml::Filter lag{method, BallisticTarget{}, jml::sensors<Radar>, start()};
  jml::Channel radar{Radar{}}, second{Radar{}};
  radar.gate = second.gate = {0.999};
  Vector3 then;
  for (int k = 0; k < 20; ++k) {
    const Vector3 y = flight.next();
    if (k == 17) then = Radar{}.measurement(flight.x);
    ASSERT_TRUE(jml::usable(radar.step(lag, y, 0.1).status));
  }
  const Vector6 x = lag.x();
  Vector3 wrong = then;
  wrong(0) += 3;
  const auto report = second.update(lag, wrong, jml::age(2));
  EXPECT_EQ(report.status, Status::ok);
  EXPECT_EQ(report.gate, Verdict::rejected);
  EXPECT_EQ(lag.x(), x);
  EXPECT_EQ(lag.depth(), 6);
  // S = R + H P Hᵀ with P of that node.
  const auto H = Radar{}.measurement_jacobian(lag.x(2));
  const jml::Matrix<double, 3, 3> S = Radar{}.noise_covariance() + H * lag.P(2) * H.transpose();
  EXPECT_LT((report.innovation_matrix - S).norm(), 1e-12 * S.norm());
  EXPECT_EQ(second.update(lag, then, jml::age(2)).gate, Verdict::accepted);
  EXPECT_NE(lag.x(), x);
}

// While P is large the correction is that of R + β S, by hand; afterwards it is the filter's own.
TEST(Channel, Underweights) {
  Flight flight(7);
  Filter filter{jml::Ekf{}, BallisticTarget{}, start()}, plain = filter;
  jml::Channel radar{jml::Underweighted{Radar{}, 0.2, Vector3(0.5, 0.01, 0.01)}};
  const Vector3 y = flight.next();
  ASSERT_EQ(plain.predict(0.1), Status::ok);
  const Vector6 x = plain.x();
  const Matrix6 P = plain.P();
  const auto H = Radar{}.measurement_jacobian(x);
  const jml::Matrix<double, 3, 3> S = 1.2 * (Radar{}.noise_covariance() + H * P * H.transpose());
  const jml::Matrix<double, 6, 3> K = P * H.transpose() * S.inverse();
  ASSERT_EQ(radar.step(filter, y, 0.1).status, Status::ok);
  EXPECT_LT((filter.x() - (x + K * (y - Radar{}.measurement(x)))).norm(), 1e-12);
  EXPECT_LT((filter.P() - (P - K * S * K.transpose())).norm(), 1e-12);
  // What is added is of that S which R alone gives, not of the last one with what was added then.
  radar.sensor.share = 1;
  plain = filter;
  ASSERT_EQ(plain.predict(0.1), Status::ok);
  radar.sensor.above.setZero();
  ASSERT_EQ(radar.step(filter, flight.next(), 0.1).status, Status::ok);
  const auto H2 = Radar{}.measurement_jacobian(plain.x());
  const jml::Matrix<double, 3, 3> S2 = Radar{}.noise_covariance() + H2 * plain.P() * H2.transpose();
  EXPECT_LT((radar.sensor.added - S2).norm(), 1e-12 * S2.norm());
  radar.sensor.above << 0.5, 0.01, 0.01;
  for (int k = 0; k < 30; ++k) ASSERT_EQ(radar.step(filter, flight.next(), 0.1).status, Status::ok);
  EXPECT_EQ(radar.sensor.added.norm(), 0);
}

TEST(Channel, ParametersChangedInFlight) {
  Flight flight(8);
  Filter filter{jml::Ekf{}, BallisticTarget{}, start()};
  jml::Channel radar{Radar{}};
  ASSERT_EQ(radar.step(filter, flight.next(), 0.1).status, Status::ok);
  EXPECT_EQ(radar.retune(Radar{.range_sd = 0}, filter), Status::invalid_noise_covariance);
  EXPECT_EQ(radar.sensor.range_sd, 0.02);
  EXPECT_EQ(radar.retune(jml::Gate{1.5}), Status::invalid_option);
  EXPECT_EQ(radar.retune(jml::Gate{0.99}), Status::ok);
  EXPECT_EQ(radar.gate.probability, 0.99);
  EXPECT_EQ(radar.retune(Radar{.range_sd = 0.1}, filter), Status::ok);
  EXPECT_EQ(radar.sensor.range_sd, 0.1);
  BallisticTarget other;
  other.acceleration_variance = -1;
  const Matrix6 P = filter.P();
  EXPECT_EQ(filter.retune(other), Status::invalid_disturbance_covariance);
  EXPECT_EQ(filter.dynamics().acceleration_variance, 1e-4);
  other.acceleration_variance = 1;
  EXPECT_EQ(filter.retune(other), Status::ok);
  EXPECT_EQ(filter.P(), P);
  ASSERT_EQ(filter.predict(0.1), Status::ok);
  Filter fresh{jml::Ekf{}, other, jml::Estimate<double, 6>{start().x, P}};
  ASSERT_EQ(fresh.predict(0.1), Status::ok);
  EXPECT_NEAR(filter.P()(3, 3), fresh.P()(3, 3), 1e-3 * fresh.P()(3, 3));
  // A window begins anew at the present, with the same x and P.
  jml::Filter lag{jml::FixedLag<6, 2>{jml::LagOptions{.sweeps = 10}}, BallisticTarget{}, jml::sensors<Radar>,
                  start()};
  for (int k = 0; k < 9; ++k) ASSERT_TRUE(jml::usable(lag.step(Radar{}, flight.next(), 0.1).status));
  const Vector6 x = lag.x();
  const Matrix6 before = lag.P();
  EXPECT_EQ(lag.retune(other), Status::ok);
  EXPECT_EQ(lag.x(), x);
  EXPECT_LT((lag.P() - before).norm(), 1e-12 * before.norm());
  EXPECT_EQ(lag.dynamics().acceleration_variance, 1);
}

}  // namespace
