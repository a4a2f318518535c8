// SPDX-License-Identifier: BSD-3-Clause
// A disturbance that is not white: the augmented model against the matrices written out by hand, eqs.
// (2.36)-(2.42) of the bounded-noise dissertation.
#include <gtest/gtest.h>

#include <jml/bounded/bounded_noise.hpp>
#include <jml/filter/filter.hpp>
#include <jml/bounded/coloured_input.hpp>

#include "models/bounded.hpp"

namespace {

using namespace jml::operators;

using jml::Box, jml::Filter, jml::ColouredInput, jml::Guaranteed, jml::Linearised, jml::Status;
using Vector1 = jml::Vector<double, 1>;
using Vector2 = jml::Vector<double, 2>;
using Vector4 = jml::Vector<double, 4>;

/// A plant of two states with two inputs, a filter of two states with one white disturbance, a sensor of the
/// plant; and the same by hand.
struct Pair {
  models::BoundedLinear<2, 2> plant{(jml::Matrix<double, 2, 2>() << 0.9, 0.2, -0.3, 0.8).finished(),
                                    (jml::Matrix<double, 2, 2>() << 0.1, -0.4, 0.5, 0.25).finished(),
                                    Vector2(77, 99)};  // its own bound is not read
  models::BoundedLinear<2, 1> shaping{
      (jml::Matrix<double, 2, 2>() << 0.7, -0.1, 0.2, 0.6).finished(), {0.3, -0.2}, Vector1(1.5)};
  models::BoundedLinearSensor<2, 2> sensor{(jml::Matrix<double, 2, 2>() << 1, 0, 0.5, -1).finished(),
                                           Vector2(0.2, 0.3)};
  ColouredInput<models::BoundedLinear<2, 2>, models::BoundedLinear<2, 1>> whole{plant, shaping};

  [[nodiscard]] models::BoundedLinear<4, 1> by_hand() const {
    jml::Matrix<double, 4, 4> F = jml::Matrix<double, 4, 4>::Zero();
    F << 0.9, 0.2, 0.1, -0.4, -0.3, 0.8, 0.5, 0.25, 0, 0, 0.7, -0.1, 0, 0, 0.2, 0.6;
    return {F, Vector4(0, 0, 0.3, -0.2), Vector1(1.5)};
  }
  [[nodiscard]] models::BoundedLinearSensor<4, 2> sensor_by_hand() const {
    return {(jml::Matrix<double, 2, 4>() << 1, 0, 0, 0, 0.5, -1, 0, 0).finished(), Vector2(0.2, 0.3)};
  }
};

TEST(ColouredInput, Sizes) {
  using Whole = decltype(Pair::whole);
  static_assert(jml::states_of<Whole> == 4 && Whole::disturbances == 1 && Whole::linear);
  static_assert(!jml::reads_context<double, Whole>());
  const Pair pair;
  const auto deduced = ColouredInput{pair.plant, pair.shaping};
  static_assert(std::is_same_v<decltype(deduced), const Whole>);
  const jml::StepContext<double> none;
  const Vector4 x(1, -2, 3, 0.5);
  const auto hand = pair.by_hand();
  EXPECT_LT((jml::dynamics(pair.whole, x, none) - hand.F * x).norm(), 1e-15);
  EXPECT_LT((jml::dynamics_jacobian(pair.whole, x, none) - hand.F).norm(), 1e-15);
  EXPECT_EQ(pair.whole.disturbance_input(), hand.G);
  EXPECT_EQ(pair.whole.disturbance_bound(), Vector1(1.5));
  EXPECT_EQ(pair.whole.disturbance_covariance()(0, 0), 0.75);
}

template <typename Rule>
void same_filter() {
  const Pair pair;
  const auto sensor = jml::sensor_of(pair.whole, pair.sensor);
  const jml::Estimate<double, 4> start{Vector4(0.5, 1, 0, -0.3), 0.4 * jml::Matrix<double, 4, 4>::Identity()};
  jml::Filter coloured{Rule{}, pair.whole, start};
  jml::Filter hand{Rule{}, pair.by_hand(), start};
  jml::Noise noise(1);
  for (int k = 0; k < 50; ++k) {
    const Vector2 y = noise.normal_vector<2>();
    ASSERT_EQ(coloured.step(sensor, y).status, Status::ok);
    ASSERT_EQ(hand.step(pair.sensor_by_hand(), y).status, Status::ok);
    ASSERT_LT((coloured.x() - hand.x()).norm(), 1e-13);
    ASSERT_LT((coloured.P() - hand.P()).norm(), 1e-13);
  }
}
TEST(ColouredInput, SameKalmanFilter) {
  same_filter<jml::Ekf<>>();
  same_filter<jml::Kalman>();
}

template <typename Rule>
void same_box(const Rule& rule) {
  const Pair pair;
  const auto sensor = jml::sensor_of(pair.whole, pair.sensor);
  const Box<double, 4> start{Vector4(-1, -1, -0.5, -0.5), Vector4(1, 0.5, 0.5, 1)};
  Filter coloured{rule, pair.whole, start};
  Filter hand{rule, pair.by_hand(), start};
  const auto by_hand = pair.by_hand();
  jml::Noise noise(2);
  Vector4 truth = start.centre();
  for (int k = 0; k < 50; ++k) {
    truth = by_hand.F * truth + by_hand.G * models::within(Vector1(1.5), noise);
    const Vector2 y = pair.sensor.M * truth.head<2>() + models::within(Vector2(0.2, 0.3), noise);
    ASSERT_EQ(coloured.step(sensor, y).status, Status::ok);
    ASSERT_EQ(hand.step(pair.sensor_by_hand(), y).status, Status::ok);
    ASSERT_LT((coloured.box().lower - hand.box().lower).cwiseAbs().maxCoeff(), 1e-12) << k;
    ASSERT_LT((coloured.box().upper - hand.box().upper).cwiseAbs().maxCoeff(), 1e-12) << k;
    ASSERT_TRUE(coloured.box().contains(truth));
  }
}
TEST(ColouredInput, SameBox) {
  same_box(Linearised{});
  same_box(Guaranteed<0>{});
}

/// x⁺ = x + dt (sin x + control) + 0.1 time, G = (1 + x²) dt: reads everything.
struct Timed {
  static constexpr int states = 1, disturbances = 1, controls = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At& at) const {
    using std::sin;
    return jml::Vector<T, 1>(x(0) + at.dt * (sin(x(0)) + at.control(0)) + 0.1 * at.time);
  }
  template <typename T, typename At>
  jml::Matrix<T, 1, 1> disturbance_input(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Matrix<T, 1, 1>((1.0 + x(0) * x(0)) * at.dt);
  }
};
/// u⁺ = (1 - dt) u + 0.01 time + w.
struct Lag {
  static constexpr int states = 1, disturbances = 1;
  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& u, const At& at) const {
    return jml::Vector<T, 1>((1.0 - at.dt) * u(0) + 0.01 * at.time);
  }
  Vector1 disturbance_bound() const { return Vector1(0.25); }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.02); }
};

