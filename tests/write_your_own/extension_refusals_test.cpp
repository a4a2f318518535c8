// SPDX-License-Identifier: BSD-3-Clause
// The methods and rules of examples/write_your_own refuse by name as the library's do, leave belief and time
// bit by bit as they were, and do not touch the heap.
#include <gtest/gtest.h>

#include <cstring>
#include <jml/filter/check_method.hpp>

#include "heap_trap.hpp"
#include "models/linear.hpp"
#include "write_your_own/consider_ekf.hpp"
#include "write_your_own/cubature.hpp"
#include "write_your_own/midpoint_slot.hpp"

namespace {

using jml::Status;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
using Vector2 = jml::Vector<double, 2>;
using Matrix2 = jml::Matrix<double, 2, 2>;

Matrix2 matrix(double a, double b, double c, double d) { return (Matrix2() << a, b, c, d).finished(); }

/// A model in which every part can be spoiled.
struct Plant {
  static constexpr int states = 2, disturbances = 2, controls = 1;
  Matrix2 Q = matrix(0.2, 0.05, 0.05, 0.1);
  double offset = 0, stretch = 1;

  template <typename T, typename At>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const At& at) const {
    return {stretch * (x(0) + at.dt * x(1)) + offset, x(1) - at.dt * (x(0) * x(0) * x(0) - at.control(0))};
  }
  Matrix2 disturbance_covariance() const { return Q; }
};
/// The same with a Q that varies: it is formed and judged at each step.
struct VaryingPlant : Plant {
  template <typename T, typename At>
  Matrix2 disturbance_covariance(const jml::Vector<T, 2>&, const At&) const {
    return Q;
  }
};
struct Gauge {
  static constexpr int measurements = 2;
  Matrix2 R = matrix(0.5, 0.1, 0.1, 0.3);
  double offset = 0;

  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return {x(0) + offset, x(0) * x(1)};
  }
  Matrix2 noise_covariance() const { return R; }
};
/// The first state, measured twice.
struct Twice {
  static constexpr int measurements = 2;
  double r = 1e-40;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return {x(0), x(0)};
  }
  Matrix2 noise_covariance() const { return r * Matrix2::Identity(); }
};
/// The first state, in units so small that its variance can underflow.
struct Fine {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(0x1p40 * x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0x1p-1060); }
};

const jml::Estimate good{Vector2(1, 0.5), matrix(1, 0.3, 0.3, 2)};
const Vector2 y(1.2, 0.4);
const jml::Vector<double, 1> control(0.3);

template <typename Filter>
struct Snapshot {
  typename Filter::Belief belief;
  double time;
  explicit Snapshot(const Filter& f) : belief(f.belief()), time(f.time()) {}
  bool same(const Filter& f) const {
    const double now = f.time();
    return std::memcmp(belief.x.data(), f.x().data(), sizeof belief.x) == 0 &&
           std::memcmp(belief.P.data(), f.P().data(), sizeof belief.P) == 0 &&
           std::memcmp(&time, &now, sizeof now) == 0;
  }
};

/// A prediction and a step answer `wanted` and change nothing.
template <typename M, typename D>
void prediction_refused(Status wanted, const D& plant, const jml::Estimate<double, 2>& start = good,
                        double dt = 0.1, double u = 0.3) {
  jml::Filter filter{M{}, plant, start, 3};
  const Snapshot before(filter);
  EXPECT_EQ(filter.predict(dt, jml::Vector<double, 1>(u)), wanted) << jml::describe(wanted);
  EXPECT_EQ(filter.step(Gauge{}, y, dt, jml::Vector<double, 1>(u)).status, wanted) << jml::describe(wanted);
  EXPECT_TRUE(before.same(filter));
}

/// A step and an update answer `wanted` and change nothing, and the filter goes on without the measurement.
template <typename M, typename S, typename Y>
void measurement_refused(Status wanted, const S& sensor, const Y& measured, jml::Gate gate = {},
                         const jml::Estimate<double, 2>& start = good, const Plant& plant = {}) {
  jml::Filter filter{M{}, plant, start, 3};
  filter.gate = gate;
  const Snapshot before(filter);
  EXPECT_EQ(filter.step(sensor, measured, 0.1, control).status, wanted) << jml::describe(wanted);
  EXPECT_TRUE(before.same(filter));
  EXPECT_EQ(filter.update(sensor, measured).status, wanted) << jml::describe(wanted);
  EXPECT_TRUE(before.same(filter));
  EXPECT_EQ(filter.predict(0.1, control), Status::ok);
}

template <typename M>
struct Extensions : ::testing::Test {};
// The midpoint rules go by jml::OnePass, whose refusals are tested in tests/riccati; here one of them is enough.
using All = ::testing::Types<own::Cubature, own::ConsiderEkf<1>, own::MidpointJml<>>;
TYPED_TEST_SUITE(Extensions, All);

