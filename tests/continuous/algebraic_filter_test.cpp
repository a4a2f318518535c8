// SPDX-License-Identifier: BSD-3-Clause
// The algebraic Riccati filter against scalar equations solved by hand, its limit at the origin, and its
// refusals.
#include <gtest/gtest.h>

#include <cmath>
#include <jml/continuous/algebraic.hpp>
#include <jml/continuous/continuous.hpp>

#include "models/continuous.hpp"

namespace {

using namespace jml::operators;

using Scalar1 = jml::Vector<double, 1>;
using Matrix1 = jml::Matrix<double, 1, 1>;

/// f = a x - b x³, G = 1 + g x², spectral density q of w.
struct Cubic {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  double a = 0.5, b = 0, g = 0, q = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(a * x(0) - b * x(0) * x(0) * x(0));
  }
  template <typename T>
  jml::Matrix<T, 1, 1> dynamics_sdc(const jml::Vector<T, 1>& x) const {
    return jml::Matrix<T, 1, 1>(a - b * x(0) * x(0));
  }
  Matrix1 disturbance_input(const Scalar1& x) const { return Matrix1(1 + g * x(0) * x(0)); }
  Matrix1 disturbance_spectral_density() const { return Matrix1(q); }
};

/// h = x - x³ with density r, all the time.
struct FoldedSignal {
  static constexpr int measurements = 1;
  double r = 0.2;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) - x(0) * x(0) * x(0));
  }
  template <typename T>
  jml::Matrix<T, 1, 1> measurement_sdc(const jml::Vector<T, 1>& x) const {
    return jml::Matrix<T, 1, 1>(1.0 - x(0) * x(0));
  }
  Matrix1 noise_spectral_density() const { return Matrix1(r); }
};

/// The same as samples of covariance r.
struct FoldedSamples {
  static constexpr int measurements = 1;
  double r = 0.2;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return FoldedSignal{}.measurement(x);
  }
  template <typename T>
  jml::Matrix<T, 1, 1> measurement_sdc(const jml::Vector<T, 1>& x) const {
    return FoldedSignal{}.measurement_sdc(x);
  }
  Matrix1 noise_covariance() const { return Matrix1(r); }
};

/// The root V of 0 = (A + B) V + g² q - V² D E / r that leaves the filter stable, and ẋ, by hand.
struct ByHand {
  Cubic f;
  FoldedSignal h;
  bool sdc = true;  ///< McCaffrey's slots; else those of the RNLS filter

  long double V(long double x) const {
    const long double F = f.a - f.b * x * x, f_x = f.a - 3 * f.b * x * x;
    const long double M = 1 - x * x, m_x = 1 - 3 * x * x;
    const long double sum = sdc ? 2 * F : F + f_x, quadratic = (sdc ? M * M : m_x * M) / h.r;
    const long double noise = (1 + f.g * x * x) * (1 + f.g * x * x) * f.q;
    return (sum + std::sqrt(sum * sum + 4 * noise * quadratic)) / (2 * quadratic);
  }
  long double slope(long double x, long double y) const {
    const long double D = sdc ? 1 - x * x : 1 - 3 * x * x;
    return f.a * x - f.b * x * x * x + V(x) * D / h.r * (y - (x - x * x * x));
  }
};

double signal(double t) { return 0.25 * std::sin(2 * t) + 0.05; }

