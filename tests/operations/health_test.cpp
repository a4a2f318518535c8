// SPDX-License-Identifier: BSD-3-Clause
// A watch on innovations: its rate of false alarms, and how soon it finds a sensor that is biased, stuck or
// noisier than it says. Limits of x and P. The word for it all.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <string>

#include "figure.hpp"

namespace {

using jml::Concern, jml::Status;
using Vector2 = jml::Vector<double, 2>;
using Matrix2 = jml::Matrix<double, 2, 2>;

/// A position that is pushed about, and its velocity, per sample.
struct Walk {
  static constexpr int states = 2, disturbances = 2;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + x(1), 0.9 * x(1)};
  }
  Matrix2 disturbance_covariance() const { return (Matrix2() << 0.04, 0, 0, 0.01).finished(); }
};
/// Position and velocity, with correlated noise.
struct Both {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return x;
  }
  Matrix2 noise_covariance() const { return (Matrix2() << 1, 0.3, 0.3, 1).finished(); }
};

using Filter = decltype(jml::Filter{jml::Kalman{}, Walk{}, jml::Estimate<double, 2>{}});

struct Truth {
  explicit Truth(std::uint64_t seed) : noise(seed) { x << noise.normal(), noise.normal(); }
  Vector2 next(double sd = 1) {
    const double a = noise.normal(), b = noise.normal(), c = noise.normal(), d = noise.normal();
    x = Walk{}.dynamics(x) + Vector2(0.2 * a, 0.1 * b);
    return x + sd * Vector2(c, 0.3 * c + std::sqrt(1 - 0.09) * d);
  }
  jml::Noise noise;
  Vector2 x;
};
Filter fresh() {
  return Filter{jml::Kalman{}, Walk{}, jml::Estimate<double, 2>{Vector2(0, 0), Matrix2::Identity()}};
}

TEST(Monitor, FalseAlarmsAtTheRateAskedFor) {
  constexpr int window = 10, samples = 100000;
  for (const double rate : {0.05, 0.02}) {
    Truth truth(11);
    Filter filter = fresh();
    jml::Channel sensor{Both{}};
    sensor.monitor.options = {.window = window, .false_alarms = rate, .repeats = 5};
    int high = 0, low = 0, biased = 0, stuck = 0;
    for (int k = 1; k <= samples; ++k) {
      ASSERT_EQ(sensor.step(filter, truth.next(), 1.0).status, Status::ok);
      const jml::Alarms& alarms = sensor.alarms();
      if (k % window != 0) continue;
      high += alarms.nis_high;
      low += alarms.nis_low;
      biased += alarms.biased != 0;
      stuck += alarms.stuck;
    }
    const double expected = rate * samples / window;
    std::printf("rate %.2f: %.0f false alarms expected in 1e5 samples, %d high, %d low, %d biased\n", rate,
                expected, high, low, biased);
    const std::string key = rate > 0.03 ? "of_500" : "of_200";
    figure::print(key + "_high", high);
    figure::print(key + "_low", low);
    figure::print(key + "_biased", biased);
    EXPECT_NEAR(high, expected, 0.2 * expected);
    EXPECT_NEAR(low, expected, 0.2 * expected);
    EXPECT_NEAR(biased, expected, 0.2 * expected);
    EXPECT_EQ(stuck, 0);
  }
}

enum class Fault { bias, stuck, noisy };

/// Samples from a fault to the first alarm of a kind; 1000 where there was none. `second`: a good sensor
/// beside.
int samples_to_alarm(std::uint64_t seed, Fault fault, bool second) {
  Truth truth(seed), other(seed + 1000);
  Filter filter = fresh();
  jml::Channel sensor{Both{}}, good{Both{}};
  sensor.gate = {0.999};
  sensor.monitor.options = {.window = 10, .false_alarms = 1e-4, .repeats = 4};
  Vector2 held(0, 0);
  for (int k = 0; k < 1000; ++k) {
    Vector2 y = truth.next(fault == Fault::noisy && k >= 105 ? 3 : 1);
    if (fault == Fault::bias && k >= 105) y(0) += 5;
    if (k == 105) held = y;
    if (fault == Fault::stuck && k >= 105) y = held;
    EXPECT_EQ(sensor.step(filter, y, 1.0).status, Status::ok);
    if (second) {
      const Vector2 v(other.noise.normal(), other.noise.normal());
      EXPECT_EQ(good.update(filter, truth.x + Vector2(v(0), 0.3 * v(0) + std::sqrt(0.91) * v(1))).status,
                Status::ok);
    }
    if (k < 105) continue;
    const jml::Alarms& alarms = sensor.alarms();
    if (fault == Fault::stuck ? alarms.stuck : alarms.nis_high || alarms.biased != 0) return k - 104;
  }
  return 1000;
}