TEST(ColouredInput, PlantThatReadsTimeStepControlAndState) {
  const ColouredInput whole{Timed{}, Lag{}};
  static_assert(decltype(whole)::controls == 1 && !decltype(whole)::linear);
  static_assert(jml::reads_context<double, decltype(whole)>());
  const jml::StepContext<double, 1> at{.time = 3, .dt = 0.5, .control = Vector1(2.0)};
  const Vector2 x(0.4, -0.2);
  const double G = (1 + 0.16) * 0.5;
  EXPECT_LT((jml::dynamics(whole, x, at) -
             Vector2(0.4 + 0.5 * (std::sin(0.4) + 2) + 0.3 + G * -0.2, 0.5 * -0.2 + 0.03))
                .norm(),
            1e-15);
  jml::Matrix<double, 2, 2> J;
  J << 1 + 0.5 * std::cos(0.4) + 2 * 0.4 * 0.5 * -0.2, G, 0, 0.5;
  EXPECT_LT((jml::dynamics_jacobian(whole, x, at) - J).norm(), 1e-15);
  EXPECT_EQ(whole.disturbance_input(), Vector2(0, 1));

  // One step of each estimator against these numbers.
  const Box<double, 2> box{Vector2(0.3, -0.3), Vector2(0.5, -0.1)};
  Filter linearised{Linearised{}, whole, box, 3.0};
  ASSERT_EQ(linearised.predict(0.5, Vector1(2.0)), Status::ok);
  const Vector2 next = jml::dynamics(whole, x, at),
                spread = J.cwiseAbs() * Vector2(0.1, 0.1) + Vector2(0, 0.25);
  EXPECT_LT((linearised.box().lower - (next - spread)).norm(), 1e-14);
  EXPECT_LT((linearised.box().upper - (next + spread)).norm(), 1e-14);
  jml::Filter kalman{jml::Ekf{}, whole,
                     jml::Estimate<double, 2>{x, 0.1 * jml::Matrix<double, 2, 2>::Identity()}, 3.0};
  ASSERT_EQ(kalman.predict(0.5, Vector1(2.0)), Status::ok);
  EXPECT_LT((kalman.x() - next).norm(), 1e-15);
  jml::Matrix<double, 2, 2> P = 0.1 * J * J.transpose();
  P(1, 1) += 0.02;
  EXPECT_LT((kalman.P() - P).norm(), 1e-15);
  Filter guaranteed{Guaranteed<0>{}, whole, box, 3.0};
  ASSERT_EQ(guaranteed.predict(0.5, Vector1(2.0)), Status::ok);
  jml::Noise noise(3);
  for (int k = 0; k < 1000; ++k) {
    const Vector2 point = models::point_of(box, noise, k % 2 == 0);
    const Vector2 image =
        jml::dynamics(whole, point, at) + Vector2(0, models::within(Vector1(0.25), noise, k % 4 < 2)(0));
    ASSERT_LE((guaranteed.box().lower - image).maxCoeff(), 1e-14);
    ASSERT_LE((image - guaranteed.box().upper).maxCoeff(), 1e-14);
  }
}

