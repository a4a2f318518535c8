// SPDX-License-Identifier: BSD-3-Clause
// A fixed lag of attitudes: late measurements are worth what they are in order, at a node and between two; a
// refusal leaves the whole window as it was, bit by bit; a way out; single precision; the heap.
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "heap_trap.hpp"
#include "models/attitude_in_space.hpp"

namespace {

using jml::Status, jml::usable;
using State = jml::Vector<double, 4>;
using Vector3 = jml::Vector<double, 3>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using Turning = models::TurningIn<jml::SO3>;
using models::VectorSensor;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
const State attitude{0.5, 0.5, -0.5, 0.5};
const Vector3 rate{0.3, -0.2, 0.5};
Matrix3 covariance() { return (Matrix3() << 0.04, 0.01, 0, 0.01, 0.09, 0.02, 0, 0.02, 0.16).finished(); }

/// Its disturbance is a random walk: Q dt. Where it is told to, it leaves its space.
struct Walking : Turning {
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x, const auto& at) const {
    jml::Vector<T, 4> next = Turning::dynamics(x, at);
    for (int i = 0; i < 4; ++i) next(i) = next(i) * T(at.control(0) > 10 ? at.control(1) : 1.0);
    return next;
  }
  Matrix3 disturbance_covariance(const State&, const auto& at) const { return at.dt * Matrix3(Q); }
};
/// A vector for every instant, and what is seen of it then, in steps of 0.2 s.
VectorSensor sensor_at(double k) { return {Vector3(std::sin(k), std::cos(2 * k), 0.3).normalized(), 0.1}; }
Vector3 seen_at(double k) {
  State truth = jml::SO3::plus(attitude, Vector3(0.1, -0.2, 0.3));
  truth = jml::SO3::plus(truth, Vector3(k * 0.2 * rate));
  return sensor_at(k).measurement(truth) + 0.1 * Vector3(std::sin(7 * k), std::cos(5 * k), std::sin(k));
}
constexpr int window = 6;  // of every window here: each length more is compiled anew
template <typename D = Walking>
auto lag(const D& dynamics = {}) {
  jml::Filter filter{jml::FixedLag<window, 2>{}, dynamics, jml::sensors<VectorSensor>,
                     jml::Estimate{attitude, covariance()}};
  filter.method().options.sweeps = 30;
  filter.method().options.tolerance = 1e-12;
  return filter;
}
const Walking walking{{0.1 * Matrix3::Identity()}};

template <typename Filter>
void expect_near(const Filter& a, const Filter& b, double slack) {
  ASSERT_EQ(a.depth(), b.depth());
  for (int age = 0; age <= a.depth(); ++age) {
    EXPECT_LT(jml::SO3::minus(a.x(age), b.x(age)).norm(), slack) << age;
    EXPECT_LT((a.P(age) - b.P(age)).norm(), slack) << age;
    EXPECT_NEAR(a.time(age), b.time(age), 1e-14);
  }
}

TEST(FixedLagInSpace, ALateMeasurementIsWorthWhatItIsInOrder) {
  for (int late = 0; late <= 5; ++late) {
    auto in_order = lag(walking), out_of_order = lag(walking);
    for (int k = 1; k <= 5; ++k) {
      ASSERT_TRUE(usable(in_order.step(sensor_at(k), seen_at(k), 0.2, rate).status));
      if (k == late) {
        ASSERT_TRUE(usable(out_of_order.predict(0.2, rate)));
      } else {
        ASSERT_TRUE(usable(out_of_order.step(sensor_at(k), seen_at(k), 0.2, rate).status));
      }
      if (late == 0 && k == 1) {  // of node 0
        ASSERT_TRUE(usable(in_order.update(sensor_at(0), seen_at(0), jml::age(1)).status));
      }
    }
    ASSERT_TRUE(usable(out_of_order.update(sensor_at(late), seen_at(late), jml::age(5 - late)).status));
    expect_near(in_order, out_of_order, 1e-9);
    auto by_time = lag(walking);
    for (int k = 1; k <= 5; ++k) ASSERT_TRUE(usable(by_time.predict(0.2, rate)));
    for (const int k : {3, 5, 1, 4, 2}) {
      const double t = 0.2 * k;
      ASSERT_TRUE(usable(by_time.update(sensor_at(k), seen_at(k), jml::at_time(t)).status));
    }
    if (late == 0) {
      ASSERT_TRUE(usable(by_time.update(sensor_at(0), seen_at(0), jml::at_time(0)).status));
    }
    expect_near(in_order, by_time, 1e-9);
  }
}

