// SPDX-License-Identifier: BSD-3-Clause
// The cubature filter of examples/write_your_own: the Kalman filter on linear systems, closed forms on
// polynomials, and angles that wrap.
#include "write_your_own/cubature.hpp"

#include <gtest/gtest.h>

#include <jml/campaign/noise.hpp>

#include "models/linear.hpp"

namespace {

using jml::Status;
template <int n>
using V = jml::Vector<double, n>;
template <int n, int m = n>
using M = jml::Matrix<double, n, m>;

/// Of the entries of P, in units of the deviations on its diagonal: free of the units of the states.
template <int n>
double distance(const jml::Estimate<double, n>& a, const jml::Estimate<double, n>& b, double scale) {
  double most = 0;
  for (int i = 0; i < n; ++i) {
    most = std::max(most, std::abs(a.x(i) - b.x(i)) / scale);
    for (int j = 0; j < n; ++j) most = std::max(most, std::abs(a.P(i, j) - b.P(i, j)) / (scale * scale));
  }
  return most;
}

struct Pushed : models::LinearDynamics<3, 2> {
  V<2> disturbance_mean() const { return {0.3, -0.2}; }
};

// Random systems with correlated R, and flights of steps, predictions and second measurements. P_0: regular,
// of rank one, or with one, two or all states known.
TEST(Cubature, IsTheKalmanFilterOnALinearSystem) {
  jml::Noise noise(1);
  double worst = 0;
  for (int run = 0; run < 300; ++run) {
    const Pushed dynamics{models::random_linear_dynamics<3, 2>(noise)};
    const auto sensor = models::random_linear_sensor<3, 2>(noise);
    M<3> L = models::random_matrix<3, 3>(noise);
    if (run % 5 == 4)
      L.leftCols(2).setZero();  // rank one
    else
      L.topRows(run % 5).setZero();  // states that are known
    const M<3> P = L * L.transpose();
    const jml::Estimate<double, 3> start{models::random_matrix<3, 1>(noise), jml::kernel::symmetric_part(P)};
    jml::Filter kalman{jml::Kalman{}, dynamics, start};
    jml::Filter cubature{own::Cubature{}, dynamics, start};
    for (int k = 0; k < 100; ++k) {
      const V<2> y = 2 * noise.normal_vector<2>();
      const double draw = noise.uniform();
      if (draw < 0.6) {
        const auto wanted = kalman.step(sensor, y), got = cubature.step(sensor, y);
        ASSERT_EQ(got.status, Status::ok) << run << ", " << k;
        ASSERT_LT((got.gain - wanted.gain).cwiseAbs().maxCoeff(), 1e-12);
        ASSERT_NEAR(got.nis(), wanted.nis(), 1e-11 * (1 + wanted.nis()));
        ASSERT_NEAR(got.log_likelihood(), wanted.log_likelihood(), 1e-11 * (1 + wanted.nis()));
      } else if (draw < 0.8) {
        ASSERT_EQ(cubature.predict(), kalman.predict());
      } else {
        ASSERT_EQ(cubature.update(sensor, y).status, kalman.update(sensor, y).status);
      }
      ASSERT_EQ(cubature.P(), cubature.P().transpose());
      worst = std::max(worst, distance<3>(cubature.estimate(), kalman.estimate(), 1));
    }
  }
  EXPECT_LT(worst, 1e-13);
  std::printf("  largest difference of x and P, which are near 1: %.1e\n", worst);
}

TEST(Cubature, AKnownStateStaysKnown) {
  jml::Noise noise(2);
  auto dynamics = models::random_linear_dynamics<3, 2>(noise);
  dynamics.Q.setZero();
  const V<3> x(1e6, -3, 0.7);
  jml::Filter filter{own::Cubature{}, dynamics, jml::Estimate<double, 3>{x}};
  const auto report = filter.step(models::random_linear_sensor<3, 2>(noise), V<2>(1, 2));
  EXPECT_EQ(report.status, Status::ok);
  EXPECT_EQ(filter.P(), M<3>(M<3>::Zero()));
  EXPECT_EQ(filter.x(), dynamics.dynamics(x));
}

/// f = (x₀³, x₀ x₁²), no disturbance.
struct Cubes {
  static constexpr int states = 2, disturbances = 0;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) * x(0) * x(0), x(0) * x(1) * x(1)};
  }
};
// E x₀³ = m₀³ + 3 m₀ P₀₀ and E x₀ x₁² = m₀ m₁² + m₀ P₁₁ + 2 m₁ P₀₁ of a normal x.
TEST(Cubature, MeanOfTheThirdDegreeIsExact) {
  const V<2> m(0.8, -1.3);
  const M<2> P = (M<2>() << 0.5, -0.2, -0.2, 0.9).finished();
  jml::Filter filter{own::Cubature{}, Cubes{}, jml::Estimate{m, P}};
  ASSERT_EQ(filter.predict(), Status::ok);
  EXPECT_NEAR(filter.x()(0), m(0) * m(0) * m(0) + 3 * m(0) * P(0, 0), 1e-14);
  EXPECT_NEAR(filter.x()(1), m(0) * m(1) * m(1) + m(0) * P(1, 1) + 2 * m(1) * P(0, 1), 1e-14);
}