/// A plant's bearing, with its residual.
struct Direction {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::atan2;
    return jml::Vector<T, 1>(atan2(x(1), x(0)));
  }
  template <typename T>
  jml::Vector<T, 1> residual(const jml::Vector<T, 1>& y, const jml::Vector<T, 1>& predicted) const {
    return jml::Vector<T, 1>(std::remainder(y(0) - predicted(0), T(6.283185307179586)));
  }
  Vector1 noise_bound() const { return Vector1(0.1); }
};
TEST(ColouredInput, SensorOfThePlant) {
  const Pair pair;
  const auto sensor = jml::sensor_of(pair.whole, pair.sensor);
  static_assert(decltype(sensor)::linear && decltype(sensor)::measurements == 2);
  const Vector4 x(1, -2, 3, 0.5);
  EXPECT_EQ(sensor.measurement(x), Vector2(1, 2.5));
  EXPECT_EQ(sensor.noise_bound(), Vector2(0.2, 0.3));
  EXPECT_EQ(sensor.noise_covariance(), pair.sensor.noise_covariance());
  const jml::StepContext<double> none;
  EXPECT_EQ(jml::measurement_jacobian(sensor, x, none), pair.sensor_by_hand().M);

  const auto direction = jml::sensor_of(pair.whole, Direction{});
  static_assert(!decltype(direction)::linear);
  Filter filter{Guaranteed<0>{}, pair.whole,
                      Box<double, 4>{Vector4(-3, -0.1, 0, 0), Vector4(-2, 0.5, 1, 1)}};
  const auto report = filter.update(direction, -3.1);
  EXPECT_EQ(report.status, Status::ok);
  EXPECT_NEAR(report.innovation(0), 6.283185307179586 - 3.1 - std::atan2(0.2, -2.5), 1e-14);
  EXPECT_TRUE(filter.box().contains(Vector4(-2.5, -2.5 * std::tan(3.1), 0.5, 0.5)));
  EXPECT_LT(filter.box().upper(1), 0.45);
}

/// A sensor that reads the clock, and a shaping filter with a mean.
struct Clocked {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const auto& at) const {
    return jml::Vector<T, 1>(x(0) + at.time);
  }
  Vector1 noise_bound() const { return Vector1(0.1); }
};
struct Drifting : Lag {
  Vector1 disturbance_mean() const { return Vector1(10.0); }
};
TEST(ColouredInput, SensorsOfTimeAndMeansAreHandedOn) {
  const ColouredInput whole{Timed{}, Drifting{}};
  const auto sensor = jml::sensor_of(whole, Clocked{});
  const auto start = [&](const auto& rule) {
    return Filter{rule, whole, Box<double, 2>{Vector2(0, 0), Vector2(1, 1)}, 7.0};
  };
  auto filter = start(Guaranteed{});
  EXPECT_NEAR(filter.update(sensor, 7.5).innovation(0), 0, 1e-14);
  auto linearised = start(Linearised{});
  ASSERT_EQ(linearised.predict(0.5), Status::ok);
  EXPECT_NEAR(linearised.x()(1), 0.5 * 0.5 + 0.07 + 10, 1e-14);
  filter = start(Guaranteed{});
  ASSERT_EQ(filter.predict(0.5), Status::ok);
  EXPECT_NEAR(filter.x()(1), 0.5 * 0.5 + 0.07 + 10, 1e-14);
}

}  // namespace
