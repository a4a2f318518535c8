// SPDX-License-Identifier: BSD-3-Clause
// Every refusal of a one-pass step has its name, and leaves state, P and time bit by bit as they were.
#include <gtest/gtest.h>

#include <cstring>
#include <jml/filter/pure.hpp>
#include <jml/jml.hpp>

namespace {

using namespace jml::operators;

using jml::Status;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
using Vector2 = jml::Vector<double, 2>;
using Matrix2 = jml::Matrix<double, 2, 2>;

/// A model in which every part can be spoiled. Mildly nonlinear, dense.
struct Plant {
  static constexpr int states = 2, disturbances = 2, controls = 1;
  Matrix2 Q = (Matrix2() << 0.2, 0.05, 0.05, 0.1).finished();
  Matrix2 G = (Matrix2() << 1, 0.5, -0.2, 1).finished();
  double f_offset = 0, jacobian_offset = 0, sdc_offset = 0;
  using At = jml::StepContext<double, 1>;

  Vector2 dynamics(const Vector2& x, const At& at) const {
    return {x(0) + at.dt * x(1) + f_offset, x(1) - at.dt * (x(0) * x(0) * x(0) - at.control(0))};
  }
  Matrix2 dynamics_jacobian(const Vector2& x, const At& at) const {
    return (Matrix2() << 1, at.dt, -3 * at.dt * x(0) * x(0), 1 + jacobian_offset).finished();
  }
  Matrix2 dynamics_sdc(const Vector2& x, const At& at) const {
    return (Matrix2() << 1, at.dt, -at.dt * x(0) * x(0), 1 + sdc_offset).finished();
  }
  Matrix2 disturbance_input() const { return G; }
  Matrix2 disturbance_covariance() const { return Q; }
};
/// The same with a Q that varies: it is formed and judged at each step.
struct VaryingPlant : Plant {
  Matrix2 disturbance_covariance(const Vector2&, const At&) const { return Q; }
};

struct Gauge {
  static constexpr int measurements = 2;
  Matrix2 R = (Matrix2() << 0.5, 0.1, 0.1, 0.3).finished();
  double m_offset = 0, jacobian_offset = 0, sdc_offset = 0;

