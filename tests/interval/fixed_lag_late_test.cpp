// SPDX-License-Identifier: BSD-3-Clause
// A measurement that arrives late takes its place in the window: on a linear system the estimate is exactly
// that of having had it in time, on a nonlinear one that of the same minimum.
#include <gtest/gtest.h>

#include <cstring>
#include <jml/interval/batch.hpp>
#include <jml/filter/filter.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <vector>

#include "models/linear.hpp"
#include "models/pendulum.hpp"
#include "models/van_der_pol.hpp"

namespace {

using namespace jml::operators;

using jml::Status, jml::usable;

/// Everything that a FixedLag shows, bit by bit.
template <typename Filter>
std::vector<double> snapshot(const Filter& filter) {
  std::vector<double> out{static_cast<double>(filter.depth())};
  for (int age = 0; age <= filter.depth(); ++age) {
    const auto P = filter.P(age);
    out.insert(out.end(), filter.x(age).data(), filter.x(age).data() + filter.x(age).size());
    out.insert(out.end(), P.data(), P.data() + P.size());
    out.push_back(filter.time(age));
  }
  return out;
}
bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

/// The largest difference of any state and any covariance of two windows.
template <typename Filter>
double distance(const Filter& a, const Filter& b) {
  EXPECT_EQ(a.depth(), b.depth());
  double worst = 0;
  for (int age = 0; age <= a.depth(); ++age) {
    worst = std::max(worst, (a.x(age) - b.x(age)).cwiseAbs().maxCoeff());
    worst = std::max(worst, (a.P(age) - b.P(age)).cwiseAbs().maxCoeff());
  }
  return worst;
}

// A linear system with two sensors, whose measurements arrive up to L steps late and out of order.

using Dynamics = models::LinearDynamics<3, 1>;
using First = models::LinearSensor<3, 1>;
using Second = models::LinearSensor<3, 2>;

struct Plant {
  Dynamics dynamics;
  First first;
  Second second;
  jml::Estimate<double, 3> start;

  explicit Plant(jml::Noise& noise)
      : dynamics(models::random_linear_dynamics<3, 1>(noise)),
        first(models::random_linear_sensor<3, 1>(noise)),
        second(models::random_linear_sensor<3, 2>(noise)),
        start{{1, -0.5, 0.3}, models::random_covariance<3>(noise, 0.2)} {}

