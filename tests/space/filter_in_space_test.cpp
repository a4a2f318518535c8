// SPDX-License-Identifier: BSD-3-Clause
// Filters of a state in a space, apart from their answers: refusals leave the belief as it was, bit by bit;
// the gate, masks, copies, a way out, single precision, the heap; a rotation of another library is one of
// ours.
#include <gtest/gtest.h>

#include <cstring>

#include "heap_trap.hpp"
#include "models/attitude_in_space.hpp"
#include "models/foreign_rotation.hpp"

namespace {

using jml::Status, jml::usable;
using models::VectorSensor;
using State = jml::Vector<double, 4>;
using Vector3 = jml::Vector<double, 3>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using Turning = models::TurningIn<jml::SO3>;
constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();

const State attitude{0.5, 0.5, -0.5, 0.5};
Matrix3 covariance() { return (Matrix3() << 0.04, 0.01, 0, 0.01, 0.09, 0.02, 0, 0.02, 0.16).finished(); }
const Vector3 rate{0.3, -0.2, 0.5};

/// y of the k-th step, of no attitude in particular.
Vector3 vector_seen(int k) {
  return Vector3(std::sin(0.2 * k), std::cos(0.3 * k) + 0.5, 0.4 * std::sin(k)).normalized();
}

/// Where a step is told to, it leads to no attitude.
struct Leaving : Turning {
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x, const auto& at) const {
    jml::Vector<T, 4> next = Turning::dynamics(x, at);
    for (int i = 0; i < 4; ++i)
      next(i) = next(i) * T(at.control(0) > 20 ? infinity : at.control(0) > 10 ? at.control(1) : 1.0);
    return next;
  }
};

template <typename Filter>
struct Snapshot {
  State x;
  Matrix3 P;
  double time;
  explicit Snapshot(const Filter& filter) : x(filter.x()), P(filter.P()), time(filter.time()) {}
  void expect_same(const Filter& filter) const {
    const State now = filter.x();
    const Matrix3 P_now = filter.P();
    EXPECT_EQ(std::memcmp(x.data(), now.data(), sizeof x), 0);
    EXPECT_EQ(std::memcmp(P.data(), P_now.data(), sizeof P), 0);
    EXPECT_EQ(time, filter.time());
  }
};

template <typename Method>
void expect_refusals(const Method& method) {
  const jml::Estimate<double, 4, 3> start{attitude, covariance()};
  jml::Filter filter{method, Leaving{}, start};
  const auto refuse = [&](Status wanted, const auto& verb) {
    const Snapshot before(filter);
    EXPECT_EQ(verb(), wanted) << jml::describe(wanted);
    before.expect_same(filter);
  };
  const VectorSensor sensor{{1, 0, 0}, 0.3};
  for (int k = 0; k < 3; ++k) {
    const auto report = filter.step(sensor, vector_seen(k), 0.1, rate);
    ASSERT_TRUE(usable(report.status)) << report.status;
    for (const double length : {2.0, std::sqrt(3.0), 0.0, -2.0, 1.1, 0.5, 1 + 1e-3}) {
      const Vector3 leave{11, length, 0};
      refuse(Status::outside_space, [&] { return filter.predict(0.1, leave); });
      refuse(Status::outside_space, [&] { return filter.step(sensor, vector_seen(k), 0.1, leave).status; });
    }
    refuse(Status::dynamics_not_finite, [&] { return filter.predict(0.1, Vector3(21, 0, 0)); });
    refuse(Status::invalid_measurement, [&] { return filter.update(sensor, Vector3(0, nan, 0)).status; });
    refuse(Status::invalid_measurement,
           [&] { return filter.step(sensor, Vector3(0, nan, 0), 0.1, rate).status; });
    refuse(Status::invalid_noise_covariance,
           [&] { return filter.update(VectorSensor{{1, 0, 0}, nan}, vector_seen(k)).status; });
    refuse(Status::sensor_not_finite,
           [&] { return filter.update(VectorSensor{{1, nan, 0}, 1}, vector_seen(k)).status; });
    refuse(Status::invalid_time_step, [&] { return filter.predict(-0.1, rate); });
    refuse(Status::invalid_control, [&] { return filter.predict(0.1, Vector3(nan, 0, 0)); });
  }
  // What rounding left beside the space is brought back.
  ASSERT_TRUE(usable(filter.predict(0.1, Vector3(11, 1 + 1e-9, 0))));
  EXPECT_NEAR(filter.x().norm(), 1, 4e-16);
}
TEST(FilterInSpace, RefusalsLeaveTheBelief) {
  expect_refusals(jml::Ekf{});
  expect_refusals(jml::Iterated<jml::Ekf<>>{});
  expect_refusals(jml::Factored{jml::Ekf{}});
}

