// SPDX-License-Identifier: BSD-3-Clause
// Exact steps whose digits do not suffice: done again in twice as many, or refused, on problems with answers in
// closed form.
#include <gtest/gtest.h>

#include <jml/filter/filter.hpp>
#include <jml/iterated/factored_iterated.hpp>
#include <jml/model/part.hpp>

#include "iterated/quad_root.hpp"

namespace {

using jml::Status;
using Matrix2 = jml::Matrix<double, 2, 2>;
using Vector2 = jml::Vector<double, 2>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using Vector3 = jml::Vector<double, 3>;

struct Drift {
  static constexpr int states = 2, disturbances = 0;
  static constexpr bool linear = true;
  double dt = 0;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {x(0) + dt * x(1), x(1)};
  }
};
struct Position {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double r = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
};

/// A dense P cannot hold correlations nearer to singular than 2e-10: the plain form then says so.
template <typename Rule>
inline constexpr bool factored = requires { typename Rule::OnePassForm; };

/// P of a nonlinear model is another than by the Jacobians (here by 1 %); the root is the same.
template <typename Rule>
inline constexpr bool by_sdc = false;
template <>
inline constexpr bool by_sdc<jml::Iterated<jml::Sddre<>>> = true;
template <>
inline constexpr bool by_sdc<jml::Factored<jml::Iterated<jml::Sddre<>>>> = true;

template <typename Rule>
class IteratedDigits : public testing::Test {};
using Rules = testing::Types<jml::Iekf, jml::Iterated<jml::Ekf<>>, jml::Iterated<jml::Sddre<>>, jml::Factored<jml::Iekf>,
                             jml::Factored<jml::Iterated<jml::Ekf<>>>, jml::Factored<jml::Iterated<jml::Sddre<>>>>;
TYPED_TEST_SUITE(IteratedDigits, Rules);

// Known exactly, or to 1e-30: 0.1 (the double) is added ten thousand times, which in doubles ends 1.6e-10 too high. Every
// step is the inner rule's then, low digits and all.
TYPED_TEST(IteratedDigits, FollowsAKnownMotionInTwiceTheDigits) {
  for (const double variance : {0.0, 1e-60}) {
    jml::Filter filter{TypeParam{}, Drift{0.1}, jml::Estimate<double, 2>{Vector2(0, 1), variance * Matrix2::Identity()}};
    for (int k = 0; k < 10000; ++k) {
      if (k % 3 == 0) {
        ASSERT_EQ(filter.predict(), Status::ok);
        ASSERT_EQ(filter.update(Position{}, jml::Vector<double, 1>(0)).status, Status::ok);
      } else {
        ASSERT_EQ(filter.step(Position{}, jml::Vector<double, 1>(0)).status, Status::ok);
      }
    }
    EXPECT_NEAR(filter.x()(0), 1000, 64 * 2.3e-16 * 1000) << variance;
    EXPECT_EQ(filter.x()(1), 1);
  }
}

struct PositionAndSum {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return {x(0), x(0) + x(1)};
  }
  Matrix2 noise_covariance() const { return Matrix2::Identity(); }
};
// 16/2 is rejected by 99 % of one row, 6.63, and would pass with two, 9.21. x(1) is known exactly.
TYPED_TEST(IteratedDigits, GateOfAPartBesideAKnownState) {
  for (const bool moves : {false, true}) {
    jml::Filter filter{TypeParam{}, Drift{}, jml::Estimate<double, 2>{Vector2(0, 1), Vector2(1, 0).asDiagonal()}};
    filter.gate.probability = 0.99;
    const Vector2 y(4, 99);
    const auto sensor = jml::part(PositionAndSum{}, jml::only(0));
    const auto report = moves ? filter.step(sensor, y) : filter.update(sensor, y);
    EXPECT_EQ(report.status, Status::ok);
    EXPECT_EQ(report.degrees, 1);
    EXPECT_EQ(report.gate, jml::Verdict::rejected);
    EXPECT_EQ(filter.x(), Vector2(0, 1));
  }
}