/// ẋ by hand from x0 over 4 s, 40 000 Runge-Kutta steps in long double.
double reference(const ByHand& by_hand, double x0) {
  long double x = x0;
  const long double step = 1e-4L;
  for (int i = 0; i < 40000; ++i) {
    const auto y = [&](long double ahead) {
      return static_cast<long double>(signal(static_cast<double>(i * step + ahead)));
    };
    const long double k1 = by_hand.slope(x, y(0)), k2 = by_hand.slope(x + step / 2 * k1, y(step / 2));
    const long double k3 = by_hand.slope(x + step / 2 * k2, y(step / 2)),
                      k4 = by_hand.slope(x + step * k3, y(step));
    x += step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return static_cast<double>(x);
}

template <typename Rule>
double run(const Rule& rule, const Cubic& f, double x0, int steps, jml::AlgebraicOptions options = {}) {
  jml::Filter filter{jml::Algebraic{rule, options}, f, Scalar1(x0)};
  for (int i = 0; i < steps; ++i) {
    const auto report = filter.step(FoldedSignal{}, [](double t) { return Scalar1(signal(t)); }, 4.0 / steps);
    EXPECT_EQ(report.status, jml::Status::ok) << jml::describe(report.status);
    EXPECT_LE(report.residual, 1e-13);
  }
  return filter.x()(0);
}

// 0.25 in the signal keeps x within (-1/√3, 1/√3), where m_x M > 0 and the nonsymmetric equation has a root
// too.
TEST(AlgebraicFilter, followsTheScalarEquationByHand) {
  const Cubic f{.a = -0.3, .b = 0.4, .g = 0.5, .q = 0.7};
  const double mccaffrey = reference({f, {}, true}, 0.3), rnls = reference({f, {}, false}, 0.3);
  EXPECT_GT(std::abs(mccaffrey - rnls), 1e-4);  // they are two filters
  EXPECT_NEAR(run(jml::Sddre{}, f, 0.3, 400), mccaffrey, 1e-10);
  EXPECT_NEAR(run(jml::Rnls{}, f, 0.3, 400), rnls, 1e-10);
}

TEST(AlgebraicFilter, isOfOrderFourAndWithAHeldGainOfOrderOne) {
  const Cubic f{.a = -0.3, .b = 0.4, .g = 0.5, .q = 0.7};
  const double exact = reference({f, {}, true}, 0.3);
  const auto error = [&](int steps, jml::GainUpdate gain) {
    return std::abs(run(jml::Sddre{}, f, 0.3, steps, {.gain = gain}) - exact);
  };
  const double fine = error(40, jml::GainUpdate::every_stage),
               coarse = error(20, jml::GainUpdate::every_stage);
  EXPECT_NEAR(std::log2(coarse / fine), 4, 0.4);
  const double held = error(400, jml::GainUpdate::every_sample),
               held_longer = error(200, jml::GainUpdate::every_sample);
  EXPECT_NEAR(std::log2(held_longer / held), 1, 0.1);
}

TEST(AlgebraicFilter, ofSamplesTendsToTheContinuousOne) {
  const Cubic f{.a = -0.3, .b = 0.4, .g = 0.5, .q = 0.7};
  const double exact = reference({f, {}, true}, 0.3);
  double last = 0;
  for (const int steps : {400, 800, 1600}) {
    const double dt = 4.0 / steps;
    jml::Filter filter{jml::Algebraic{jml::Sddre{}}, f, Scalar1(0.3)};
    for (int i = 1; i <= steps; ++i) {
      const auto report = filter.step(FoldedSamples{0.2 / dt}, signal(i * dt), dt);
      ASSERT_EQ(report.status, jml::Status::ok) << jml::describe(report.status);
    }
    const double error = std::abs(filter.x()(0) - exact);
    if (last > 0) {
      EXPECT_NEAR(std::log2(last / error), 1, 0.1) << steps;
    }
    last = error;
  }
}

// F and M are even in x: V(x) - V(0) falls with the square of x. V(0) is the P that the continuous EKF
// reaches at rest, which is the claim of the report's title.
TEST(AlgebraicFilter, tendsToTheSteadyExtendedKalmanFilterAtTheOrigin) {
  const models::Oscillator dynamics{.c = 0.1, .k = 1};
  const models::SaturatingSignal sensor{1e-2};
  using X = jml::Vector<double, 2>;
  using Square = jml::Matrix<double, 2, 2>;
  jml::Filter ekf{jml::Continuous{jml::Ekf{}, jml::RungeKutta4{20}}, dynamics, jml::Estimate<double, 2>{X::Zero(), Square::Identity()}};
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(ekf.step(sensor, 0.0, 0.1).status, jml::Status::ok);
  const auto V = [&](const X& x) -> Square {
    jml::Filter filter{jml::Algebraic{jml::Sddre{}, {.gain = jml::GainUpdate::every_sample}}, dynamics, x};
    const auto report = filter.step(sensor, sensor.measurement(x), 1e-12);
    EXPECT_EQ(report.status, jml::Status::ok);
    return filter.P();
  };
  const Square origin = V(X::Zero());
  EXPECT_LE((origin - ekf.P()).norm(), 1e-10 * origin.norm());
  double last = 0;
  for (double size = 0.4; size > 0.01; size /= 2) {
    const double distance = (V({0.6 * size, -0.8 * size}) - origin).norm();
    if (last > 0) {
      EXPECT_NEAR(last / distance, 4, 0.5) << size;
    }
    last = distance;
  }
}

template <typename Filter, typename Signal>
void expect_refused(Filter& filter, const Signal& y, double dt, jml::Status status) {
  const auto x = filter.x();
  const auto V = filter.P();
  const double time = filter.time();
  EXPECT_EQ(filter.step(FoldedSignal{}, y, dt).status, status) << jml::describe(status);
  EXPECT_EQ(filter.x(), x);
  EXPECT_EQ(filter.P(), V);
  EXPECT_EQ(filter.time(), time);
}

TEST(AlgebraicFilter, refusesByNameAndStaysWhereItWas) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  jml::Filter filter{jml::Algebraic{jml::Sddre{}}, Cubic{}, Scalar1(0.5)};
  EXPECT_EQ(filter.step(FoldedSignal{}, 0.375, 0.01).status, jml::Status::ok);
  expect_refused(filter, nan, 0.01, jml::Status::invalid_measurement);
  expect_refused(filter, jml::Line{0.3, nan}, 0.01, jml::Status::invalid_measurement);
  expect_refused(filter, [nan](double) { return Scalar1(nan); }, 0.01, jml::Status::invalid_measurement);
  expect_refused(filter, 0.3, -0.01, jml::Status::invalid_time_step);
  expect_refused(filter, 0.3, nan, jml::Status::invalid_time_step);
  expect_refused(filter, 0.3, 10.0, jml::Status::step_too_long);
  EXPECT_EQ(filter.step(FoldedSignal{}, 0.3, 0.0).status, jml::Status::ok);
  EXPECT_EQ(filter.step(FoldedSignal{-1.0}, 0.3, 0.01).status, jml::Status::invalid_noise_covariance);

  // At x = 1 the measurement does not depend on the state through its SDC, and f is unstable: no gain helps.
  jml::Filter unset{jml::Algebraic{jml::Sddre{}}, Cubic{}, Scalar1(0.5)};
  unset.method().options.substeps = 0;  // after the start has looked at it
  EXPECT_EQ(unset.predict(0.1), jml::Status::invalid_option);
  EXPECT_EQ(unset.x(), Scalar1(0.5));
  jml::Filter blind{jml::Algebraic{jml::Sddre{}}, Cubic{.a = 0.5}, Scalar1(1.0)};
  expect_refused(blind, 0.0, 0.01, jml::Status::no_stabilizing_solution);

  jml::Filter lost{jml::Algebraic{jml::Sddre{}}, Cubic{}, Scalar1(nan)};
  EXPECT_EQ(lost.status(), jml::Status::invalid_state);
  EXPECT_EQ(lost.step(FoldedSignal{}, 0.3, 0.01).status, jml::Status::invalid_state);
  EXPECT_EQ(lost.reset(Scalar1(0.1), 0), jml::Status::ok);
  EXPECT_EQ(lost.step(FoldedSignal{}, 0.1, 0.01).status, jml::Status::ok);
  jml::Filter indefinite{jml::Algebraic{jml::Sddre{}}, Cubic{.q = -1}, Scalar1(0.1)};
  EXPECT_EQ(indefinite.step(FoldedSignal{}, 0.1, 0.01).status, jml::Status::invalid_disturbance_covariance);
}