TEST(FilterInSpace, StartsInItsSpaceAlone) {
  for (const State& x : {State(1.1, 0, 0, 0), State(0, 0, 0, 0), State(0, nan, 0, 1), State(1, 0.03, 0, 0)}) {
    jml::Filter filter{jml::Ekf{}, Turning{}, jml::Estimate{x, covariance()}};
    EXPECT_EQ(filter.status(), Status::invalid_state);
    EXPECT_EQ(filter.predict(0.1, rate), Status::invalid_state);
    EXPECT_EQ(filter.update(VectorSensor{}, vector_seen(0)).status, Status::invalid_state);
    EXPECT_EQ(filter.inflate(Vector3(1, 1, 1)), Status::invalid_state);
    EXPECT_EQ(filter.reset(jml::Estimate{attitude, covariance()}, 2), Status::ok);
    EXPECT_EQ(filter.predict(0.1, rate), Status::ok);
    EXPECT_EQ(filter.time(), 2.1);
  }
  // One that was rounded to the digits of float is a start, of length 1.
  const State rounded = attitude.cast<float>().cast<double>();
  EXPECT_NEAR((jml::Filter{jml::Ekf{}, Turning{}, jml::Estimate{rounded, covariance()}}.x().norm()), 1,
              4e-16);
  const Matrix3 indefinite = Vector3(1, -1, 1).asDiagonal();
  jml::Filter filter{jml::Ekf{}, Turning{}, jml::Estimate{attitude, indefinite}};
  EXPECT_EQ(filter.status(), Status::invalid_covariance);
}

TEST(FilterInSpace, AGateKeepsThePrediction) {
  jml::Filter filter{jml::Ekf{}, Turning{}, jml::Estimate{attitude, covariance()}};
  jml::Filter predicted = filter;
  jml::Filter exact{jml::Iterated<jml::Ekf<>>{}, Turning{}, jml::Estimate{attitude, covariance()}};
  ASSERT_EQ(predicted.predict(0.1, rate), Status::ok);
  filter.gate = exact.gate = {0.99};
  const Vector3 opposite = -VectorSensor{}.measurement(predicted.x());
  const auto report = filter.step(VectorSensor{}, opposite, 0.1, rate);
  EXPECT_EQ(report.status, Status::ok);
  EXPECT_EQ(report.gate, jml::Verdict::rejected);
  EXPECT_LT((filter.x() - predicted.x()).norm(), 1e-15);
  EXPECT_LT((filter.P() - predicted.P()).norm(), 1e-15);
  EXPECT_EQ(exact.step(VectorSensor{}, opposite, 0.1, rate).gate, jml::Verdict::rejected);
  EXPECT_LT((exact.x() - predicted.x()).norm(), 1e-15);
  EXPECT_LT((exact.P() - predicted.P()).norm(), 1e-15);
  EXPECT_EQ(filter.update(VectorSensor{}, opposite).gate, jml::Verdict::rejected);
  EXPECT_LT((filter.P() - predicted.P()).norm(), 1e-15);
}