// Steps of 0.2 s; what was measured halfway through some of them splits these in two.
TEST(FixedLagInSpace, BetweenTwoNodesAStateIsPutIn) {
  auto in_order = lag(walking), late = lag(walking);
  for (int k = 1; k <= 4; ++k) {
    const bool split = k == 2 || k == 4;
    if (split) {
      ASSERT_TRUE(usable(in_order.step(sensor_at(k - 0.5), seen_at(k - 0.5), 0.1, rate).status));
    }
    ASSERT_TRUE(usable(in_order.step(sensor_at(k), seen_at(k), split ? 0.1 : 0.2, rate).status));
    ASSERT_TRUE(usable(late.step(sensor_at(k), seen_at(k), 0.2, rate).status));
  }
  ASSERT_TRUE(usable(late.update(sensor_at(3.5), seen_at(3.5), jml::at_time(0.7)).status));
  ASSERT_TRUE(usable(late.update(sensor_at(1.5), seen_at(1.5), jml::at_time(0.3)).status));
  expect_near(in_order, late, 1e-9);
  for (int k = 5; k <= 12; ++k) {  // and as the window slides past them
    ASSERT_TRUE(usable(in_order.step(sensor_at(k), seen_at(k), 0.2, rate).status));
    ASSERT_TRUE(usable(late.step(sensor_at(k), seen_at(k), 0.2, rate).status));
  }
  expect_near(in_order, late, 1e-6);  // the arrival cost is a quadratic of its own chart
}
// Q is a covariance per step, and nothing says what half a step has of it.
TEST(FixedLagInSpace, AStepWithItsOwnNoiseIsNotSplit) {
  auto filter = lag(Turning{});
  for (int k = 1; k <= 3; ++k) ASSERT_TRUE(usable(filter.predict(0.2, rate)));
  EXPECT_EQ(filter.update(sensor_at(1.5), seen_at(1.5), jml::at_time(0.3)).status, Status::invalid_time_step);
  EXPECT_TRUE(usable(filter.update(sensor_at(2), seen_at(2), jml::at_time(0.4)).status));
}

/// Everything that a window shows.
template <typename Filter>
std::vector<double> numbers_of(const Filter& filter) {
  std::vector<double> out{filter.time()};
  for (int age = 0; age <= filter.depth(); ++age) {
    const State x = filter.x(age);
    const Matrix3 P = filter.P(age);
    out.insert(out.end(), x.data(), x.data() + 4);
    out.insert(out.end(), P.data(), P.data() + 9);
    out.push_back(filter.time(age));
  }
  return out;
}
TEST(FixedLagInSpace, RefusalsLeaveTheWindow) {
  auto filter = lag(walking);
  const auto refuse = [&](Status wanted, const auto& verb) {
    const auto before = numbers_of(filter);
    EXPECT_EQ(verb(), wanted) << jml::describe(wanted);
    const auto after = numbers_of(filter);
    ASSERT_EQ(before.size(), after.size());
    EXPECT_EQ(std::memcmp(before.data(), after.data(), before.size() * sizeof(double)), 0);
  };
  for (int k = 1; k <= 12; ++k) {
    const VectorSensor sensor = sensor_at(k);
    const Vector3 y = seen_at(k), bad{y(0), nan, y(2)};
    auto untroubled = filter;
    for (const double length : {2.0, 0.0, 1.1}) {
      refuse(Status::outside_space, [&] { return filter.predict(0.2, Vector3(11, length, 0)); });
      refuse(Status::outside_space,
             [&] { return filter.step(sensor, y, 0.2, Vector3(11, length, 0)).status; });
    }
    refuse(Status::invalid_measurement, [&] { return filter.step(sensor, bad, 0.2, rate).status; });
    refuse(Status::invalid_measurement, [&] { return filter.update(sensor, bad).status; });
    refuse(Status::invalid_measurement, [&] { return filter.update(sensor, bad, jml::age(k > 1)).status; });
    refuse(Status::older_than_window, [&] { return filter.update(sensor, y, jml::age(window + 1)).status; });
    refuse(Status::sensor_not_finite, [&] { return filter.update(VectorSensor{{1, nan, 0}, 1}, y).status; });
    refuse(Status::invalid_noise_covariance,
           [&] { return filter.step(VectorSensor{{1, 0, 0}, nan}, y, 0.2, rate).status; });
    // What follows knows nothing of them either.
    ASSERT_TRUE(usable(filter.step(sensor, y, 0.2, rate).status)) << k;
    ASSERT_TRUE(usable(untroubled.step(sensor, y, 0.2, rate).status)) << k;
    EXPECT_EQ(numbers_of(filter), numbers_of(untroubled));
  }
}

TEST(FixedLagInSpace, AGateKeepsThePrediction) {
  auto filter = lag(walking), predicted = filter;
  filter.gate = {0.99};
  ASSERT_TRUE(usable(predicted.predict(0.2, rate)));
  const Vector3 opposite = -sensor_at(1).measurement(predicted.x());
  const auto report = filter.step(sensor_at(1), opposite, 0.2, rate);
  EXPECT_EQ(report.gate, jml::Verdict::rejected);
  expect_near(filter, predicted, 1e-14);
}