  template <int L>
  auto window() const {
    return jml::Filter{jml::FixedLag<L>{}, dynamics, jml::sensors<First, Second>, start};
  }
};

/// One measurement of either sensor.
struct Sample {
  int taken = 0, arrives = 0;
  bool second = false;
  jml::Vector<double, 2> y{0, 0};  // the first entry alone for First
};

/// Any filter with update(): what was taken at `node` and is here by `now`, in the order of the list.
template <typename Filter>
void measure(Filter& filter, const Plant& plant, const std::vector<Sample>& samples, int node, int now) {
  for (const Sample& sample : samples) {
    if (sample.taken != node || sample.arrives > now) continue;
    EXPECT_TRUE(usable(sample.second ? filter.update(plant.second, sample.y).status
                                     : filter.update(plant.first, sample.y(0)).status));
  }
}

/// Plays `samples` late into a window of L steps; after each arrival everything that is here by then is also
/// given in time, to a Kalman filter and to another window, both from the start.
template <int L>
void play_late(const Plant& plant, const std::vector<Sample>& samples, int steps) {
  auto late = plant.window<L>();
  int arrived_late = 0, at_the_oldest_of_a_full_window = 0;
  double worst_x = 0, worst_P = 0, worst_age = 0;
  for (int now = 0; now <= steps; ++now) {
    if (now > 0) {
      ASSERT_EQ(late.predict(), Status::ok);
    }
    for (const Sample& sample : samples) {
      if (sample.arrives != now) continue;
      const int age = now - sample.taken;
      arrived_late += age > 0;
      at_the_oldest_of_a_full_window += age == L;
      ASSERT_TRUE(usable(sample.second ? late.update(plant.second, sample.y, jml::age(age)).status
                                       : late.update(plant.first, sample.y(0), jml::age(age)).status));
    }
    jml::Filter kalman{jml::Kalman{}, plant.dynamics, plant.start};
    auto in_time = plant.window<L>();
    for (int node = 0; node <= now; ++node) {
      if (node > 0) {
        ASSERT_EQ(kalman.predict(), Status::ok);
        ASSERT_EQ(in_time.predict(), Status::ok);
      }
      measure(kalman, plant, samples, node, now);
      measure(in_time, plant, samples, node, now);
    }
    worst_x = std::max(worst_x, (late.x() - kalman.x()).cwiseAbs().maxCoeff());
    worst_P = std::max(worst_P, (late.P() - kalman.P()).cwiseAbs().maxCoeff());
    worst_age = std::max(worst_age, distance(late, in_time));
  }
  EXPECT_LT(worst_x, 1e-12);  // x and P are of the size of 1
  EXPECT_LT(worst_P, 1e-12);
  EXPECT_LT(worst_age, 1e-12);
  EXPECT_GT(arrived_late, steps / 2);
  EXPECT_GT(at_the_oldest_of_a_full_window, 0);
}

Sample random_sample(jml::Noise& noise, int taken, int delay, bool second) {
  return {taken, taken + delay, second, noise.normal_vector<2>()};
}

// Every measurement of the first sensor comes the same number of steps late, 1 … L; the second in time, or as
// late as can be: at the oldest node of a full window, which the slide of that step has just made the oldest.
TEST(FixedLagLate, FixedDelayIsNoDelay) {
  constexpr int L = 4;
  jml::Noise noise(21);
  const Plant plant(noise);
  for (int delay = 1; delay <= L; ++delay) {
    SCOPED_TRACE(delay);
    std::vector<Sample> samples;
    for (int node = 0; node <= 20; ++node) {
      samples.push_back(random_sample(noise, node, delay, false));
      if (node % 3 == 0) samples.push_back(random_sample(noise, node, 0, true));
      if (node % 3 == 1) samples.push_back(random_sample(noise, node, L, true));
    }
    play_late<L>(plant, samples, 25);
  }
}

TEST(FixedLagLate, OutOfOrder) {
  constexpr int L = 4;
  jml::Noise noise(22);
  const Plant plant(noise);
  std::vector<Sample> samples;
  for (int node = 0; node <= 40; ++node) {
    for (const bool second : {false, true}) {
      const int delay = static_cast<int>(noise.uniform(0, L + 1));
      if (noise.uniform() < 0.8) samples.push_back(random_sample(noise, node, delay, second));
    }
  }
  // Those that arrive together come in a random order.
  for (std::size_t i = samples.size(); i > 1; --i)
    std::swap(samples[i - 1], samples[static_cast<std::size_t>(noise.uniform(0, static_cast<double>(i)))]);
  play_late<L>(plant, samples, 45);
}

// With one node and the next: the shortest window.
TEST(FixedLagLate, ShortestWindow) {
  jml::Noise noise(23);
  const Plant plant(noise);
  std::vector<Sample> samples;
  for (int node = 0; node <= 20; ++node) {
    samples.push_back(random_sample(noise, node, node % 2, false));
    samples.push_back(random_sample(noise, node, (node / 2) % 2, true));
  }
  play_late<1>(plant, samples, 22);
}

// On a nonlinear system the order matters only to where the sweeps begin: with enough of them, and as long as
// no slide has come between, the answer is the same minimum.
TEST(FixedLagLate, SameMinimumOnANonlinearSystem) {
  constexpr int L = 10;
  const models::VanDerPol dynamics{.c = 0.5};
  const models::SaturatingPosition first{.r = 2e-3};
  const models::AngleSensor second{.r = 5e-2};
  const jml::Estimate<double, 2> start{{1.5, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};
  jml::Filter in_time{jml::FixedLag<L>{}, dynamics, jml::sensors<models::SaturatingPosition, models::AngleSensor>,
                        start};
  in_time.method().options.sweeps = 100;
  in_time.method().options.tolerance = 0;
  jml::Noise noise(24);
  jml::Vector<double, 2> truth{1, 1};
  std::vector<double> y, z;
  for (int k = 0; k <= 3 * L; ++k) {
    if (k > 0) truth = dynamics.dynamics(truth) + dynamics.disturbance_input() * (4.47 * noise.normal());
    const double a = noise.normal(), b = noise.normal();
    y.push_back(first.measurement(truth)(0) + std::sqrt(first.r) * a);
    z.push_back(truth(0) + std::sqrt(second.r) * b);
  }
  auto at = [](const std::vector<double>& v, int k) { return v[static_cast<std::size_t>(k)]; };

  // One of each sensor is kept back at node `missing` and comes when the window has just become full.
  for (int missing = 0; missing <= L; ++missing) {
    SCOPED_TRACE(missing);
    auto prompt = in_time, late = in_time;
    for (int k = 0; k <= L; ++k) {
      if (k > 0) {
        ASSERT_EQ(prompt.predict(), Status::ok);
        ASSERT_EQ(late.predict(), Status::ok);
      }
      ASSERT_TRUE(usable(prompt.update(first, at(y, k)).status));
      ASSERT_TRUE(usable(prompt.update(second, at(z, k)).status));
      if (k == missing) continue;
      ASSERT_TRUE(usable(late.update(first, at(y, k)).status));
      ASSERT_TRUE(usable(late.update(second, at(z, k)).status));
    }
    ASSERT_EQ(late.depth(), L);
    EXPECT_GT(distance(prompt, late), 1e-4);  // it matters
    ASSERT_TRUE(usable(late.update(second, at(z, missing), jml::age(L - missing)).status));
    ASSERT_TRUE(usable(late.update(first, at(y, missing), jml::age(L - missing)).status));
    EXPECT_LT(distance(prompt, late), 1e-8);
    // … and ever after: the windows slide, and their arrival costs agree.
    for (int k = L + 1; k <= 3 * L; ++k) {
      ASSERT_TRUE(usable(prompt.step(first, at(y, k)).status));
      ASSERT_TRUE(usable(late.step(first, at(y, k)).status));
      EXPECT_LT(distance(prompt, late), 1e-8);
    }
  }
}

// State-dependent G, Q, w̄ and R are frozen where a step was predicted or a measurement given. The oracle: the
// batch answer of a model that has these very numbers in a table over time.

constexpr int flight = 20;  // steps of 1 s, in a window as long

struct Motion {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return models::VanDerPol{.c = 0.5}.dynamics(x);
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x) const {
    return models::VanDerPol{.c = 0.5}.dynamics_jacobian(x);
  }
};
struct VaryingMotion : Motion {
  jml::Matrix<double, 2, 1> disturbance_input(const jml::Vector<double, 2>& x) const {
    return {0.01, 0.05 * (1 + 0.3 * std::sin(x(1)))};
  }
  jml::Matrix<double, 1, 1> disturbance_covariance(const jml::Vector<double, 2>& x) const {
    return jml::Matrix<double, 1, 1>(20 + 10 * x(0) * x(0));
  }
  jml::Vector<double, 1> disturbance_mean(const jml::Vector<double, 2>& x) const {
    return jml::Vector<double, 1>(2 * std::cos(x(0)));
  }
};
struct TabledMotion : Motion {
  jml::Vector<double, 2> frozen_at[flight + 1];  // by the number of the step
  [[nodiscard]] const jml::Vector<double, 2>& point(const auto& at) const {
    return frozen_at[static_cast<int>(at.time + 1.5)];
  }
  auto disturbance_input(const jml::Vector<double, 2>&, const auto& at) const {
    return VaryingMotion{}.disturbance_input(point(at));
  }
  auto disturbance_covariance(const jml::Vector<double, 2>&, const auto& at) const {
    return VaryingMotion{}.disturbance_covariance(point(at));
  }
  auto disturbance_mean(const jml::Vector<double, 2>&, const auto& at) const {
    return VaryingMotion{}.disturbance_mean(point(at));
  }
};
struct Position {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return models::SaturatingPosition{}.measurement(x);
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>& x) const {
    return models::SaturatingPosition{}.measurement_jacobian(x);
  }
};
struct VaryingPosition : Position {
  jml::Matrix<double, 1, 1> noise_covariance(const jml::Vector<double, 2>& x) const {
    return jml::Matrix<double, 1, 1>(5e-3 * (1 + 0.5 * x(0) * x(0)));
  }
};
struct FixedPosition : Position {
  double r = 1;
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};