/// Rows 0 and 2 of a vector alone.
struct TwoRows {
  static constexpr int measurements = 2;
  VectorSensor whole;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 4>& x) const {
    const jml::Vector<T, 3> y = whole.measurement(x);
    return {y(0), y(2)};
  }
  jml::Matrix<double, 2, 2> noise_covariance() const {
    return whole.sigma * whole.sigma * jml::Matrix<double, 2, 2>::Identity();
  }
};
template <typename Method>
void expect_masks(const Method& method) {
  jml::Filter masked{method, Turning{}, jml::Estimate{attitude, covariance()}};
  jml::Filter two = masked;
  for (int k = 0; k < 10; ++k) {
    const Vector3 y = vector_seen(k), gap{y(0), nan, y(2)};
    ASSERT_TRUE(usable(masked.predict(0.1, rate)) && usable(two.predict(0.1, rate)));
    const auto report = masked.update(VectorSensor{{0, 1, 0}, 0.3}, gap, jml::only(0, 2));
    ASSERT_TRUE(usable(report.status)) << report.status;
    EXPECT_EQ(report.degrees, 2);
    ASSERT_TRUE(usable(two.update(TwoRows{{{0, 1, 0}, 0.3}}, jml::Vector<double, 2>(y(0), y(2))).status));
    EXPECT_LT((masked.x() - two.x()).norm(), 1e-13);
    EXPECT_LT((masked.P() - two.P()).norm(), 1e-13);
  }
}
TEST(FilterInSpace, MaskedRowsAreNotThere) {
  expect_masks(jml::Ekf{});
  expect_masks(jml::Iterated<jml::Ekf<>>{});
}

template <typename Method>
void expect_way_out(const Method& method) {
  jml::Filter filter{method, Turning{}, jml::Estimate{attitude, covariance()}};
  EXPECT_EQ(filter.inflate(Vector3(-1, 0, 0)), Status::invalid_option);
  EXPECT_EQ(filter.reset_variance(3, 1), Status::invalid_option);
  EXPECT_EQ(filter.reset_variance(0, -1), Status::invalid_option);
  EXPECT_LT((filter.P() - covariance()).norm(), 1e-15);
  EXPECT_EQ(filter.inflate(Vector3(0.5, 0, 0.25)), Status::ok);
  Matrix3 expected = covariance();
  expected(0, 0) += 0.5;
  expected(2, 2) += 0.25;
  EXPECT_LT((filter.P() - expected).norm(), 1e-15);
  EXPECT_EQ(filter.reset_variance(1, 4), Status::ok);
  expected.row(1).setZero();
  expected.col(1).setZero();
  expected(1, 1) = 4;
  EXPECT_LT((filter.P() - expected).norm(), 1e-15);
  EXPECT_EQ(filter.x(), attitude);
  EXPECT_EQ(filter.step(VectorSensor{}, vector_seen(0), 0.1, rate).status, Status::ok);
}
TEST(FilterInSpace, AWayOutKeepsTheState) {
  expect_way_out(jml::Ekf{});
  expect_way_out(jml::Jml<jml::AboutEstimate>{});
  expect_way_out(jml::Factored{jml::Ekf{}});
}

