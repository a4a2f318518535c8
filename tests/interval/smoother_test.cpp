// SPDX-License-Identifier: BSD-3-Clause
// The fixed-interval smoother on linear systems against an oracle that shares nothing with it: all states and
// measurements as one Gaussian, conditioned by one dense solve.
#include <gtest/gtest.h>

#include <jml/interval/smoother.hpp>
#include <vector>

#include "figure.hpp"
#include "models/linear.hpp"
#include "riccati/oracle.hpp"

namespace {

using namespace jml::operators;

using jml::Status;
using oracle::big;
using oracle::Big;

// S of all measurements together has a condition number of up to 3300.
constexpr double tolerance = 1e-12;

/// All states x_0 … x_k stacked, in long double.
class Joint {
 public:
  Joint(const Big& mean, const Big& covariance) : mean_(mean), covariance_(covariance), n_(mean.rows()) {}

  void step(const Big& F, const Big& noise) {
    const Eigen::Index size = mean_.rows();
    Big mean(size + n_, 1), covariance(size + n_, size + n_);
    mean << mean_, F * mean_.bottomRows(n_);
    const Big across = F * covariance_.bottomRows(n_);
    covariance << covariance_, across.transpose(), across,
        F * covariance_.bottomRightCorner(n_, n_) * F.transpose() + noise;
    mean_ = mean;
    covariance_ = covariance;
  }
  void measure(const Big& M, const Big& R, const Big& y) { rows_.push_back({mean_.rows() - n_, M, R, y}); }

  /// Conditions on all measurements at once.
  void condition() {
    Eigen::Index count = 0;
    for (const Row& row : rows_) count += row.M.rows();
    Big M = Big::Zero(count, mean_.rows()), R = Big::Zero(count, count), y(count, 1);
    Eigen::Index at = 0;
    for (const Row& row : rows_) {
      const Eigen::Index p = row.M.rows();
      M.block(at, row.state, p, n_) = row.M;
      R.block(at, at, p, p) = row.R;
      y.middleRows(at, p) = row.y;
      at += p;
    }
    const Big MC = M * covariance_;
    const Eigen::PartialPivLU<Big> S(Big(MC * M.transpose() + R));
    x = mean_ + MC.transpose() * S.solve(Big(y - M * mean_));
    P = covariance_ - MC.transpose() * S.solve(MC);
  }
  Big x_of(int k) const { return x.middleRows(k * n_, n_); }
  Big P_of(int k) const { return P.block(k * n_, k * n_, n_, n_); }

  Big x, P;