TEST(AlgebraicFilter, gatesSamples) {
  jml::Filter filter{jml::Algebraic{jml::Sddre{}}, Cubic{.a = -0.5}, Scalar1(0.1)};
  filter.gate = {0.999};
  auto report = filter.step(FoldedSamples{}, 0.1, 0.1);
  EXPECT_EQ(report.gate, jml::Verdict::accepted);
  const double before = filter.x()(0);
  report = filter.step(FoldedSamples{}, 50.0, 0.1);
  EXPECT_EQ(report.status, jml::Status::ok);
  EXPECT_EQ(report.gate, jml::Verdict::rejected);
  EXPECT_NEAR(filter.x()(0), before * std::exp(-0.05), 1e-8);  // f alone; one Runge-Kutta step
}

// One cold solution at the start, warm ones along a trajectory.
TEST(AlgebraicFilter, startsEachSolutionFromTheLast) {
  const models::SaturatingSignal sensor{1e-3};
  jml::Filter filter{jml::Algebraic{jml::Rnls{}}, models::Oscillator{.c = 0.1, .k = 1}, jml::Vector<double, 2>(1, 0.5)};
  int cold = 0, solutions = 0;
  for (int i = 0; i < 500; ++i) {
    const auto report = filter.step(sensor, 0.6 * std::sin(0.005 * i + 0.8), 0.005);
    ASSERT_EQ(report.status, jml::Status::ok) << jml::describe(report.status);
    cold += report.cold;
    solutions += report.solutions;
  }
  EXPECT_EQ(solutions, 2000);
  EXPECT_EQ(cold, 1);
  EXPECT_GT(std::abs(filter.P()(0, 1) - filter.P()(1, 0)), 1e-5);  // and V is not symmetric
}

// reset() forgets the last solution: a correction alone has no gain before the next.
TEST(AlgebraicFilter, resetForgetsTheLastSolution) {
  jml::Filter filter{jml::Algebraic{jml::Sddre{}}, Cubic{}, Scalar1(0.3)};
  EXPECT_EQ(filter.update(FoldedSamples{}, 0.2).status, jml::Status::invalid_time_step);
  ASSERT_EQ(filter.step(FoldedSamples{}, 0.2, 0.01).status, jml::Status::ok);
  EXPECT_EQ(filter.update(FoldedSamples{}, 0.2).status, jml::Status::ok);
  ASSERT_EQ(filter.reset(Scalar1(0.3), 0), jml::Status::ok);
  EXPECT_EQ(filter.P()(0, 0), 0);
  EXPECT_EQ(filter.update(FoldedSamples{}, 0.2).status, jml::Status::invalid_time_step);
  const auto report = filter.step(FoldedSamples{}, 0.2, 0.01);
  ASSERT_EQ(report.status, jml::Status::ok);
  EXPECT_GE(report.cold, 1);
}

}  // namespace