/// A push that is known in part: additive, and the same as an argument.
struct Pushed : Turning {
  Matrix3 disturbance_input(const State& x) const {
    return (Matrix3() << 1, x(0), 0, 0, 2, x(3), -1, 0, 1).finished();
  }
  Vector3 disturbance_mean() const { return {0.3, -0.4, 0.2}; }
};
struct PushedByArgument {
  using Space = jml::SO3;
  static constexpr int disturbances = 3, controls = 3;
  Pushed push;
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x, const jml::Vector<T, 3>& w, const auto& at) const {
    const Matrix3 G = push.disturbance_input(jml::detail::plain_values(x));
    jml::Vector<T, 3> moved;
    for (int i = 0; i < 3; ++i) moved(i) = G(i, 0) * w(0) + G(i, 1) * w(1) + G(i, 2) * w(2);
    return jml::SO3::plus(push.dynamics(x, at), moved);
  }
  Vector3 disturbance_mean() const { return push.disturbance_mean(); }
  Matrix3 disturbance_covariance() const { return push.disturbance_covariance(); }
};
TEST(FilterInSpace, AdditiveNoiseIsNoiseAsAnArgument) {
  const Pushed push{{0.04 * Matrix3::Identity()}};
  jml::Filter added{jml::Ekf{}, push, jml::Estimate{attitude, covariance()}};
  jml::Filter argument{jml::Ekf{}, PushedByArgument{push}, jml::Estimate{attitude, covariance()}};
  jml::Filter predicted = added;
  ASSERT_EQ(predicted.predict(0.1, rate), Status::ok);
  const State known = jml::SO3::plus(Turning{}.dynamics(attitude, jml::StepContext<double, 3>{0, 0.1, rate}),
                                     Vector3(push.disturbance_input(attitude) * push.disturbance_mean()));
  EXPECT_LT((predicted.x() - known).norm(), 1e-15);
  for (int k = 0; k < 20; ++k) {
    ASSERT_EQ(added.step(VectorSensor{}, vector_seen(k), 0.1, rate).status, Status::ok);
    ASSERT_EQ(argument.step(VectorSensor{}, vector_seen(k), 0.1, rate).status, Status::ok);
    EXPECT_LT((added.x() - argument.x()).norm(), 1e-12);  // rounding: the same sums in another order
    EXPECT_LT((added.P() - argument.P()).norm(), 1e-13);
  }
}

/// The vector as seen from a foreign rotation.
struct ForeignSensor : VectorSensor {
  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 4>& x) const {
    return VectorSensor::measurement(models::as_ours(x));
  }
};
template <typename Method>
void expect_foreign(const Method& method) {
  jml::Filter ours{method, Turning{}, jml::Estimate{attitude, covariance()}};
  jml::Filter theirs{method, models::TurningIn<foreign::Rotations>{},
                     jml::Estimate{models::as_foreign(attitude), covariance()}};
  for (int k = 0; k < 40; ++k) {
    const VectorSensor sensor{vector_seen(3 * k), 0.2};
    ASSERT_TRUE(usable(ours.step(sensor, vector_seen(k), 0.1, rate).status));
    ASSERT_TRUE(usable(theirs.step(ForeignSensor{sensor}, vector_seen(k), 0.1, rate).status));
    EXPECT_LT((models::as_ours(theirs.x()) - ours.x()).norm(), 2e-14);
    EXPECT_LT((theirs.P() - ours.P()).norm(), 1e-14);
  }
}
TEST(FilterInSpace, AForeignRotationIsOneOfOurs) {
  expect_foreign(jml::Ekf{});
  expect_foreign(jml::Iterated<jml::Ekf<>>{});
}

TEST(FilterInSpace, NoHeapAndCopiesAreIndependent) {
  int done = 0;
  {
    heap_trap::Armed trap;
    jml::Filter filter{jml::Ekf{}, Turning{}, jml::Estimate{attitude, covariance()}};
    jml::Filter exact{jml::Iterated<jml::Ekf<>>{}, Turning{}, jml::Estimate{attitude, covariance()}};
    const auto copy = filter;
    for (int k = 0; k < 5; ++k) {
      done += usable(filter.step(VectorSensor{}, vector_seen(k), 0.1, rate).status);
      done += usable(exact.step(VectorSensor{{1, 0, 0}, 0.3}, vector_seen(k), 0.1, rate).status);
      done += usable(filter.update(VectorSensor{}, vector_seen(k), jml::only(0, 2)).status);
      done += filter.update(VectorSensor{}, Vector3(0, nan, 0)).status == Status::invalid_measurement;
    }
    done += copy.x() == attitude && copy.P() == covariance();
    auto again = copy;
    done += usable(again.step(VectorSensor{}, vector_seen(0), 0.1, rate).status);
    jml::Filter anew{jml::Ekf{}, Turning{}, jml::Estimate{attitude, covariance()}};
    (void)anew.step(VectorSensor{}, vector_seen(0), 0.1, rate);
    done += again.x() == anew.x() && again.P() == anew.P();
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  EXPECT_EQ(done, 23);
}

}  // namespace