TEST(FixedLagLate, NoiseIsFrozenWhereItWasFirstAsked) {
  const jml::Estimate<double, 2> start{{1.5, 0.5}, 0.3 * jml::Matrix<double, 2, 2>::Identity()};
  jml::Filter filter{jml::FixedLag<flight>{}, VaryingMotion{}, jml::sensors<VaryingPosition>, start};
  filter.method().options.sweeps = 100;
  filter.method().options.tolerance = 0;
  TabledMotion motion;
  std::vector<double> r(flight + 1), y(flight + 1);
  jml::Noise noise(27);
  for (std::size_t k = 1; k <= flight; ++k) {
    motion.frozen_at[k] = filter.x();
    y[k] = 0.6 * std::sin(0.3 * static_cast<double>(k)) + 0.1 * noise.normal();
    ASSERT_EQ(filter.predict(), Status::ok);
    const int age = k % 4 == 0 ? 2 : 0;  // the others come two steps late
    if (k % 4 == 2) continue;
    const std::size_t node = k - static_cast<std::size_t>(age);
    r[k] = VaryingPosition{}.noise_covariance(filter.x())(0);
    if (age > 0) {
      ASSERT_TRUE(usable(filter.update(VaryingPosition{}, y[k]).status));
      r[node] = VaryingPosition{}.noise_covariance(filter.x(age))(0);
      ASSERT_TRUE(usable(filter.update(VaryingPosition{}, y[node], jml::age(age)).status));
    } else {
      ASSERT_TRUE(usable(filter.update(VaryingPosition{}, y[k]).status));
    }
  }
  jml::Batch batch{motion, jml::sensors<FixedPosition>, start, {flight}};
  for (std::size_t k = 1; k <= flight; ++k) {
    FixedPosition sensor;
    sensor.r = r[k];
    ASSERT_EQ(batch.step(sensor, y[k], 1.0), Status::ok);
  }
  ASSERT_TRUE(usable(batch.solve().status));
  for (int k = 0; k <= flight; ++k) {
    EXPECT_LT((filter.x(flight - k) - batch.x(k)).norm(), 1e-8) << k;
    EXPECT_LT((filter.P(flight - k) - batch.P(k)).norm(), 1e-8) << k;
  }
}