struct Squared {  // y = x² + v
  static constexpr int measurements = 1;
  double r = 0.7;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0));
  }
  V<1> noise_covariance() const { return V<1>(r); }
};
struct Scalar {  // x⁺ = x² + w
  static constexpr int states = 1, disturbances = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0));
  }
  V<1> disturbance_covariance() const { return V<1>(0.1); }
};
// n = 1: the points are m ± s. Their squares are m² + s² ± 2 m s.
TEST(Cubature, OneStateByHand) {
  const double m = 1.7, s2 = 0.3, r = 0.7, y = 4;
  jml::Filter filter{own::Cubature{}, Scalar{}, jml::Estimate{V<1>(m), V<1>(s2)}};
  const auto report = filter.update(Squared{}, y);
  ASSERT_EQ(report.status, Status::ok);
  const double S = 4 * m * m * s2 + r, K = 2 * m * s2 / S;
  EXPECT_NEAR(report.innovation(0), y - m * m - s2, 1e-14);
  EXPECT_NEAR(report.innovation_matrix(0), S, 1e-14);
  EXPECT_NEAR(report.gain(0), K, 1e-15);
  EXPECT_NEAR(filter.x()(0), m + K * (y - m * m - s2), 1e-14);
  EXPECT_NEAR(filter.P()(0), s2 * r / S, 1e-15);

  filter.reset(jml::Estimate{V<1>(m), V<1>(s2)}, 0);
  ASSERT_EQ(filter.predict(), Status::ok);
  EXPECT_NEAR(filter.x()(0), m * m + s2, 1e-14);
  EXPECT_NEAR(filter.P()(0), 4 * m * m * s2 + 0.1, 1e-14);
}

TEST(Cubature, ARejectedMeasurementLeavesThePrediction) {
  jml::Filter filter{own::Cubature{}, Scalar{}, jml::Estimate{V<1>(1.7), V<1>(0.3)}}, predicted = filter;
  filter.gate = {0.99};
  ASSERT_EQ(predicted.predict(), Status::ok);
  const auto report = filter.step(Squared{}, 1e3);
  EXPECT_EQ(report.status, Status::ok);
  EXPECT_EQ(report.gate, jml::Verdict::rejected);
  EXPECT_EQ(filter.x(), predicted.x());
  EXPECT_EQ(filter.P(), predicted.P());
  EXPECT_EQ(filter.step(Squared{}, 11).gate, jml::Verdict::accepted);
}