TYPED_TEST(Extensions, RefuseMeasurementAndGate) {
  for (const double bad : {nan, inf, -inf}) {
    measurement_refused<TypeParam>(Status::invalid_measurement, Gauge{}, Vector2(1, bad));
    measurement_refused<TypeParam>(Status::invalid_measurement, Gauge{}, Vector2(bad, 1));
  }
  measurement_refused<TypeParam>(Status::invalid_measurement, Gauge{},
                                 Eigen::VectorXd(Eigen::VectorXd::Ones(3)));
  for (const double bad : {0.0, -1.0, 1.5, nan})
    measurement_refused<TypeParam>(Status::invalid_option, Gauge{}, y, {bad});
}

TYPED_TEST(Extensions, RefuseTimeAndControl) {
  for (const double bad : {nan, inf, -inf}) {
    prediction_refused<TypeParam>(Status::invalid_time_step, Plant{}, good, bad);
    prediction_refused<TypeParam>(Status::invalid_control, Plant{}, good, 0.1, bad);
  }
  prediction_refused<TypeParam>(Status::invalid_time_step, Plant{}, good, -1e-9);
}

TYPED_TEST(Extensions, RefuseAStart) {
  const auto start = [](double x, const Matrix2& P) { return jml::Estimate<double, 2>{Vector2(x, 1), P}; };
  for (const double bad : {nan, inf}) {
    prediction_refused<TypeParam>(Status::invalid_state, Plant{}, start(bad, good.P));
    prediction_refused<TypeParam>(Status::invalid_covariance, Plant{}, start(1, matrix(1, bad, bad, 2)));
    prediction_refused<TypeParam>(Status::invalid_covariance, Plant{}, start(1, matrix(bad, 0, 0, 2)));
  }
  prediction_refused<TypeParam>(Status::invalid_covariance, Plant{}, start(1, matrix(1, 2, 2, 1)));
  prediction_refused<TypeParam>(Status::invalid_covariance, Plant{}, start(1, matrix(-1e-9, 0, 0, 1)));
  jml::Filter filter{TypeParam{}, Plant{}, start(nan, good.P)};
  EXPECT_EQ(filter.reset(good, 5), Status::ok);
  EXPECT_EQ(filter.step(Gauge{}, y, 0.1, control).status, Status::ok);
}

TYPED_TEST(Extensions, RefuseQAndR) {
  for (const Matrix2& bad : {matrix(1, 2, 2, 1), matrix(1, 0.1, 0.2, 1), matrix(-1e-9, 0, 0, 1),
                             matrix(1, nan, nan, 1), matrix(1, 0, 0, inf), matrix(nan, 0, 0, 1)}) {
    SCOPED_TRACE(bad);
    Plant plant;
    VaryingPlant varying;
    plant.Q = varying.Q = bad;
    prediction_refused<TypeParam>(Status::invalid_disturbance_covariance, plant);
    prediction_refused<TypeParam>(Status::invalid_disturbance_covariance, varying);
    measurement_refused<TypeParam>(Status::invalid_noise_covariance, Gauge{.R = bad}, y);
  }
  measurement_refused<TypeParam>(Status::invalid_noise_covariance, Gauge{.R = matrix(4, 2, 2, 1)},
                                 y);  // singular
}

TYPED_TEST(Extensions, RefuseModelsThatAreNotFinite) {
  for (const double bad : {nan, inf}) {
    Plant plant;
    plant.offset = bad;
    prediction_refused<TypeParam>(Status::dynamics_not_finite, plant);
    measurement_refused<TypeParam>(Status::sensor_not_finite, Gauge{.offset = bad}, y);
  }
}

TYPED_TEST(Extensions, RefuseASingularInnovation) {
  const jml::Estimate start{Vector2(0.25, 0), Matrix2(Matrix2::Identity())};
  jml::Filter filter{TypeParam{}, Plant{}, start};
  const Snapshot before(filter);
  EXPECT_EQ(filter.update(Twice{}, y).status, Status::singular_innovation);
  EXPECT_EQ(filter.step(Twice{}, y, 0.0, control).status, Status::singular_innovation);
  EXPECT_TRUE(before.same(filter));
  EXPECT_EQ(filter.update(Twice{.r = 0.1}, y).status, Status::ok);
}

TYPED_TEST(Extensions, RefuseALostCovariance) {
  // K R Kᵀ underflows, and what is left of the variance is zero.
  const jml::Estimate start{Vector2(0, 0), Matrix2(Matrix2::Identity())};
  jml::Filter filter{TypeParam{}, Plant{}, start};
  const Snapshot before(filter);
  EXPECT_EQ(filter.update(Fine{}, 1.0).status, Status::covariance_lost);
  EXPECT_TRUE(before.same(filter));
}