// A bias that the states can explain is absorbed within a few samples where nothing else sees them: found in
// two cases of three. With a second sensor it is always found.
TEST(Monitor, FindsASensorThatIsNotWhatItSays) {
  int bias = 0, alone = 0, stuck = 0, noisy = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    bias = std::max(bias, samples_to_alarm(seed, Fault::bias, true));
    alone += samples_to_alarm(seed, Fault::bias, false) <= 20;
    stuck = std::max(stuck, samples_to_alarm(seed, Fault::stuck, false));
    noisy = std::max(noisy, samples_to_alarm(seed, Fault::noisy, false));
  }
  std::printf(
      "found after at most: a bias of 5 deviations %d samples (alone: %d of 200 within 20), a stuck sensor "
      "%d, "
      "noise of 3 times %d\n",
      bias, alone, stuck, noisy);
  figure::print("bias_found_within", bias, "samples");
  figure::print("bias_found_alone", alone / 2.0, "%");
  figure::print("stuck_found_within", stuck, "samples");
  figure::print("noise_found_within", noisy, "samples");
  EXPECT_LE(bias, 20);  // two windows
  EXPECT_GE(alone, 100);
  EXPECT_EQ(stuck, 4);  // options.repeats
  EXPECT_LE(noisy, 20);
}

TEST(Limits, KeepACovariance) {
  jml::Noise noise(5);
  for (int trial = 0; trial < 200; ++trial) {
    const double r = 1.998 * noise.uniform() - 0.999, a = std::exp(3 * noise.normal()),
                 b = std::exp(3 * noise.normal());
    const Matrix2 P = (Matrix2() << a * a, r * a * b, r * a * b, b * b).finished();
    Filter filter{jml::Kalman{}, Walk{}, jml::Estimate<double, 2>{Vector2(3, -4), P}};
    jml::Limits<2> limits;
    limits.least_variance << 0.5, 0.01;
    limits.most_variance << 4, 2;
    limits.most_correlation = 0.9;
    const auto kept = jml::keep_within(filter, limits);
    ASSERT_EQ(kept.status, Status::ok);
    const Matrix2 after = filter.P();
    const double s = std::sqrt(after(0, 0)) * std::sqrt(after(1, 1)), rho = after(0, 1) / s;
    for (int i = 0; i < 2; ++i) {
      EXPECT_GE(after(i, i), limits.least_variance(i) * (1 - 1e-14));
      EXPECT_LE(after(i, i), limits.most_variance(i) * (1 + 1e-14));
      const auto bit = static_cast<std::size_t>(i);
      EXPECT_EQ(kept.raised[bit], P(i, i) < limits.least_variance(i));
      EXPECT_EQ(kept.lowered[bit], P(i, i) > limits.most_variance(i));
      EXPECT_EQ(kept.decorrelated[bit], std::abs(r) > 0.9);
      if (!kept.raised[bit] && !kept.lowered[bit]) {
        EXPECT_NEAR(after(i, i), P(i, i), 1e-12 * P(i, i));
      }
    }
    EXPECT_LE(std::abs(rho), 0.9 * (1 + 1e-12));
    if (!kept.raised.any()) {
      EXPECT_NEAR(rho, std::abs(r) > 0.9 ? std::copysign(0.9, r) : r, 1e-12);
    }
    EXPECT_EQ(filter.x(), Vector2(3, -4));
    if (!kept.any()) {
      EXPECT_EQ(after, P);
    }
  }
}

TEST(Limits, RefuseWhatIsNone) {
  Filter filter = fresh();
  const Matrix2 P = filter.P();
  jml::Limits<2> limits;
  limits.least_variance << 2, 2;
  limits.most_variance << 1, 1;
  EXPECT_EQ(jml::keep_within(filter, limits).status, Status::invalid_option);
  limits = {};
  limits.most_correlation = 0;
  EXPECT_EQ(jml::keep_within(filter, limits).status, Status::invalid_option);
  limits = {};
  limits.lower << 1, std::nan("");
  EXPECT_EQ(jml::keep_within(filter, limits).status, Status::invalid_option);
  EXPECT_EQ(filter.P(), P);
  limits = {};
  limits.upper << 10, -1;  // the velocity is 0
  const auto kept = jml::keep_within(filter, limits);
  EXPECT_EQ(kept.status, Status::ok);
  EXPECT_FALSE(kept.outside[0]);
  EXPECT_TRUE(kept.outside[1]);
  EXPECT_EQ(filter.P(), P);
  EXPECT_EQ(filter.rescale(Vector2(-1, 1), Vector2(0, 0)), Status::invalid_option);
  EXPECT_EQ(filter.P(), P);
}

