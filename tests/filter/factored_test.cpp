// SPDX-License-Identifier: BSD-3-Clause
// What the factored form takes beside the plain one: rows without noise, any R, masks, starts by factors and
// of nothing; and affine models, whose offsets keep their digits where a step is done over again. Values by
// hand.
#include <gtest/gtest.h>

#include <jml/filter/factored.hpp>

namespace {

using namespace jml::operators;

using jml::Status;
using Matrix2 = jml::Matrix<double, 2, 2>;
using Vector2 = jml::Vector<double, 2>;
constexpr double infinity = std::numeric_limits<double>::infinity();

Matrix2 matrix(double a, double b, double c, double d) {
  Matrix2 out;
  out << a, b, c, d;
  return out;
}

/// x⁺ = F x + offset + w.
struct Plant {
  static constexpr int states = 2, disturbances = 2;
  static constexpr bool linear = true;
  Matrix2 F = matrix(1, 0.5, 0, 1), Q = matrix(0.3, 0.1, 0.1, 0.2);
  Vector2 offset{0, 0};
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {F(0, 0) * x(0) + F(0, 1) * x(1) + offset(0), F(1, 0) * x(0) + F(1, 1) * x(1) + offset(1)};
  }
  Matrix2 dynamics_jacobian(const Vector2&) const { return F; }
  Matrix2 disturbance_covariance() const { return Q; }
};
/// y = H x + offset + v.
struct Sensor {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  Matrix2 H = matrix(1, 0, 1, 1), R = matrix(0.5, 0.2, 0.2, 0.4);
  Vector2 offset{0, 0};
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return {H(0, 0) * x(0) + H(0, 1) * x(1) + offset(0), H(1, 0) * x(0) + H(1, 1) * x(1) + offset(1)};
  }
  Matrix2 measurement_jacobian(const Vector2&) const { return H; }
  Matrix2 noise_covariance() const { return R; }
};

const jml::Estimate start{Vector2(1, -2), matrix(2, 0.3, 0.3, 1)};
template <typename Start>
auto factored(const Start& from, const Plant& plant = {}) {
  return jml::Filter<jml::Factored<jml::Kalman>, Plant>{jml::Factored{jml::Kalman{}}, plant, from};
}

// With a correlated R, a mask, a gate: as the plain form, in all that it reports.
TEST(Factored, ReportsWhatThePlainFormReports) {
  auto one = factored(start);
  jml::Filter other{jml::Kalman{}, Plant{}, start};
  one.gate = other.gate = {0.95};
  const Vector2 measured[] = {{1.5, 0.2}, {0.8, -1}, {30, 2}, {1, 1}};
  int rejected = 0;
  for (const Vector2& y : measured) {
    const auto a = one.step(Sensor{}, y);
    const auto b = other.step(Sensor{}, y);
    ASSERT_EQ(a.status, Status::ok);
    EXPECT_EQ(a.gate, b.gate);
    rejected += a.gate == jml::Verdict::rejected;
    EXPECT_LT((a.gain - b.gain).norm(), 1e-14);
    EXPECT_LT((a.innovation - b.innovation).norm(), 1e-13);
    EXPECT_LT((a.innovation_matrix - b.innovation_matrix).norm(), 1e-14);
    EXPECT_NEAR(a.nis(), b.nis(), 1e-12 * b.nis());
    EXPECT_NEAR(a.log_likelihood(), b.log_likelihood(), 1e-12 * std::abs(b.log_likelihood()));
    EXPECT_LT((one.x() - other.x()).norm(), 1e-13);
    EXPECT_LT((one.P() - other.P()).norm(), 1e-14);
  }
  EXPECT_EQ(rejected, 1);
  const auto a = one.update(Sensor{}, Vector2(0.7, NAN), jml::only(0));
  const auto b = other.update(Sensor{}, Vector2(0.7, NAN), jml::only(0));
  ASSERT_EQ(a.status, Status::ok);
  EXPECT_EQ(a.degrees, 1);
  EXPECT_NEAR(a.nis(), b.nis(), 1e-12);
  EXPECT_LT((one.x() - other.x()).norm(), 1e-13);
  EXPECT_LT((one.P() - other.P()).norm(), 1e-14);
}

// R = 0 in one row: a constraint. P of the other state given it, c - b²/a.
TEST(Factored, ARowWithoutNoiseIsAConstraint) {
  auto filter = factored(start);
  Sensor exact;
  exact.R = matrix(0, 0, 0, 0.4);
  const auto report = filter.update(exact, Vector2(1.75, 0), jml::only(0));
  ASSERT_EQ(report.status, Status::ok);
  EXPECT_EQ(filter.x()(0), 1.75);
  EXPECT_NEAR(filter.x()(1), -2 + 0.3 / 2 * 0.75, 1e-15);
  EXPECT_EQ(filter.P()(0, 0), 0);
  EXPECT_EQ(filter.P()(0, 1), 0);
  EXPECT_NEAR(filter.P()(1, 1), 1 - 0.09 / 2, 1e-15);

  const Vector2 x = filter.x();
  const Matrix2 P = filter.P();
  const auto again = filter.update(exact, Vector2(1.75, 0), jml::only(0));
  EXPECT_EQ(again.status, Status::ok);
  EXPECT_EQ(again.rows.redundant, 1);
  EXPECT_EQ(again.degrees, 0);
  const auto other = filter.update(exact, Vector2(1.76, 0), jml::only(0));
  EXPECT_EQ(other.status, Status::contradiction);
  EXPECT_EQ(filter.x(), x);
  EXPECT_EQ(filter.P(), P);
}