  Vector2 measurement(const Vector2& x) const { return {x(0) + m_offset, x(0) * x(1)}; }
  Matrix2 measurement_jacobian(const Vector2& x) const {
    return (Matrix2() << 1 + jacobian_offset, 0, x(1), x(0)).finished();
  }
  Matrix2 measurement_sdc(const Vector2& x) const {
    return (Matrix2() << 1 + sdc_offset, 0, x(1), 0).finished();
  }
  Matrix2 noise_covariance() const { return R; }
};

struct Request {
  Vector2 y{1.2, 0.4};
  double dt = 0.1;
  jml::Vector<double, 1> control{0.3};
};

const jml::Estimate<double, 2> good{Vector2(1, 0.5), (Matrix2() << 1, 0.3, 0.3, 2).finished()};

template <typename Filter>
struct Snapshot {
  typename Filter::State x;
  typename Filter::Covariance P;
  double time;
  explicit Snapshot(const Filter& f) : x(f.x()), P(f.P()), time(f.time()) {}
  bool same(const Filter& f) const {
    const double now = f.time();
    return std::memcmp(x.data(), f.x().data(), sizeof x) == 0 &&
           std::memcmp(P.data(), f.P().data(), sizeof P) == 0 && std::memcmp(&time, &now, sizeof now) == 0;
  }
};

/// A step, and where `in_predict` a prediction, must both answer `wanted` and change nothing.
template <typename Rule, typename D>
void refused(Status wanted, const D& plant, const Gauge& gauge, const Request& r, bool in_predict = false,
             const jml::Estimate<double, 2>& start = good, jml::Gate gate = {}, double time = 3) {
  SCOPED_TRACE(jml::describe(wanted));
  jml::Filter filter{Rule{}, plant, start, time};
  filter.gate = gate;
  const Snapshot before(filter);
  EXPECT_EQ(filter.step(gauge, r.y, r.dt, r.control).status, wanted);
  EXPECT_TRUE(before.same(filter));
  if (in_predict) {
    EXPECT_EQ(filter.predict(r.dt, r.control), wanted);
  } else {
    EXPECT_EQ(filter.predict(0.1), Status::ok);
    const Snapshot predicted(filter);
    EXPECT_EQ(filter.update(gauge, r.y).status, wanted);
    EXPECT_TRUE(predicted.same(filter));
    return;
  }
  EXPECT_TRUE(before.same(filter));
}

template <typename T, typename Change>
T changed(T value, const Change& change) {
  change(value);
  return value;
}

template <typename Rule>
void bad_requests() {
  for (const double bad : {nan, inf, -inf}) {
    refused<Rule>(Status::invalid_measurement, Plant{}, Gauge{}, {.y = {1, bad}});
    refused<Rule>(Status::invalid_measurement, Plant{}, Gauge{}, {.y = {bad, 1}});
    refused<Rule>(Status::invalid_time_step, Plant{}, Gauge{}, {.dt = bad}, true);
    refused<Rule>(Status::invalid_control, Plant{}, Gauge{}, {.control = jml::Vector<double, 1>(bad)}, true);
    refused<Rule>(Status::invalid_time_step, Plant{}, Gauge{}, {}, true, good, {}, bad);
  }
  refused<Rule>(Status::invalid_time_step, Plant{}, Gauge{}, {.dt = -1e-9}, true);
  for (const double bad : {0.0, -1.0, 1.5, nan}) {
    refused<Rule>(Status::invalid_option, Plant{}, Gauge{}, {}, false, good, {bad});
  }
}

template <typename Rule>
void bad_priors() {
  const auto prior = [](double x0, double p00, double p01, double p10, double p11) {
    return jml::Estimate<double, 2>{Vector2(x0, 1), (Matrix2() << p00, p01, p10, p11).finished()};
  };
  refused<Rule>(Status::invalid_state, Plant{}, Gauge{}, {}, true, prior(nan, 1, 0, 0, 1));
  refused<Rule>(Status::invalid_state, Plant{}, Gauge{}, {}, true, prior(-inf, 1, 0, 0, 1));
  refused<Rule>(Status::invalid_covariance, Plant{}, Gauge{}, {}, true, prior(1, 1, nan, nan, 1));
  refused<Rule>(Status::invalid_covariance, Plant{}, Gauge{}, {}, true, prior(1, inf, 0, 0, 1));
  refused<Rule>(Status::invalid_covariance, Plant{}, Gauge{}, {}, true,
                prior(1, 1, 2, 2, 1));  // eigenvalue -1
  refused<Rule>(Status::invalid_covariance, Plant{}, Gauge{}, {}, true, prior(1, -1e-9, 0, 0, 1));
  if (Rule::symmetric)
    refused<Rule>(Status::invalid_covariance, Plant{}, Gauge{}, {}, true, prior(1, 1, 0.3, 0.2, 1));
}

template <typename Rule>
void bad_covariances() {
  const Matrix2 bad[] = {(Matrix2() << 1, 2, 2, 1).finished(),     (Matrix2() << 1, 0.1, 0.2, 1).finished(),
                         (Matrix2() << -1e-9, 0, 0, 1).finished(), (Matrix2() << 1, nan, nan, 1).finished(),
                         (Matrix2() << 1, 0, 0, inf).finished(),   (Matrix2() << nan, 0, 0, 1).finished()};
  for (const Matrix2& matrix : bad) {
    SCOPED_TRACE(matrix);
    refused<Rule>(Status::invalid_disturbance_covariance, changed(Plant{}, [&](auto& d) { d.Q = matrix; }),
                  Gauge{}, {}, true);
    refused<Rule>(Status::invalid_disturbance_covariance,
                  changed(VaryingPlant{}, [&](auto& d) { d.Q = matrix; }), Gauge{}, {}, true);
    refused<Rule>(Status::invalid_noise_covariance, Plant{}, Gauge{.R = matrix}, {});
  }
  refused<Rule>(Status::invalid_disturbance_covariance, changed(Plant{}, [](auto& d) { d.G(1, 0) = nan; }),
                Gauge{}, {}, true);
  // Semidefinite is enough for Q, and not for R.
  const Matrix2 rank_one = (Matrix2() << 4, 2, 2, 1).finished();
  refused<Rule>(Status::invalid_noise_covariance, Plant{}, Gauge{.R = rank_one}, {});
  refused<Rule>(Status::invalid_noise_covariance, Plant{}, Gauge{.R = Matrix2::Zero()}, {});
  jml::Filter filter{Rule{}, changed(Plant{}, [&](auto& d) { d.Q = rank_one; }), good};
  EXPECT_EQ(filter.step(Gauge{}, Vector2(1, 0.5), 0.1).status, Status::ok);
}

template <typename Rule>
void bad_models() {
  for (const double bad : {nan, inf}) {
    refused<Rule>(Status::dynamics_not_finite, changed(Plant{}, [&](auto& d) { d.f_offset = bad; }), Gauge{},
                  {}, true);
    refused<Rule>(Status::sensor_not_finite, Plant{}, Gauge{.m_offset = bad}, {});
    constexpr bool f_x = Rule::A == jml::Slot::jacobian || Rule::B == jml::Slot::jacobian;
    if (f_x) {
      refused<Rule>(Status::dynamics_not_finite, changed(Plant{}, [&](auto& d) { d.jacobian_offset = bad; }),
                    Gauge{}, {}, true);
      refused<Rule>(Status::sensor_not_finite, Plant{}, Gauge{.jacobian_offset = bad}, {});
    }
    if (Rule::uses_sdc) {
      refused<Rule>(Status::dynamics_not_finite, changed(Plant{}, [&](auto& d) { d.sdc_offset = bad; }),
                    Gauge{}, {}, true);
      refused<Rule>(Status::sensor_not_finite, Plant{}, Gauge{.sdc_offset = bad}, {});
    }
  }
}

template <typename Rule>
struct Refusals : ::testing::Test {};
using Rules = ::testing::Types<jml::Ekf<>, jml::Sddre<>, jml::Jml<>>;
TYPED_TEST_SUITE(Refusals, Rules);

TYPED_TEST(Refusals, OfMeasurementTimeStepControlAndGate) { bad_requests<TypeParam>(); }
TYPED_TEST(Refusals, OfThePrior) { bad_priors<TypeParam>(); }
TYPED_TEST(Refusals, OfQAndR) { bad_covariances<TypeParam>(); }
TYPED_TEST(Refusals, OfModelsThatAreNotFinite) { bad_models<TypeParam>(); }

TYPED_TEST(Refusals, LeaveNoTraceInTheStepsThatFollow) {
  jml::Filter steady{TypeParam{}, Plant{}, good}, disturbed{TypeParam{}, Plant{}, good};
  for (int i = 0; i < 20; ++i) {
    const Vector2 y(1 + 0.1 * i, 0.5);
    EXPECT_EQ(disturbed.step(Gauge{}, Vector2(nan, 1), 0.1).status, Status::invalid_measurement);
    EXPECT_EQ(disturbed.step(Gauge{.m_offset = nan}, y, 0.1).status, Status::sensor_not_finite);
    EXPECT_EQ(disturbed.predict(nan), Status::invalid_time_step);
    ASSERT_EQ(steady.step(Gauge{}, y, 0.1).status, Status::ok);
    ASSERT_EQ(disturbed.step(Gauge{}, y, 0.1).status, Status::ok);
    ASSERT_TRUE(Snapshot(steady).same(disturbed));
  }
}

TYPED_TEST(Refusals, OfABadStartEndWithReset) {
  jml::Filter filter{TypeParam{}, Plant{}, jml::Estimate<double, 2>{Vector2(nan, 0), Matrix2::Identity()}};
  EXPECT_EQ(filter.status(), Status::invalid_state);
  EXPECT_EQ(filter.step(Gauge{}, Vector2(1, 1), 0.1).status, Status::invalid_state);
  EXPECT_EQ(filter.reset(good, 5), Status::ok);
  EXPECT_EQ(filter.time(), 5);
  EXPECT_EQ(filter.step(Gauge{}, Vector2(1, 1), 0.1).status, Status::ok);
}

// n = 1: f = x³ - 2x has F = x² - 2 = -1 and f_x = 3x² - 2 = 1 at x = 1: N = -P, and with R = P the matrix S
// = R - P is exactly zero. Nothing of this can happen to a symmetric rule.
struct Cubic {
  static constexpr int states = 1, disturbances = 0;
  using X = jml::Vector<double, 1>;
  X dynamics(const X& x) const { return X(x(0) * x(0) * x(0) - 2 * x(0)); }
  X dynamics_jacobian(const X& x) const { return X(3 * x(0) * x(0) - 2); }
  X dynamics_sdc(const X& x) const { return X(x(0) * x(0) - 2); }
};
struct Position {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double r = 2;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Vector<double, 1> noise_covariance() const { return jml::Vector<double, 1>(r); }
};

TEST(SingularInnovation, OfTheNonsymmetricRule) {
  using X = jml::Vector<double, 1>;
  jml::Filter filter{jml::Jml{}, Cubic{}, jml::Estimate{X(1), X(2)}};
  const Snapshot before(filter);
  EXPECT_EQ(filter.step(Position{}, 0.5).status, Status::singular_innovation);
  EXPECT_TRUE(before.same(filter));
  EXPECT_EQ(filter.step(Position{.r = 3}, 0.5).status, Status::ok);  // S = 1
  EXPECT_DOUBLE_EQ(filter.P()(0), -2 * 3 / 1.0);                     // 1/(1/N + 1/R) with N = -2, R = 3

  jml::Filter ekf{jml::Ekf{}, Cubic{}, jml::Estimate{X(1), X(2)}};
  EXPECT_EQ(ekf.step(Position{}, 0.5).status, Status::ok);
}

struct First {
  static constexpr int measurements = 1;
  jml::Vector<double, 1> measurement(const Vector2& x) const { return jml::Vector<double, 1>(x(0)); }
  jml::Matrix<double, 1, 2> measurement_jacobian(const Vector2&) const { return {1, 0}; }
  jml::Vector<double, 1> noise_covariance() const { return jml::Vector<double, 1>(1); }
};

TEST(CovarianceLost,
     WhereTheStepGetsAPriorThatIsNone) {  // the free functions trust P; the update then shows it
  const jml::Estimate<double, 2> negative{Vector2(1, 1), (Matrix2() << 1, 0, 0, -1).finished()};
  const auto got = jml::update(jml::Ekf{}, First{}, negative, jml::Vector<double, 1>(2));
  EXPECT_EQ(got.report.status, Status::covariance_lost);
  EXPECT_EQ(std::memcmp(&got.estimate, &negative, sizeof negative), 0);
}

/// Of functions that are handed a prior, which no start has looked at.
template <typename Rule>
void prior_that_is_no_number() {
  const Rule rule;
  const jml::StepContext<double, 1> at{3, 0.1, jml::Vector<double, 1>(0.3)};
  const Vector2 y(1.2, 0.4);
  for (const double bad : {nan, inf, -inf}) {
    for (int entry = 0; entry < 4; ++entry) {
      jml::Estimate<double, 2> prior = good;
      const bool of_x = entry < 2;
      if (of_x)
        prior.x(entry) = bad;
      else
        prior.P(entry - 2, 1) = prior.P(1, entry - 2) = bad;
      const Status wanted = of_x ? Status::invalid_state : Status::invalid_covariance;
      const auto untouched = [&prior](const jml::Estimate<double, 2>& after) {
        return std::memcmp(&prior.x, &after.x, sizeof prior.x) == 0 &&
               std::memcmp(&prior.P, &after.P, sizeof prior.P) == 0;
      };
      const auto predicted = jml::predict(rule, Plant{}, prior, at);
      EXPECT_EQ(predicted.status, wanted) << jml::describe(predicted.status);
      EXPECT_TRUE(untouched(predicted.estimate));
      const auto corrected = jml::update(rule, Gauge{}, prior, y);
      EXPECT_EQ(corrected.report.status, wanted) << jml::describe(corrected.report.status);
      EXPECT_TRUE(untouched(corrected.estimate));
      const auto moved = jml::step(rule, Plant{}, Gauge{}, prior, y, at);
      EXPECT_EQ(moved.report.status, wanted) << jml::describe(moved.report.status);
      EXPECT_TRUE(untouched(moved.estimate));
    }
  }
}
TEST(Refusals, PriorThatIsNoNumber) {
  prior_that_is_no_number<jml::Ekf<>>();
  prior_that_is_no_number<jml::Sddre<>>();
  prior_that_is_no_number<jml::Jml<>>();
}

}  // namespace