// P of the smoothed end, and then of a filter that starts there.
TEST(FixedLagInSpace, AWayOutBeginsAnewAtThePresent) {
  auto filter = lag(walking);
  for (int k = 1; k <= 9; ++k) ASSERT_TRUE(usable(filter.step(sensor_at(k), seen_at(k), 0.2, rate).status));
  auto reset = filter;
  const State x = filter.x();
  Matrix3 P = filter.P();
  EXPECT_EQ(filter.inflate(Vector3(nan, 0, 0)), Status::invalid_option);
  EXPECT_EQ(filter.depth(), window);
  ASSERT_EQ(filter.inflate(Vector3(0.5, 0, 0.25)), Status::ok);
  P.diagonal() += Vector3(0.5, 0, 0.25);
  EXPECT_EQ(filter.depth(), 0);
  EXPECT_LT((filter.x() - x).norm(), 1e-15);
  EXPECT_LT((filter.P() - P).norm(), 1e-14);
  ASSERT_EQ(filter.reset_variance(1, 4), Status::ok);
  P.row(1).setZero();
  P.col(1).setZero();
  P(1, 1) = 4;
  EXPECT_LT((filter.P() - P).norm(), 1e-14);
  EXPECT_NEAR(filter.time(), 1.8, 1e-14);
  ASSERT_EQ(reset.reset(jml::Estimate{x, P}, filter.time()), Status::ok);
  ASSERT_TRUE(usable(filter.step(sensor_at(10), seen_at(10), 0.2, rate).status));
  ASSERT_TRUE(usable(reset.step(sensor_at(10), seen_at(10), 0.2, rate).status));
  expect_near(filter, reset, 1e-13);
}

/// The same in float.
struct WalkingInFloat {
  using Space = jml::SO3;
  static constexpr int disturbances = 3, controls = 3;
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x, const auto& at) const {
    return jml::SO3::plus(
        x, jml::Vector<T, 3>(T(at.control(0) * at.dt), T(at.control(1) * at.dt), T(at.control(2) * at.dt)));
  }
  jml::Matrix<float, 3, 3> disturbance_covariance(const auto&, const auto& at) const {
    return 0.1F * at.dt * jml::Matrix<float, 3, 3>::Identity();
  }
};
struct SensorInFloat {
  static constexpr int measurements = 3;
  jml::Vector<float, 3> direction;
  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 4>& x) const {
    return jml::rotate_back(x, jml::detail::cast_to<T>(direction));
  }
  jml::Matrix<float, 3, 3> noise_covariance() const { return 0.01F * jml::Matrix<float, 3, 3>::Identity(); }
};
TEST(FixedLagInSpace, InFloatItIsTheSame) {
  const jml::Estimate<float, 4, 3> start{attitude.cast<float>(), covariance().cast<float>()};
  jml::Filter single{jml::FixedLag<window>{}, WalkingInFloat{}, jml::sensors<SensorInFloat>, start};
  single.method().options.sweeps = 30;
  jml::Filter single_ekf{jml::Ekf{}, WalkingInFloat{}, start};
  jml::Filter ekf{jml::Ekf{}, walking, jml::Estimate{attitude, covariance()}};
  auto twice = lag(walking);
  for (int k = 1; k <= 40; ++k) {
    const Vector3 y = seen_at(k);
    const SensorInFloat sensor{sensor_at(k).direction.cast<float>()};
    const jml::Vector<float, 3> y_single = y.cast<float>(), rate_single = rate.cast<float>();
    ASSERT_TRUE(usable(twice.step(sensor_at(k), y, 0.2, rate).status));
    ASSERT_TRUE(usable(ekf.step(sensor_at(k), y, 0.2, rate).status));
    ASSERT_TRUE(usable(single_ekf.step(sensor, y_single, 0.2F, rate_single).status));
    const auto report = single.step(sensor, y_single, 0.2F, rate_single);
    ASSERT_TRUE(usable(report.status)) << report.status;
    EXPECT_LT(jml::SO3::minus(State(single.x().cast<double>()), twice.x()).norm(), 2e-5) << k;
    EXPECT_LT((single.P().cast<double>() - twice.P()).norm(), 1e-6) << k;
    EXPECT_LT((single_ekf.x().cast<double>() - ekf.x()).norm(), 1e-5) << k;
    EXPECT_LT((single_ekf.P().cast<double>() - ekf.P()).norm(), 1e-6) << k;
  }
}

TEST(FixedLagInSpace, NoHeapAndCopiesAreIndependent) {
  int done = 0;
  {
    heap_trap::Armed trap;
    auto filter = lag(walking);
    for (int k = 1; k <= 8; ++k) {
      done += usable(filter.step(sensor_at(k), seen_at(k), 0.2, rate).status);
      done += usable(filter.update(sensor_at(k), seen_at(k), jml::age(1)).status);
      done += jml::all_finite(filter.P(filter.depth()));
      done += filter.update(sensor_at(k), Vector3(0, nan, 0)).status == Status::invalid_measurement;
    }
    auto copy = filter;
    const State x = filter.x();
    done += usable(copy.step(sensor_at(9), seen_at(9), 0.2, rate).status);
    done += filter.x() == x;
    done += usable(filter.step(sensor_at(9), seen_at(9), 0.2, rate).status);
    done += filter.x() == copy.x() && filter.P(2) == copy.P(2);
    done += usable(filter.inflate(Vector3(1, 1, 1)));
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  EXPECT_EQ(done, 37);
}

}  // namespace
