// SPDX-License-Identifier: BSD-3-Clause
// Updates where the prior variance N and the noise R differ by many orders, axis by axis, so that the answer
// is known in closed form: P⁺ = N R / (N + R), K = N / (N + R).
//
// P⁺ = N - K M N subtracts two numbers of the size of N: where N/R = c, the relative error of P⁺ is about c
// ε. The gain is accurate whatever c. Beyond c = 1/ε nothing of P⁺ is left, and a refusal is the only right
// answer.
#include <gtest/gtest.h>

#include <jml/filter/pure.hpp>
#include <jml/riccati/difference.hpp>

#include "models/linear.hpp"

namespace {

using namespace jml::operators;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
using Axes = jml::Matrix<double, 3, 3>;
using Vector3 = jml::Vector<double, 3>;

models::LinearSensor<3, 3> sensor_of(const Vector3& noise) {
  return {.M = Axes::Identity(), .R = noise.asDiagonal()};
}

template <typename Rule>
void expect_closed_form(const Rule& rule, const Vector3& prior, const Vector3& noise) {
  SCOPED_TRACE(::testing::Message() << "N " << prior.transpose() << ", R " << noise.transpose());
  const jml::Estimate<double, 3> estimate{Vector3(1, 2, 3), Axes(prior.asDiagonal())};
  const Vector3 y(1.5, 1, 4);
  const auto got = jml::update(rule, sensor_of(noise), estimate, y);
  ASSERT_EQ(got.report.status, jml::Status::ok);
  for (int i = 0; i < 3; ++i) {
    const double wanted = prior(i) * noise(i) / (prior(i) + noise(i)),
                 gain = prior(i) / (prior(i) + noise(i));
    const double ratio = prior(i) / noise(i);
    EXPECT_EQ(got.estimate.P(i, i) > 0, prior(i) > 0);
    EXPECT_NEAR(got.estimate.P(i, i), wanted, wanted * epsilon * (4 + 2 * ratio)) << i;
    EXPECT_NEAR(got.report.gain(i, i), gain, gain * 4 * epsilon) << i;
    EXPECT_NEAR(got.estimate.x(i), estimate.x(i) + gain * (y(i) - estimate.x(i)), 8 * epsilon) << i;
    for (int j = 0; j < 3; ++j) {
      if (i != j) {
        EXPECT_EQ(got.estimate.P(i, j), 0);
      }
    }
  }
}

TEST(IllConditioned, VariancesTwelveOrdersApart) {
  const auto check = [](const auto& rule) {
    expect_closed_form(rule, {1e12, 1, 1e-12}, {1, 1, 1});
    expect_closed_form(rule, {1, 1, 1}, {1e12, 1e-12, 1});
    expect_closed_form(rule, {1e6, 1e-6, 3}, {1e-6, 1e6, 2});
    expect_closed_form(rule, {1e-20, 1e20, 1}, {1e-8, 1e8, 1e-12});  // units apart as well
    expect_closed_form(rule, {0, 1e12, 0}, {1, 1, 1e-12});
  };
  check(jml::Ekf{});
  check(jml::Jml{});
}

// The same measured plane seen by a rotated sensor: M orthogonal and dense, R isotropic, so P⁺ is known too.
TEST(IllConditioned, DenseSensorTenOrdersApart) {
  Axes M;  // a reflection, I - 2 u uᵀ with u = (1, 2, 2)/3
  M << 7, -4, -4, -4, 1, -8, -4, -8, 1;
  M /= 9;
  for (const double prior : {1e4, 1e8, 1e10}) {
    const jml::Estimate<double, 3> estimate{Vector3::Zero(), Axes(prior * Axes::Identity())};
    const models::LinearSensor<3, 3> sensor{.M = M, .R = Axes::Identity()};
    const double wanted = prior / (prior + 1);
    const auto got = jml::update(jml::Ekf{}, sensor, estimate, Vector3(M * Vector3(1, 2, 3)));
    ASSERT_EQ(got.report.status, jml::Status::ok);
    const double bound = 20 * epsilon * prior;
    EXPECT_LT((got.estimate.P - wanted * Axes::Identity()).cwiseAbs().maxCoeff(), bound);
    EXPECT_TRUE(jml::is_definite<jml::Definite::positive>(got.estimate.P));
    EXPECT_LT((got.estimate.x - wanted * Vector3(1, 2, 3)).norm(), 1e-13);
  }
}

// Nothing of P⁺ is left beyond 1/ε. An answer that is `ok` must then hold variances none of which is
// negative.
TEST(IllConditioned, BeyondTheDigitsNoNegativeVarianceIsAccepted) {
  int refused = 0, accepted_negative = 0;
  for (int run = 0; run < 2000; ++run) {
    jml::Noise noise(static_cast<unsigned>(run));
    const double poor = std::exp(noise.uniform(30, 50));
    const Axes P = poor * models::random_covariance<3>(noise, 0.01);
    const models::LinearSensor<3, 3> sensor{.M = models::random_matrix<3, 3>(noise), .R = Axes::Identity()};
    const jml::Estimate<double, 3> estimate{Vector3::Zero(), P};
    const auto got = jml::update(jml::Ekf{}, sensor, estimate, Vector3(1, 1, 1));
    if (got.report.status == jml::Status::ok) {
      accepted_negative += got.estimate.P.diagonal().minCoeff() < 0 ? 1 : 0;
    } else {
      EXPECT_TRUE(got.report.status == jml::Status::covariance_lost ||
                  got.report.status == jml::Status::singular_innovation);
      EXPECT_EQ(got.estimate.P, P);
      ++refused;
    }
  }
  EXPECT_EQ(accepted_negative, 0) << "refused: " << refused << " of 2000";
}

// A long run with a very good sensor and a very poor prior: after the first update the variance is R / k
// exactly.
TEST(IllConditioned, RepeatedMeasurementsOfAConstant) {
  jml::Estimate<double, 3> estimate{Vector3::Zero(), Axes(1e12 * Axes::Identity())};
  const Vector3 noise(1, 1e-3, 1e3);
  for (int k = 1; k <= 1000; ++k) {
    const auto got = jml::update(jml::Ekf{}, sensor_of(noise), estimate, Vector3(1, 1, 1));
    ASSERT_EQ(got.report.status, jml::Status::ok);
    estimate = got.estimate;
  }
  for (int i = 0; i < 3; ++i) {
    // The error c ε of the first variance fades: it enters 1/P = 1/N + k/R once among a thousand terms.
    const double first = 1e12 / noise(i) * epsilon;
    const double wanted = 1 / (1e-12 + 1000 / noise(i));
    EXPECT_NEAR(estimate.P(i, i), wanted, wanted * (2 * first / 1000 + 1e-13)) << i;
  }
}

}  // namespace