TEST(Health, NamesItsReasons) {
  Truth truth(3);
  Filter filter = fresh();
  jml::Channel good{Both{}}, bad{Both{}, jml::Lockout<>{.after = 3}};
  good.monitor.options = {.window = 10};
  bad.gate = {0.999};
  bad.monitor.options = {.window = 10, .repeats = 5};
  jml::Limits<2> limits;
  limits.upper << 1000, 100;
  for (int k = 0; k < 30; ++k) {
    ASSERT_EQ(good.step(filter, truth.next(), 1.0).status, Status::ok);
    ASSERT_EQ(bad.update(filter, Vector2(1e4, 0)).status, Status::ok);
  }
  jml::Health health = jml::check_health(filter, jml::keep_within(filter, limits), 10.0, good, bad);
  for (const Concern concern : {Concern::channel_shut, Concern::nis_high, Concern::stuck, Concern::biased})
    EXPECT_TRUE(health.has(concern)) << jml::describe(concern);
  for (const Concern concern :
       {Concern::not_started, Concern::state_outside, Concern::covariance_lost, Concern::covariance_changed,
        Concern::channel_inhibited, Concern::nothing_accepted})
    EXPECT_FALSE(health.has(concern)) << jml::describe(concern);
  EXPECT_TRUE(jml::check_health(filter, jml::keep_within(filter, limits), 10.0, good).good());
  good.use = jml::Use::inhibit;
  limits.upper << -1e9, 100;
  for (int k = 0; k < 12; ++k) ASSERT_EQ(good.step(filter, truth.next(), 1.0).status, Status::ok);
  health = jml::check_health(filter, jml::keep_within(filter, limits), 10.0, good, bad);
  for (const Concern concern :
       {Concern::channel_inhibited, Concern::nothing_accepted, Concern::state_outside})
    EXPECT_TRUE(health.has(concern)) << jml::describe(concern);
}

// A filter and its channel, stopped at any sample and restored into others: the same bits from there on.
TEST(Health, StopsAndGoesOn) {
  for (int stop = 1; stop < 60; ++stop) {
    Truth truth(7);
    Filter filter = fresh(), other = fresh();
    jml::Channel sensor{Both{}, jml::Lockout<>{.after = 3, .recovery = jml::Recovery::accept}},
        second = sensor;
    for (auto* channel : {&sensor, &second}) {
      channel->gate = {0.999};
      channel->monitor.options = {.window = 10, .repeats = 3};
    }
    jml::ImageOf<Filter, decltype(sensor)> image;
    for (int k = 0; k < 70; ++k) {
      const Vector2 y = truth.next() + (k / 7 % 3 == 2 ? Vector2(50, 0) : Vector2(0, 0));
      sensor.use = k % 13 == 0 ? jml::Use::inhibit : jml::Use::accept;
      if (k > stop) {
        second.use = sensor.use;
        ASSERT_EQ(second.step(other, y, 1.0).gate, sensor.step(filter, y, 1.0).gate);
      } else {
        ASSERT_EQ(sensor.step(filter, y, 1.0).status, Status::ok);
      }
      if (k == stop) {
        ASSERT_EQ(jml::save(image, filter, sensor), Status::ok);
        ASSERT_EQ(jml::restore(image, other, second), Status::ok);
      }
    }
    EXPECT_EQ(filter.x(), other.x());
    EXPECT_EQ(filter.P(), other.P());
    EXPECT_EQ(sensor.tally().accepted, second.tally().accepted);
    EXPECT_EQ(sensor.tally().rejected, second.tally().rejected);
    EXPECT_EQ(sensor.tally().recovered, second.tally().recovered);
    EXPECT_GT(sensor.tally().recovered, 0U);
    EXPECT_EQ(sensor.alarms().nis_high, second.alarms().nis_high);
    EXPECT_EQ(sensor.monitor.mean_nis(), second.monitor.mean_nis());
    EXPECT_EQ(sensor.since_accepted(filter.time()), second.since_accepted(other.time()));
  }
}

}  // namespace
