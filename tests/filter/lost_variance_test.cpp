// SPDX-License-Identifier: BSD-3-Clause
// Variances that the plain form N - K E N loses to rounding: never with a usable status. And what is given with a
// size that is known only at run time.
#include <gtest/gtest.h>

#include <jml/filter/factored.hpp>
#include <jml/iterated/iterated.hpp>
#include <jml/campaign/noise.hpp>
#include <vector>

namespace {

using namespace jml::operators;

using jml::Status;
using Vector2 = jml::Vector<double, 2>;
using Matrix2 = jml::Matrix<double, 2, 2>;

/// x⁺ = F x without disturbance.
template <typename Scalar>
struct Drift {
  static constexpr int states = 2, disturbances = 0;
  static constexpr bool linear = true;
  Scalar dt = 0;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + dt * x(1), x(1)};
  }
};
/// y = m0 x0 + m1 x1 + v.
template <typename Scalar>
struct Row {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  Scalar m0, m1, r;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(m0 * x(0) + m1 * x(1));
  }
  jml::Matrix<Scalar, 1, 1> noise_covariance() const { return jml::Matrix<Scalar, 1, 1>(r); }
};

template <typename Filter>
void expect_variances(const Filter& filter) {
  EXPECT_GT(filter.P()(0, 0), 0);
  EXPECT_GT(filter.P()(1, 1), 0);
}

/// P_0 is 1/ε² times R: the first state's variance cancels in N - K E N, and the step is done over again.
template <typename Scalar, typename Rule>
void expect_right(const Rule& rule, Scalar p0, Scalar r) {
  jml::Matrix<Scalar, 2, 2> P;
  P << p0, 0, 0, 1;
  jml::Filter filter{rule, Drift<Scalar>{}, jml::Estimate{jml::Vector<Scalar, 2>(0, 0), P}};
  int k = 0, redone = 0;
  for (const int y : {10, 11, 12, 13}) {
    const auto report = filter.step(Row<Scalar>{1, 0, r}, static_cast<Scalar>(y));
    ASSERT_TRUE(jml::usable(report.status)) << jml::describe(report.status);
    redone += report.redone;
    ++k;
    const Scalar exact = r / (static_cast<Scalar>(k) + r / p0);
    EXPECT_NEAR(static_cast<double>(filter.P()(0, 0) / exact), 1, 1e-5);
    EXPECT_EQ(filter.P()(1, 1), 1);
  }
  EXPECT_GE(redone, 1);  // the first one at least
  EXPECT_NEAR(static_cast<double>(filter.x()(0)), 11.5, 1e-5);
}
TEST(LostVariance, PriorFarAboveTheNoise) {
  expect_right<double>(jml::Kalman{}, 1e12, 1e-6);
  expect_right<double>(jml::Ekf{}, 1e12, 1e-6);
  expect_right<double>(jml::Jml{}, 1e12, 1e-6);
  expect_right<double>(jml::Iekf{}, 1e12, 1e-6);
  expect_right<float>(jml::Kalman{}, 1e10F, 1.0F);
}

// 4.9 s of prediction without noise make one sum of two states known to 1e-14: P = [0 0; 0 38461] was `ok`.
TEST(LostVariance, LongCoast) {
  jml::Filter filter{jml::Kalman{}, Drift<double>{0.1}, jml::Estimate{Vector2(0, 0), 1e6 * Matrix2::Identity()}};
  for (int k = 0; k < 49; ++k) ASSERT_EQ(filter.predict(), Status::ok);
  for (int k = 0; k < 3; ++k) {
    const Status status = filter.step(Row<double>{1, 0, 1e-14}, 1.0).status;
    if (jml::usable(status)) {
      expect_variances(filter);
    } else {
      EXPECT_EQ(status, Status::covariance_lost) << jml::describe(status);
    }
  }
}