 private:
  struct Row {
    Eigen::Index state;
    Big M, R, y;
  };
  Big mean_, covariance_;
  Eigen::Index n_;
  std::vector<Row> rows_;
};

struct Schedule {
  bool known_start = false, rank_one = false, gaps = false, second_sensor = false;
};

constexpr int steps = 14;

/// The smoother says what conditioning says, at every node.
template <typename Smoother>
void expect_conditioned(Smoother& smoother, Joint joint, const char* when) {
  SCOPED_TRACE(when);
  joint.condition();
  ASSERT_EQ(smoother.smooth(), Status::ok);
  double worst_x = 0, worst_P = 0;
  for (int k = 0; k < smoother.samples(); ++k) {
    worst_x = std::max(worst_x, oracle::distance(smoother.x(k), joint.x_of(k)));
    worst_P = std::max(worst_P, oracle::distance(smoother.P(k), joint.P_of(k)));
    EXPECT_TRUE((smoother.P(k).array() == smoother.P(k).transpose().array()).all()) << "node " << k;
  }
  EXPECT_LT(worst_x, tolerance);
  EXPECT_LT(worst_P, tolerance);
}

/// A run with step(), or predict() and update(), from a prior that is measured before the first step.
template <typename Rule>
void check(const Rule& rule, const char* name, const Schedule& schedule, unsigned seed) {
  SCOPED_TRACE(name);
  jml::Noise noise(seed);
  auto dynamics = models::random_linear_dynamics<4, 2>(noise);
  const auto sensor = models::random_linear_sensor<4, 2>(noise);
  const auto other = models::random_linear_sensor<4, 1>(noise);
  jml::Estimate<double, 4> start{models::random_matrix<4, 1>(noise),
                                 models::random_covariance<4>(noise, 0.1)};
  if (schedule.known_start) start.P.setZero();
  if (schedule.rank_one) dynamics.G.col(1).setZero();
  const Big F = big(dynamics.F), GQG = big(dynamics.G) * big(dynamics.Q) * big(dynamics.G).transpose();

  jml::Smoother smoother{jml::Filter{rule, dynamics, start}, steps};
  Joint joint(big(start.x), big(start.P));
  const auto measured = [&](const auto& by, const auto& y) { joint.measure(big(by.M), big(by.R), big(y)); };
  const jml::Vector<double, 1> first(0.3);
  ASSERT_EQ(smoother.update(other, first(0)).status, Status::ok);
  measured(other, first);
  for (int i = 0; i < steps; ++i) {
    const jml::Vector<double, 2> y = 2 * models::random_matrix<2, 1>(noise);
    const jml::Vector<double, 1> z = 2 * models::random_matrix<1, 1>(noise);
    joint.step(F, GQG);
    if (schedule.gaps && i % 3 != 1) {
      ASSERT_EQ(smoother.predict(), Status::ok);
    } else {
      ASSERT_EQ(smoother.step(sensor, y).status, Status::ok);
      measured(sensor, y);
    }
    if (schedule.second_sensor && i % 2 == 1) {
      ASSERT_EQ(smoother.update(other, z).status, Status::ok);
      measured(other, z);
    }
    if (i == steps / 2) expect_conditioned(smoother, joint, "halfway");
  }
  EXPECT_EQ(smoother.samples(), steps + 1);
  expect_conditioned(smoother, joint, "at the end");
  EXPECT_EQ(smoother.x(steps), smoother.filter().x());
  EXPECT_EQ(smoother.P(steps), smoother.filter().P());
}

void check_all(const Schedule& schedule) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    check(jml::Factored{jml::Kalman{}}, "factored", schedule, seed);
    // P gains its rank step by step: more than the plain form can hold on the way.
    if (schedule.known_start && schedule.rank_one) continue;
    check(jml::Kalman{}, "Kalman", schedule, seed);
    check(jml::Ekf{}, "EKF", schedule, seed);
    check(jml::Sddre{}, "SDDRE", schedule, seed);
  }
}

TEST(LinearSmoother, OneSensor) { check_all({}); }
TEST(LinearSmoother, StartKnownExactly) { check_all({.known_start = true}); }
TEST(LinearSmoother, NoiseOfRankOne) { check_all({.rank_one = true}); }
TEST(LinearSmoother, StartKnownExactlyAndNoiseOfRankOne) {
  check_all({.known_start = true, .rank_one = true});
}
TEST(LinearSmoother, MissingMeasurements) { check_all({.gaps = true}); }
TEST(LinearSmoother, TwoSensorsAtOneInstant) { check_all({.second_sensor = true}); }
TEST(LinearSmoother, EverythingAtOnce) {
  check_all({.known_start = true, .rank_one = true, .gaps = true, .second_sensor = true});
}