TYPED_TEST(Extensions, RefusalsLeaveNoTrace) {
  jml::Filter steady{TypeParam{}, Plant{}, good}, disturbed = steady;
  for (int i = 0; i < 20; ++i) {
    const Vector2 now(1 + 0.1 * i, 0.5);
    EXPECT_EQ(disturbed.step(Gauge{}, Vector2(nan, 1), 0.1, control).status, Status::invalid_measurement);
    EXPECT_EQ(disturbed.step(Gauge{.offset = nan}, now, 0.1, control).status, Status::sensor_not_finite);
    EXPECT_EQ(disturbed.predict(nan, control), Status::invalid_time_step);
    ASSERT_EQ(steady.step(Gauge{}, now, 0.1, control).status, Status::ok);
    ASSERT_EQ(disturbed.step(Gauge{}, now, 0.1, control).status, Status::ok);
    ASSERT_TRUE(Snapshot(steady).same(disturbed));
  }
}

TYPED_TEST(Extensions, DoNotTouchTheHeap) {
  int used = 0;
  {
    heap_trap::Armed trap;
    jml::Filter filter{TypeParam{}, Plant{}, good};
    filter.gate = {0.9999};
    for (int i = 0; i < 5; ++i) {
      used += filter.step(Gauge{}, y, 0.1, control).status == Status::ok;
      used += filter.predict(0.1, control) == Status::ok;
      used += filter.update(Gauge{}, y).status == Status::ok;
      used += filter.step(Gauge{}, Vector2(nan, 1), 0.1, control).status == Status::invalid_measurement;
    }
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  EXPECT_EQ(used, 20);
}

// What jml::Filter promises of every method, on a nonlinear flight with time and control, and on a linear
// one.
template <bool on_linear = true, typename M>
void check(const M& method) {
  const jml::Vector<double, 2> flight[] = {y, Vector2(1, 0.6), Vector2(0.7, 0.2), Vector2(1.3, 0.4)};
  const auto bent = jml::check_method(jml::Filter{method, Plant{}, good, 3}, Gauge{}, flight, 0.1, control);
  EXPECT_TRUE(bent.ok()) << bent.at << ": " << bent.what;
  if constexpr (on_linear) {
    jml::Noise noise(1);
    const auto dynamics = models::random_linear_dynamics<3, 2>(noise);
    const auto sensor = models::random_linear_sensor<3, 2>(noise);
    const jml::Estimate<double, 3> start{models::random_matrix<3, 1>(noise),
                                         models::random_covariance<3>(noise, 0.1)};
    const auto linear = jml::check_method(jml::Filter{method, dynamics, start}, sensor, flight);
    EXPECT_TRUE(linear.ok()) << linear.at << ": " << linear.what;
  }
}
TEST(CheckedExtensions, Cubature) { check(own::Cubature{}); }
TEST(CheckedExtensions, ConsiderEkf) {
  check(own::ConsiderEkf<0>{});
  check<false>(own::ConsiderEkf<1>{});
}
struct Boasting : own::ConsiderEkf<1> {
  static constexpr bool optimal_on_linear = true;
};
TEST(CheckedExtensions, FindsAMethodThatClaimsTooMuch) {
  jml::Noise noise(1);
  const auto dynamics = models::random_linear_dynamics<3, 2>(noise);
  const auto sensor = models::random_linear_sensor<3, 2>(noise);
  const jml::Estimate<double, 3> start{models::random_matrix<3, 1>(noise),
                                       models::random_covariance<3>(noise, 0.1)};
  EXPECT_FALSE(
      jml::check_method(jml::Filter{Boasting{}, dynamics, start}, sensor, {y, Vector2(1, 0.6)}).ok());
}
TEST(CheckedExtensions, Midpoint) {
  check<false>(own::MidpointSddre{});
  check(own::MidpointJml{});
  check<false>(jml::Iterated<own::MidpointJml<>>{});
}

TEST(Cubature, RefusesACovarianceThatOverflows) {
  Plant far;
  far.stretch = 1e200;  // f does not
  prediction_refused<own::Cubature>(Status::covariance_lost, far);
}

// Through the free functions an estimate comes in that no start() has seen.
TEST(Cubature, RefusesAPriorThatIsNoCovariance) {
  for (const Matrix2& bad :
       {matrix(1, 2, 2, 1), matrix(0, 1, 1, 0), matrix(1, 0, 0, -1e-9), matrix(4, 2, 2, 1 - 1e-6)}) {
    const jml::Estimate prior{Vector2(1, 0.5), bad};
    const auto predicted =
        jml::predict(own::Cubature{}, Plant{}, prior, jml::StepContext<double, 1>{0, 0.1, control});
    const auto updated = jml::update(own::Cubature{}, Gauge{}, prior, y);
    EXPECT_EQ(predicted.status, Status::covariance_lost) << bad;
    EXPECT_EQ(updated.report.status, Status::covariance_lost) << bad;
    EXPECT_EQ(predicted.estimate.P, bad);
    EXPECT_EQ(updated.estimate.P, bad);
  }
}

}  // namespace