// The correction leaves x0 + x1 known to 1e-8, and the prediction reads that sum. No matrix of doubles holds such
// a P: it is refused at once, and the factored form is right.
TEST(LostVariance, NegativeAfterPrediction) {
  Matrix2 P;
  P << 1, 0.3, 0.3, 3;
  const Row<double> sum{1, 1, 1e-16};
  jml::Filter filter{jml::Kalman{}, Drift<double>{1}, jml::Estimate{Vector2(0, 0), P}};
  const auto report = filter.update(sum, 0.0);
  EXPECT_EQ(report.status, Status::covariance_lost);
  EXPECT_TRUE(report.redone);
  EXPECT_EQ(filter.P(), P);
  jml::Filter iterated{jml::Iekf{}, Drift<double>{1}, jml::Estimate{Vector2(0, 0), P}};
  EXPECT_FALSE(jml::usable(iterated.update(sum, 0.0).status));
  jml::Filter factored{jml::Factored{jml::Kalman{}}, Drift<double>{1}, jml::Estimate{Vector2(0, 0), P}};
  ASSERT_EQ(factored.update(sum, 0.0).status, Status::ok);
  ASSERT_EQ(factored.predict(), Status::ok);
  EXPECT_NEAR(factored.P()(0, 0), 1e-16, 1e-21);  // the variance of x0 + x1: R / (1 + R/4.6)
  EXPECT_NEAR(factored.P()(1, 1), 3 - 3.3 * 3.3 / 4.6, 1e-12);
}

struct Tenfold {
  static constexpr int states = 2, disturbances = 2;
  static constexpr bool linear = true;
  jml::Vector<double, 2> dynamics(const jml::Vector<double, 2>& x) const { return {10 * x(0), x(1)}; }
  Matrix2 dynamics_jacobian(const jml::Vector<double, 2>&) const { return Vector2(10, 1).asDiagonal(); }
  Matrix2 disturbance_covariance() const { return Matrix2::Identity(); }
};
// x0 grows tenfold a step, and its variance a hundredfold: it is P that overflows, at step 154, and not the dynamics.
TEST(LostVariance, AnOverflowOfPIsNamed) {
  jml::Filter filter{jml::Kalman{}, Tenfold{}, jml::Estimate{Vector2(1, 1), Matrix2(Matrix2::Identity())}};
  Status status = Status::ok;
  int steps = 0;
  for (; status == Status::ok && steps < 200; ++steps) status = filter.predict();
  EXPECT_EQ(status, Status::covariance_lost) << jml::describe(status);
  EXPECT_NEAR(steps, 154, 1);
}

// The family: pairs of rows and of R over thirty decades. Whatever is answered, a usable status never stands over
// a variance that is zero or negative, and a refusal changes nothing.
TEST(LostVariance, NeverWithAUsableStatus) {
  jml::Noise noise(71);
  int refused = 0, used = 0;
  for (int run = 0; run < 20000; ++run) {
    Matrix2 P = Matrix2::Zero();
    P(0, 0) = std::pow(10, noise.uniform(-8, 8));
    P(1, 1) = std::pow(10, noise.uniform(-8, 8));
    jml::Filter filter{jml::Kalman{}, Drift<double>{noise.uniform(-1, 1)}, jml::Estimate{Vector2(1, -1), P}};
    if (run % 2 == 1) filter.gate = {0.9};
    for (int k = 0; k < 6; ++k) {
      const auto before = filter.estimate();
      Row<double> row{noise.uniform(-1, 1), noise.uniform(-1, 1), std::pow(10, noise.uniform(-30, 0))};
      if (noise.uniform() > 0.5) row = {1, 1, row.r};
      const double y = noise.uniform(-3, 3);
      const Status status = k % 3 == 0 ? filter.predict() : k % 3 == 1 ? filter.update(row, y).status : filter.step(row, y).status;
      if (jml::usable(status)) {
        ++used;
        ASSERT_TRUE(filter.P()(0, 0) > 0 && filter.P()(1, 1) > 0) << run << ", " << k << '\n' << filter.P();
      } else {
        ++refused;
        ASSERT_TRUE(filter.x() == before.x && filter.P() == before.P) << run << ", " << k;
      }
    }
  }
  EXPECT_GT(refused, 1000);  // the generator reaches them
  EXPECT_GT(used, 50000);
}

