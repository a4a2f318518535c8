// SPDX-License-Identifier: BSD-3-Clause
// What jml::Filter keeps beside the belief, for every method alike: the control of the last step, the time, the
// status of a start; and that times and controls are refused before a method sees them.
#include <gtest/gtest.h>

#include <jml/jml.hpp>
#include <limits>

namespace {

using jml::Matrix, jml::Vector, jml::Status;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double huge = std::numeric_limits<double>::max();

struct Pushed {
  static constexpr int states = 1, controls = 1;
  template <typename T, typename At>
  Vector<T, 1> dynamics(const Vector<T, 1>& x, const At& at) const {
    return Vector<T, 1>(x(0) + double(at.dt) * double(at.control(0)));
  }
  Matrix<double, 1, 1> disturbance_covariance() const { return Matrix<double, 1, 1>(0.01); }
  Vector<double, 1> disturbance_bound() const { return Vector<double, 1>(0.1); }
};
struct PushedFlow {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, controls = 1;
  template <typename T, typename At>
  Vector<T, 1> dynamics(const Vector<T, 1>& x, const At& at) const {
    return Vector<T, 1>(0.0 * x(0) + double(at.control(0)));
  }
  template <typename T>
  Matrix<T, 1, 1> dynamics_sdc(const Vector<T, 1>&) const {
    return Matrix<T, 1, 1>(T(-0.1));
  }
  Matrix<double, 1, 1> disturbance_spectral_density() const { return Matrix<double, 1, 1>(0.01); }
};
/// Sees x + 10 u, of the control that it is told.
struct Gauge {
  static constexpr int measurements = 1;
  template <typename T, typename At>
  Vector<T, 1> measurement(const Vector<T, 1>& x, const At& at) const {
    return Vector<T, 1>(x(0) + 10 * double(at.control(0)));
  }
  Matrix<double, 1, 1> noise_covariance() const { return Matrix<double, 1, 1>(1); }
  Vector<double, 1> noise_bound() const { return Vector<double, 1>(100.0); }
};

const jml::Estimate<double, 1> start{2.0, 1.0};
const jml::Box<double, 1> box{1.0, 3.0};

/// use(filter, start) for a filter of every family, at time 5.
template <typename Use>
void for_every_filter(const Use& use) {
  use(jml::Filter{jml::Ekf{}, Pushed{}, start, 5.0}, start, "EKF");
  use(jml::Filter{jml::IteratedJml{}, Pushed{}, start, 5.0}, start, "iterated JML");
  use(jml::Filter{jml::Guaranteed{}, Pushed{}, box, 5.0}, box, "box");
  use(jml::Filter{jml::FixedLag<3, 4>{}, Pushed{}, jml::sensors<Gauge>, start, 5.0}, start, "fixed lag");
  use(jml::Filter{jml::Continuous{jml::Ekf{}}, PushedFlow{}, start, 5.0}, start, "continuous");
}

TEST(FilterState, TheControlOfTheLastStepIsKeptForASensorThatReadsIt) {
  for_every_filter([](auto filter, const auto& from, const char* name) {
    SCOPED_TRACE(name);
    const auto seen = [&](double wanted) {
      const auto report = filter.update(Gauge{}, 0.0);
      ASSERT_TRUE(jml::usable(report));
      const double before = -report.innovation(0);  // m of the belief it had
      EXPECT_NEAR(before, wanted, 1e-9);
    };
    seen(2);
    ASSERT_TRUE(jml::usable(filter.reset(from, 5)));
    ASSERT_TRUE(jml::usable(filter.predict(0.5, Vector<double, 1>(0.4))));
    seen(2 + 0.2 + 4);
    ASSERT_TRUE(jml::usable(filter.reset(from, 5)));
    seen(2);  // reset() forgets it
    ASSERT_TRUE(jml::usable(filter.reset(from, 5)));
    ASSERT_TRUE(jml::usable(filter.step(Gauge{}, 12.0, 0.0, Vector<double, 1>(1.0))));
    const double x = filter.x()(0);
    const auto report = filter.update(Gauge{}, 0.0);
    ASSERT_TRUE(jml::usable(report));
    EXPECT_NEAR(-report.innovation(0), x + 10, 1e-9) << "of a step too";
    EXPECT_EQ(filter.predict(-1.0, Vector<double, 1>(7.0)), Status::invalid_time_step);
    const double now = filter.x()(0);
    EXPECT_NEAR(-filter.update(Gauge{}, 0.0).innovation(0), now + 10, 1e-9) << "a refusal leaves it";
  });
}

TEST(FilterState, TimesAndControlsAreRefusedByName) {
  for_every_filter([](auto filter, const auto& from, const char* name) {
    SCOPED_TRACE(name);
    const Vector<double, 1> u(0.5);
    for (const double dt : {-1e-9, nan, std::numeric_limits<double>::infinity()}) {
      EXPECT_EQ(filter.predict(dt, u), Status::invalid_time_step);
      EXPECT_EQ(filter.step(Gauge{}, 1.0, dt, u), Status::invalid_time_step);
    }
    EXPECT_EQ(filter.step(Gauge{}, 1.0, jml::at_time(4.9), u), Status::invalid_time_step) << "it has passed";
    EXPECT_EQ(filter.predict(jml::at_time(nan), u), Status::invalid_time_step);
    EXPECT_EQ(filter.predict(0.1, Vector<double, 1>(nan)), Status::invalid_control);
    EXPECT_EQ(filter.step(Gauge{}, 1.0, 0.1, Vector<double, 1>(nan)), Status::invalid_control);
    EXPECT_EQ(filter.time(), 5);
    EXPECT_TRUE(jml::usable(filter.predict(jml::at_time(5.25), u)));
    EXPECT_EQ(filter.time(), 5.25);
    for (const double bad : {nan, std::numeric_limits<double>::infinity()}) {
      EXPECT_EQ(filter.reset(from, bad), Status::invalid_time_step);
      EXPECT_EQ(filter.status(), Status::invalid_time_step);
      EXPECT_EQ(filter.update(Gauge{}, 1.0), Status::invalid_time_step);
    }
    ASSERT_EQ(filter.reset(from, huge), Status::ok);
    EXPECT_EQ(filter.predict(huge, Vector<double, 1>(0.0)), Status::invalid_time_step) << "its end is no time";
  });
}

// One-pass rules: a nonsymmetric S that is regular, but whose symmetric part is not positive definite, has no gate.
struct Turned {
  static constexpr int measurements = 2;
  template <typename T>
  Vector<T, 2> measurement(const Vector<T, 2>& x) const {
    return x;
  }
  template <typename T>
  Matrix<T, 2, 2> measurement_sdc(const Vector<T, 2>&) const {
    Matrix<T, 2, 2> M;
    M << -3, 0, 0, -3;
    return M;
  }
  Matrix<double, 2, 2> noise_covariance() const { return Matrix<double, 2, 2>::Identity(); }
};
struct Still {
  static constexpr int states = 2;
  template <typename T>
  Vector<T, 2> dynamics(const Vector<T, 2>& x) const {
    return x;
  }
};
TEST(FilterState, NoGateWhereNisIsNotDefined) {
  jml::Filter filter{jml::Jml{}, Still{},
                     jml::Estimate<double, 2>{Vector<double, 2>(1, 1), Matrix<double, 2, 2>(Matrix<double, 2, 2>::Identity())}};
  const auto open = filter;
  filter.gate.probability = 0.99;
  EXPECT_EQ(filter.update(Turned{}, Vector<double, 2>(1, 1)), Status::innovation_indefinite);
  EXPECT_EQ(filter.x(), open.x());
  EXPECT_TRUE(std::isnan(filter.update(Turned{}, Vector<double, 2>(1, 1)).nis()));
}

}  // namespace