// P_0 is 1/ε times R and more: four measurements make their mean.
TYPED_TEST(IteratedDigits, PriorFarAboveTheNoise) {
  Matrix2 P;
  P << 1e12, 0, 0, 1;
  jml::Filter filter{TypeParam{}, Drift{}, jml::Estimate{Vector2(0, 0), P}};
  for (const int y : {10, 11, 12, 13}) {
    const auto report = filter.step(Position{1e-6}, double(y));
    ASSERT_EQ(report.status, Status::ok) << jml::describe(report.status);
    EXPECT_NEAR(report.smoothed(0), filter.x()(0), 1e-12);
  }
  EXPECT_NEAR(filter.x()(0), 11.5, 1e-13);
  EXPECT_NEAR(filter.P()(0, 0) / 2.5e-7, 1, 1e-12);
  EXPECT_EQ(filter.P()(1, 1), 1);
}

// 4.9 s of coasting from ±1000, then a position to 1e-7.
TYPED_TEST(IteratedDigits, LongCoast) {
  jml::Filter filter{TypeParam{}, Drift{0.1}, jml::Estimate{Vector2(0, 0), 1e6 * Matrix2::Identity()}};
  for (int k = 0; k < 49; ++k) ASSERT_EQ(filter.predict(), Status::ok);
  ASSERT_EQ(filter.step(Position{1e-14}, 1.0).status, Status::ok);
  EXPECT_NEAR(filter.P()(0, 0) / 1e-14, 1, 1e-9);
  EXPECT_NEAR(filter.P()(1, 1) / (1e6 / 26), 1, 1e-9);  // 1e6 (1 - t²/(1 + t²)), t = 5
  EXPECT_NEAR(filter.x()(0), 1, 1e-12);
  EXPECT_NEAR(filter.x()(1), 5.0 / 26, 1e-9);
}

struct Still {
  static constexpr int states = 3, disturbances = 0;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x) const {
    return x;
  }
};
template <bool wraps>
struct Pair {
  static constexpr int measurements = 2;
  static constexpr bool linear = !wraps;
  double d = 0;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 3>& x) const {
    const T a = x(0) + x(1) + x(2), b = x(0) + x(1) + (1 + d) * x(2);
    return {a, b};
  }
  jml::Matrix<double, 2, 2> noise_covariance() const { return d * d * Matrix2::Identity(); }
};

// The rows (1 1 1) and (1 1 1+d) with R = d² I, P_0 = I: S is singular to rounding from d = 1e-8 on.
template <typename Rule, typename Sensor>
void expect_pair(double d, double bound) {
  jml::Filter filter{Rule{}, Still{}, jml::Estimate{Vector3(0, 0, 0), Matrix3::Identity()}};
  const double u = 1 + d, w = u - 1;  // what the sensor's doubles say
  const auto report = filter.step(Sensor{d}, Vector2(d, 2 * d));
  if (!factored<Rule> && d < 5e-5) {
    EXPECT_EQ(report.status, Status::covariance_lost) << d;
    return;
  }
  ASSERT_TRUE(jml::usable(report.status)) << d << ' ' << jml::describe(report.status);
  // P⁺ = (I + Hᵀ H / d²)⁻¹ in 113 bits, of (a, a) = (x0 + x1)/√2 and x2.
  using quad_root::Quad;
  const Quad r = Quad(d) * d, A = 1 + 4 / r, B = (Quad(1) + u) * sqrtq(2) / r, C = 1 + (1 + Quad(u) * u) / r;
  const Quad det = A * C - B * B;
  EXPECT_NEAR(filter.P()(2, 2) / static_cast<double>(A / det), 1, bound) << d;
  EXPECT_NEAR(filter.P()(0, 0) / static_cast<double>((1 + C / det) / 2), 1, bound) << d;
  // x⁺ = P⁺ Hᵀ y / d²
  const Quad ha = sqrtq(2) * 3 * d / r, hc = (Quad(d) + Quad(u) * 2 * d) / r;
  EXPECT_NEAR(filter.x()(2), static_cast<double>((A * hc - B * ha) / det), bound) << d << ' ' << w;
}
TYPED_TEST(IteratedDigits, NearlyParallelRows) {
  for (int k = 4; k <= 10; ++k) expect_pair<TypeParam, Pair<false>>(std::pow(10, -k), 1e-5);
}
TYPED_TEST(IteratedDigits, NearlyParallelRowsOfAModelNotKnownToBeLinear) {
  for (int k = 4; k <= 8; ++k) expect_pair<TypeParam, Pair<true>>(std::pow(10, -k), 1e-5);
}