template <typename Rule>
void check_irregular(const Rule& rule, const char* name) {
  SCOPED_TRACE(name);
  jml::Noise noise(7);
  const models::ConstantVelocity dynamics;
  models::LinearSensor<4, 2> sensor;
  sensor.M << 1, 0, 0.2, 0, 0, 0.1, 1, 0;
  sensor.R << 2, 0.5, 0.5, 1;
  const jml::Estimate<double, 4> start{jml::Vector<double, 4>(1, 2, -3, 1),
                                       2 * jml::Matrix<double, 4, 4>::Identity()};
  jml::Smoother smoother{jml::Filter{rule, dynamics, start, 100.0}, steps};
  Joint joint(big(start.x), big(start.P));
  long double time = 100;
  for (int i = 0; i < steps; ++i) {
    const double dt = i % 5 == 2 ? 0.0 : noise.uniform(0.05, 2);
    const jml::Vector<double, 2> y = 3 * models::random_matrix<2, 1>(noise);
    Big F = Big::Identity(4, 4), Q = Big::Zero(4, 4);
    const long double h = dt, density = dynamics.q_c;
    for (int a = 0; a < 4; a += 2) {
      F(a, a + 1) = h;
      Q(a, a) = density * h * h * h / 3;
      Q(a, a + 1) = Q(a + 1, a) = density * h * h / 2;
      Q(a + 1, a + 1) = density * h;
    }
    joint.step(F, Q);
    if (i % 4 == 3) {
      ASSERT_EQ(smoother.predict(dt), Status::ok);
    } else {
      ASSERT_EQ(smoother.step(sensor, y, dt).status, Status::ok);
      joint.measure(big(sensor.M), big(sensor.R), big(y));
    }
    time += dt;
    EXPECT_DOUBLE_EQ(smoother.time(i + 1), static_cast<double>(time));
  }
  EXPECT_EQ(smoother.time(0), 100);
  expect_conditioned(smoother, joint, "at the end");
}
TEST(LinearSmoother, IrregularSteps) {
  check_irregular(jml::Kalman{}, "Kalman");
  check_irregular(jml::Ekf{}, "EKF");
  check_irregular(jml::Sddre{}, "SDDRE");
}

/// x is constant, y = x + v.
struct Constant {
  static constexpr int states = 1, disturbances = 0;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
};
const models::LinearSensor<1, 1> unit{jml::Matrix<double, 1, 1>(1), jml::Matrix<double, 1, 1>(1)};

jml::Smoother<jml::Kalman, Constant> ten_measurements(double P) {
  jml::Smoother smoother{jml::Filter{jml::Kalman{}, Constant{},
                                     jml::Estimate{jml::Vector<double, 1>(0), jml::Matrix<double, 1, 1>(P)}},
                         10};
  for (int i = 0; i < 10; ++i) EXPECT_EQ(smoother.step(unit, 3.0 + i).status, Status::ok);
  return smoother;
}

// Closed form: with ten measurements of variance 1 every node has 1/P_s = 1/P_0 + 10, x_s = P_s Σ y. However much
// better the measurements are than the prior, nothing is subtracted and no digit is lost.
TEST(LinearSmoother, KeepsTheDigitsThatTheMeasurementsTakeFromTheVariance) {
  for (const double P : {0.0, 1.0, 1e3, 1e6, 1e9, 1e12}) {
    auto smoother = ten_measurements(P);
    ASSERT_EQ(smoother.smooth(), Status::ok);
    const double variance = P / (1 + 10 * P);
    // Node 0 has P_0 itself; from node 1 on the filter's P = P_0 - P_0²/(P_0 + 1) has lost digits, and with it x̂.
    for (int k = 0; k <= 10; ++k) {
      const double asked = (k == 0 ? 1e-14 : 1e-14 + 4 * std::numeric_limits<double>::epsilon() * P) * variance;
      EXPECT_NEAR(smoother.P(k)(0, 0), variance, asked) << P << ", node " << k;
      if (k > 0) continue;
      EXPECT_NEAR(smoother.x(k)(0), variance * 75, 75 * asked) << P;
    }
  }
}

// Past that the filter's own digits do not suffice, and it takes twice as many: every node is right.
TEST(LinearSmoother, TakesTwiceTheDigitsWhereNoneIsLeft) {
  for (const double P : {1e15, 1e20, 1e24}) {
    auto smoother = ten_measurements(P);
    ASSERT_EQ(smoother.smooth(), Status::ok);
    for (int k = 0; k <= 10; ++k) {
      EXPECT_NEAR(smoother.P(k)(0, 0), 0.1, 1e-8) << P << ", node " << k;
      EXPECT_NEAR(smoother.x(k)(0), 7.5, 1e-7) << P << ", node " << k;
    }
  }
}