// What has no place is refused, and not a bit changes.
TEST(FixedLagLate, OlderThanTheWindow) {
  constexpr int L = 4;
  jml::Noise noise(25);
  const Plant plant(noise);
  auto filter = plant.window<L>();
  const auto refuse = [&](int age, Status wanted) {
    const auto before = snapshot(filter);
    EXPECT_EQ(filter.update(plant.first, 0.7, jml::age(age)).status, wanted);
    EXPECT_EQ(filter.update(plant.second, jml::Vector<double, 2>(0.7, -2), jml::age(age)).status, wanted);
    EXPECT_TRUE(same_bits(before, snapshot(filter)));
  };
  for (int k = 0; k <= 3 * L; ++k) {
    if (k > 0) {
      ASSERT_TRUE(usable(filter.step(plant.first, noise.normal()).status));
    }
    ASSERT_EQ(filter.depth(), std::min(k, L));
    refuse(filter.depth() + 1, Status::older_than_window);
    refuse(filter.depth() + 100, Status::older_than_window);
    refuse(std::numeric_limits<int>::max(), Status::older_than_window);
    refuse(-1, Status::invalid_option);
    refuse(std::numeric_limits<int>::min(), Status::invalid_option);
  }
}

TEST(FixedLagLate, MemoryFull) {
  jml::Noise noise(26);
  const Plant plant(noise);
  jml::Filter filter{jml::FixedLag<3, 2>{}, plant.dynamics, jml::sensors<First, Second>, plant.start};
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(usable(filter.step(plant.first, noise.normal()).status));
  for (int age = 0; age < 3; ++age) {
    SCOPED_TRACE(age);
    ASSERT_TRUE(usable(filter.update(plant.first, 0.3, jml::age(age)).status));  // the second of two
    const auto before = snapshot(filter);
    EXPECT_EQ(filter.update(plant.first, 0.5, jml::age(age)).status, Status::memory_full);
    if (age == 0) {
      EXPECT_EQ(filter.update(plant.first, 0.5).status, Status::memory_full);
    }
    EXPECT_TRUE(same_bits(before, snapshot(filter)));
    ASSERT_TRUE(usable(filter.update(plant.second, {0.1, 0.2}, jml::age(age)).status));  // of its own type there is room
  }
}

}  // namespace