/// The direction of a point of the plane, rad; where it `wraps`, differences are in [-π, π].
template <bool wraps>
struct Bearing {
  static constexpr int measurements = 1;
  static constexpr double pi = 3.141592653589793;
  double sd = 0.1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::atan2;
    return jml::Vector<T, 1>(atan2(x(1), x(0)));
  }
  template <typename T>
  jml::Vector<T, 1> residual(const jml::Vector<T, 1>& y, const jml::Vector<T, 1>& predicted) const
    requires wraps
  {
    return jml::Vector<T, 1>(std::remainder(y(0) - predicted(0), 2 * pi));
  }
  V<1> noise_covariance() const { return V<1>(sd * sd); }
};
struct Still {
  static constexpr int states = 2, disturbances = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return x;
  }
  M<2> disturbance_covariance() const { return 0.001 * M<2>::Identity(); }
};
// Ahead no bearing wraps, and no residual() is needed. The same scene turned by π lies on the cut: some
// points are at π, some at -π. What the filter finds must turn with it.
TEST(Cubature, BearingsOnTheCutAreAsGoodAsAhead) {
  constexpr double pi = Bearing<true>::pi;
  jml::Noise noise(3);
  int wrapped = 0;
  for (int run = 0; run < 100; ++run) {
    const V<2> x(3, 0.5 * noise.normal());
    const M<2> P = models::random_covariance<2>(noise, 0.1);
    jml::Filter ahead{own::Cubature{}, Still{}, jml::Estimate{x, P}};
    jml::Filter behind{own::Cubature{}, Still{}, jml::Estimate{V<2>(-x), P}};
    for (int k = 0; k < 10; ++k) {
      const double y = std::atan2(ahead.x()(1), ahead.x()(0)) + 0.1 * noise.normal();
      const double turned = y > 0 ? y - pi : y + pi;
      const auto wanted = ahead.step(Bearing<false>{}, y), got = behind.step(Bearing<true>{}, turned);
      ASSERT_EQ(got.status, Status::ok);
      ASSERT_NEAR(got.innovation(0), wanted.innovation(0), 1e-13);
      ASSERT_NEAR(got.innovation_matrix(0), wanted.innovation_matrix(0), 1e-13);
      ASSERT_LT((behind.x() + ahead.x()).norm(), 1e-12) << run << ", " << k;
      ASSERT_LT((behind.P() - ahead.P()).norm(), 1e-12);
      wrapped += std::abs(ahead.x()(1)) < std::sqrt(2 * ahead.P()(1, 1)) ? 1 : 0;
    }
  }
  EXPECT_GT(wrapped, 200) << "the points are on both sides";
}

// Filter's part of the work, which no method knows of.
TEST(Cubature, PartOfAMeasurement) {
  jml::Noise noise(4);
  const auto dynamics = models::random_linear_dynamics<3, 2>(noise);
  const auto sensor = models::random_linear_sensor<3, 2>(noise);
  models::LinearSensor<3, 1> second;
  second.M = sensor.M.row(1);
  second.R(0) = sensor.R(1, 1);
  const jml::Estimate<double, 3> start{V<3>(1, 2, 3), models::random_covariance<3>(noise, 0.1)};
  jml::Filter part{own::Cubature{}, dynamics, start}, whole = part;
  const auto got = part.update(sensor, V<2>(std::nan(""), 0.4), jml::only(1));
  const auto wanted = whole.update(second, 0.4);
  ASSERT_EQ(got.status, Status::ok);
  EXPECT_NEAR(got.nis(), wanted.nis(), 1e-14);
  EXPECT_LT(distance<3>(part.estimate(), whole.estimate(), 1), 1e-14);
}

TEST(Cubature, InFloat) {
  const V<2> x(3, 0.4);
  const M<2> P = 0.1 * M<2>::Identity();
  jml::Filter exact{own::Cubature{}, Still{}, jml::Estimate{x, P}};
  jml::Filter small{own::Cubature{}, Still{}, jml::Estimate<float, 2>{x.cast<float>(), P.cast<float>()}};
  for (int k = 0; k < 100; ++k) {
    const double y = 0.2 * std::sin(0.1 * k);
    ASSERT_EQ(exact.step(Bearing<false>{}, y).status, Status::ok);
    ASSERT_EQ(small.step(Bearing<false>{}, y).status, Status::ok);
    ASSERT_LT((small.x().cast<double>() - exact.x()).norm(), 1e-5) << k;
    ASSERT_LT((small.P().cast<double>() - exact.P()).norm(), 1e-5) << k;
  }
}

}  // namespace