TEST(LinearSmoother, InSinglePrecision) {
  jml::Noise noise(3);
  const auto dynamics = models::random_linear_dynamics<4, 2>(noise);
  const auto sensor = models::random_linear_sensor<4, 2>(noise);
  const jml::Estimate<double, 4> prior{models::random_matrix<4, 1>(noise),
                                       models::random_covariance<4>(noise, 0.1)};
  jml::Smoother wanted{jml::Filter{jml::Kalman{}, dynamics, prior}, steps};
  const jml::Estimate<float, 4> single{prior.x.cast<float>(), prior.P.cast<float>()};
  jml::Smoother smoother{jml::Filter{jml::Kalman{}, dynamics, single}, steps};
  for (int i = 0; i < steps; ++i) {
    const jml::Vector<double, 2> y = models::random_matrix<2, 1>(noise);
    EXPECT_EQ(smoother.step(sensor, y.cast<float>()).status, Status::ok);
    EXPECT_EQ(wanted.step(sensor, y).status, Status::ok);
  }
  EXPECT_EQ(smoother.smooth(), Status::ok);
  EXPECT_EQ(wanted.smooth(), Status::ok);
  for (int k = 0; k <= steps; ++k) {  // 1e-5: a hundred roundings of a float
    EXPECT_LT(oracle::distance(smoother.x(k), big(wanted.x(k))), 1e-5);
    EXPECT_LT(oracle::distance(smoother.P(k), big(wanted.P(k))), 1e-5);
  }
}

/// Level, slope and a season of seven; shared by two roundings of the same problem.
struct Seasonal {
  static constexpr int states = 8, disturbances = 3;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 8> dynamics(const jml::Vector<T, 8>& x) const {
    jml::Vector<T, 8> next;
    next << x(0) + x(1), x(1), T(0), x(2), x(3), x(4), x(5), x(6);
    for (int i = 2; i < 8; ++i) next(2) -= x(i);
    return next;
  }
  jml::Matrix<double, 8, 3> disturbance_input() const { return jml::Matrix<double, 8, 3>::Identity(); }
  jml::Matrix<double, 3, 3> disturbance_covariance() const {
    return jml::Vector<double, 3>(0.5, 1e-3, 0.02).asDiagonal();
  }
};
struct SeasonalLevel {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 8>& x) const {
    return jml::Vector<T, 1>(x(0) + x(2));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.1); }
};

// A prior a million times too wide. P_s of the slope at the start is 0.0224358 (computed in long double and in
// multi-precision, independently of this library); the form that subtracts had 0.022213.
TEST(LinearSmoother, DigitsUnderAWidePrior) {
  jml::Smoother smoother{
      jml::Filter{jml::Factored{jml::Kalman{}}, Seasonal{},
                  jml::Estimate{jml::Vector<double, 8>(jml::Vector<double, 8>::Zero()),
                                jml::Matrix<double, 8, 8>(1e6 * jml::Matrix<double, 8, 8>::Identity())}},
      60};
  const double turn = 2 * 3.14159265358979324 / 7;
  for (int k = 0; k < 60; ++k) {
    const double y = 100 + 0.3 * k + 5 * std::sin(turn * k) + 2 * std::cos(2 * turn * k) + 0.2 * std::sin(11.3 * k);
    ASSERT_EQ(k == 0 ? smoother.update(SeasonalLevel{}, y).status : smoother.step(SeasonalLevel{}, y).status, Status::ok);
  }
  ASSERT_EQ(smoother.smooth(), Status::ok);
  figure::print("slope_variance", smoother.P(0)(1, 1));
  EXPECT_NEAR(smoother.P(0)(1, 1), 0.0224358, 5e-8);
}

}  // namespace