// A state that is known stays known: its zero is no loss.
TEST(LostVariance, KnownStatesStayKnown) {
  Matrix2 P = Matrix2::Zero();
  P(0, 0) = 2;
  jml::Filter filter{jml::Kalman{}, Drift<double>{0}, jml::Estimate{Vector2(0, 5), P}};
  ASSERT_EQ(filter.step(Row<double>{1, 1, 2}, 6.0).status, Status::ok);
  EXPECT_EQ(filter.P()(1, 1), 0);
  EXPECT_DOUBLE_EQ(filter.P()(0, 0), 1);
  EXPECT_DOUBLE_EQ(filter.x()(0), 0.5);
  EXPECT_EQ(filter.x()(1), 5);
}

// y, control and estimate of a size that is known only at run time: the right one serves, a wrong one is refused by
// its own name, and nothing beyond it is read.
struct Driven {
  static constexpr int states = 2, disturbances = 0, controls = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const jml::StepContext<double, 2>& at) const {
    return {x(0) + at.control(0), x(1) + at.control(1)};
  }
};
template <typename Filter>
void expect_sizes_checked(Filter filter) {
  const Row<double> row{1, 0, 1};
  const auto before = filter.estimate();
  for (const int size : {0, 2, 3, 40}) {
    const Eigen::VectorXd y = Eigen::VectorXd::Ones(size);
    EXPECT_EQ(filter.update(row, y).status, Status::invalid_measurement) << size;
    EXPECT_EQ(filter.update(row, y.head(size)).status, Status::invalid_measurement) << size;
    EXPECT_EQ(filter.step(row, y, 0.1, Eigen::VectorXd::Zero(2)).status, Status::invalid_measurement) << size;
    if (size == 2) continue;
    EXPECT_EQ(filter.predict(0.1, Eigen::VectorXd::Zero(size)), Status::invalid_control) << size;
    EXPECT_EQ(filter.step(row, 1.0, 0.1, Eigen::VectorXd::Zero(size)).status, Status::invalid_control) << size;
  }
  EXPECT_EQ(filter.update(row, Eigen::MatrixXd::Ones(2, 2)).status, Status::invalid_measurement);
  EXPECT_EQ(filter.x(), before.x);
  EXPECT_EQ(filter.P(), before.P);
  EXPECT_EQ(filter.time(), 0);
  const std::vector<double> raw{0.5, 7};
  EXPECT_EQ(filter.update(row, Eigen::VectorXd::Constant(1, 0.5)).status, Status::ok);
  EXPECT_EQ(filter.update(row, Eigen::Map<const Eigen::VectorXd>(raw.data(), 1)).status, Status::ok);
  EXPECT_EQ(filter.step(row, 0.5, 0.1, Eigen::VectorXd::Ones(2)).status, Status::ok);
  EXPECT_DOUBLE_EQ(filter.x()(1), 6);
}
TEST(RunTimeSizes, Checked) {
  expect_sizes_checked(jml::Filter{jml::Ekf{}, Driven{}, jml::Estimate{Vector2(0, 5), Matrix2::Identity()}});
}
TEST(RunTimeSizes, OfTheEstimate) {
  using Estimate = jml::Estimate<double, 2>;
  const auto status_of = [](const Estimate& estimate) {
    return jml::Filter{jml::Ekf{}, Drift<double>{}, estimate}.status();
  };
  const Eigen::VectorXd two = Eigen::VectorXd::Ones(2), three = Eigen::VectorXd::Ones(3);
  const Eigen::MatrixXd good = Eigen::MatrixXd::Identity(2, 2), flat = Eigen::MatrixXd::Identity(1, 4);
  EXPECT_EQ(status_of(Estimate{two, good}), Status::ok);
  EXPECT_EQ(status_of(Estimate{three, good}), Status::invalid_state);
  EXPECT_EQ(status_of(Estimate{two.head(1), good}), Status::invalid_state);
  EXPECT_EQ(status_of(Estimate{two, flat}), Status::invalid_covariance);
  EXPECT_EQ(status_of(Estimate{two, Eigen::MatrixXd::Identity(3, 3)}), Status::invalid_covariance);
}

}  // namespace