// R = [1 1; 1 1]: the rows have one noise, and their difference, x_1 here, has none.
TEST(Factored, RowsOfOneNoise) {
  auto filter = factored(start);
  Sensor sensor;
  sensor.R = matrix(1, 1, 1, 1);
  ASSERT_EQ(filter.update(sensor, Vector2(2, -1.5)).status, Status::ok);
  // First x_1 = -3.5 exactly, then y_0 = x_0 + v.
  const double before = 1 + 0.3 * (-1.5), variance = 2 - 0.09, gain = variance / (variance + 1);
  EXPECT_EQ(filter.x()(1), -3.5);
  EXPECT_NEAR(filter.x()(0), before + gain * (2 - before), 1e-14);
  EXPECT_NEAR(filter.P()(0, 0), variance * (1 - gain), 1e-15);
  EXPECT_EQ(filter.P()(1, 1), 0);
}

// By factors, and of nothing: two rows then are the estimate, x = H⁻¹ y, P = H⁻¹ R H⁻ᵀ.
TEST(Factored, Starts) {
  const Matrix2 U = matrix(1, 0.3, 0, 1);
  const auto by_factors = factored(jml::FactoredEstimate{start.x, U, Vector2(2 - 0.09, 1)});
  EXPECT_LT((by_factors.P() - start.P).norm(), 1e-15);
  EXPECT_EQ(factored(jml::FactoredEstimate{start.x, U, Vector2(-1, 1)}).status(), Status::invalid_covariance);
  EXPECT_EQ(factored(jml::FactoredEstimate{start.x, matrix(2, 0.3, 0, 1), Vector2(1, 1)}).status(),
            Status::invalid_covariance);
  EXPECT_EQ(factored(jml::Estimate{start.x, matrix(infinity, 1, 1, 1)}).status(), Status::invalid_covariance);
  EXPECT_EQ(factored(jml::Estimate{start.x, matrix(1, 2, 2, 1)}).status(), Status::invalid_covariance);

  auto filter = factored(jml::Estimate{Vector2(7, 7), matrix(infinity, 0, 0, infinity)});
  EXPECT_EQ(filter.P()(0, 0), infinity);
  const auto report = filter.update(Sensor{}, Vector2(2, 5));
  ASSERT_EQ(report.status, Status::ok);
  EXPECT_EQ(report.rows.resolved, 2);
  EXPECT_EQ(report.degrees, 0);
  EXPECT_NEAR(filter.x()(0), 2, 1e-15);
  EXPECT_NEAR(filter.x()(1), 3, 1e-15);
  EXPECT_LT((filter.P() - matrix(0.5, -0.3, -0.3, 0.5)).norm(), 1e-15);  // 0.4 - 2·0.2 + 0.5
}

// An offset in f or m changes nothing but the numbers it is added to, in the digits of a double and in more.
template <typename Method>
void expect_offsets_not_to_matter(const Method& method, double scale) {
  Plant moved;
  Sensor shifted;
  moved.offset = Vector2(0.25, -3);
  shifted.offset = Vector2(5, -0.5);
  shifted.R *= scale;
  Sensor sensor;
  sensor.R *= scale;
  jml::Filter one{method, moved, start}, other{method, Plant{}, start};
  Vector2 drift(0, 0);  // of the first from the second
  for (int k = 0; k < 5; ++k) {
    drift = moved.F * drift + moved.offset;
    const Vector2 y(1 + 0.1 * k, -1.5);
    const Vector2 as_seen = y + shifted.offset + sensor.H * drift;
    const auto report = one.step(shifted, as_seen);
    ASSERT_EQ(report.status, Status::ok) << k;
    EXPECT_EQ(report.redone, scale < 1e-12);
    ASSERT_EQ(other.step(sensor, y).status, Status::ok) << k;
    EXPECT_LT((one.x() - drift - other.x()).norm(), 1e-13) << k;
    EXPECT_LT((one.P() - other.P()).norm(), 1e-14 * other.P().norm()) << k;
  }
}
TEST(Factored, AffineModels) {
  expect_offsets_not_to_matter(jml::Factored{jml::Kalman{}}, 1);
  expect_offsets_not_to_matter(jml::Kalman{}, 1);
  expect_offsets_not_to_matter(jml::Kalman{}, 1e-18);
}

}  // namespace