// A range or a saturating sensor far better than the prior, against Newton in 113 bits.
template <typename Rule>
void expect_root(quad_root::Shape kind, double r, double p0) {
  quad_root::Motion<2> motion;
  motion.F = {1, 0.5, 0, 1};
  motion.a = {0.5, 1};
  motion.b = {0.3, -0.4};
  motion.c = 0.2;
  motion.q = {0, 1e-3};
  quad_root::Rows<2, 1> rows;
  rows.h = {0.8, 0.3};
  rows.r = {r};
  rows.kind = kind;
  jml::Filter filter{Rule{}, motion, jml::Estimate{Vector2(0.7, -0.2), Matrix2{{p0, 0}, {0, 1e-2}}}};
  using Step = quad_root::Step<2, 1>;
  constexpr bool once = requires { Rule::measurement_only; } || std::is_same_v<Rule, jml::Factored<jml::Iekf>>;
  Step step{motion, rows, {0.7, -0.2}, {}, {0.55}, once ? Step::Kind::before : Step::Kind::joint};
  step.y[0] = 0.55 + (kind == quad_root::Shape::range ? 1 : 0);
  step.P[0][0] = p0;
  step.P[1][1] = 1e-2;
  const auto report = filter.step(rows, static_cast<double>(step.y[0]));
  if (!factored<Rule> && r < 1e-15) {
    EXPECT_EQ(report.status, Status::covariance_lost) << r << ' ' << p0 << ' ' << jml::describe(report.status);
    return;
  }
  ASSERT_TRUE(jml::usable(report.status)) << r << ' ' << p0 << ' ' << jml::describe(report.status);
  const auto exact = step.find({report.smoothed(0), report.smoothed(1)}, {filter.x()(0), filter.x()(1)});
  ASSERT_TRUE(exact.converged);
  for (int i = 0; i < 2; ++i) {
    const auto sd = static_cast<double>(sqrtq(exact.P[i][i]));
    EXPECT_NEAR(filter.x()(i), static_cast<double>(exact.x[i]), 1e-3 * sd + 1e-14) << r << ' ' << p0;
    EXPECT_NEAR(filter.P()(i, i) / (sd * sd), 1, by_sdc<Rule> ? 0.2 : 1e-5) << r << ' ' << p0;
  }
}
TYPED_TEST(IteratedDigits, NonlinearRoots) {
  for (const auto kind : {quad_root::Shape::saturation, quad_root::Shape::range, quad_root::Shape::wave}) {
    for (const double r : {1e-6, 1e-12, 1e-18}) expect_root<TypeParam>(kind, r, 0.04);
  }
  for (const double p0 : {1.0, 1e3, 1e6}) expect_root<TypeParam>(quad_root::Shape::wave, 1e-12, p0);
}

// Of a linear model the factored iterated rule is the factored Kalman filter.
TEST(FactoredIterated, IsTheKalmanFilterOnALinearModel) {
  for (const double r : {1.0, 1e-6, 1e-14}) {
    const jml::Estimate start{Vector2(0.3, -1), Matrix2(1e4 * Matrix2::Identity())};
    jml::Filter kalman{jml::Factored{jml::Kalman{}}, Drift{0.1}, start};
    jml::Filter iekf{jml::Factored{jml::Iekf{}}, Drift{0.1}, start};
    jml::Filter joint{jml::Factored{jml::Iterated<jml::Ekf<>>{}}, Drift{0.1}, start};
    for (int k = 0; k < 20; ++k) {
      const double y = std::sin(0.3 * k);
      const auto one = kalman.step(Position{r}, y);
      const auto other = iekf.step(Position{r}, y);
      const auto third = joint.step(Position{r}, y);
      ASSERT_EQ(one.status, Status::ok);
      ASSERT_EQ(other.status, Status::ok);
      ASSERT_EQ(third.status, Status::ok);
      EXPECT_EQ(one.redone, other.redone);
      // Where they go over to twice the digits they do so by ways of their own.
      const double share = one.redone ? 1e-13 : 0;
      EXPECT_NEAR(one.nis(), other.nis(), share * one.nis());
      for (const auto* another : {&iekf.belief(), &joint.belief()}) {
        for (int i = 0; i < 2; ++i) {
          EXPECT_NEAR(kalman.x()(i), another->x(i), share * std::abs(kalman.x()(i)));
          for (int j = 0; j < 2; ++j)
            EXPECT_NEAR(kalman.P()(i, j), another->P()(i, j), share * std::sqrt(kalman.P()(i, i) * kalman.P()(j, j)));
        }
      }
    }
  }
}

}  // namespace
