// SPDX-License-Identifier: BSD-3-Clause
// The noise source: the same numbers everywhere, and the moments it promises.
#include <gtest/gtest.h>

#include <jml/campaign/noise.hpp>

namespace {

TEST(Noise, FirstNumbersOfASeed) {
  // From a second implementation of mt19937_64 (checked by the 10000th number that the C++ standard fixes,
  // 9981545732273789042 for seed 5489) and of Box and Muller's formula.
  jml::Noise uniform(20150601);
  EXPECT_EQ(uniform.uniform(), 0.7568154806406199);
  EXPECT_EQ(uniform.uniform(), 0.20932283327596035);
  EXPECT_EQ(uniform.uniform(), 0.16647158775525683);
  jml::Noise normal(20150601);  // log and cos may differ in the last place between mathematical libraries
  EXPECT_NEAR(normal.normal(), 0.18872329213632558, 1e-15);
  EXPECT_NEAR(normal.normal(), 1.6498438792786747, 4e-15);
  EXPECT_NEAR(normal.normal(), 1.5250624249208142, 4e-15);
}

TEST(Noise, SameSeedSameBitsOtherSeedOtherBits) {
  jml::Noise a(7), b(7), c(8);
  int equal = 0;
  for (int i = 0; i < 1000; ++i) {
    const double number = a.normal();
    EXPECT_EQ(number, b.normal());
    equal += number == c.normal() ? 1 : 0;
  }
  EXPECT_EQ(equal, 0);
}

// Standard errors with n numbers: mean 1/√n, variance √(2/n), third moment √(15/n), fourth √(96/n); 4 of
// each.
TEST(Noise, NormalMoments) {
  constexpr int count = 400'000;
  jml::Noise noise(11);
  double sum[5] = {}, lagged = 0, last = 0;
  for (int i = 0; i < count; ++i) {
    const double z = noise.normal();
    ASSERT_TRUE(std::isfinite(z));
    double power = 1;
    for (int k = 1; k <= 4; ++k) sum[k] += power *= z;
    lagged += z * last;
    last = z;
  }
  const double root = std::sqrt(static_cast<double>(count));
  EXPECT_NEAR(sum[1] / count, 0, 4 / root);
  EXPECT_NEAR(sum[2] / count, 1, 4 * std::sqrt(2) / root);
  EXPECT_NEAR(sum[3] / count, 0, 4 * std::sqrt(15) / root);
  EXPECT_NEAR(sum[4] / count, 3, 4 * std::sqrt(96) / root);
  EXPECT_NEAR(lagged / count, 0, 4 / root) << "neighbours must not be correlated";
}

TEST(Noise, UniformMomentsAndBounds) {
  constexpr int count = 400'000;
  jml::Noise noise(12);
  double sum = 0, squares = 0, lowest = 1e9, highest = -1e9;
  for (int i = 0; i < count; ++i) {
    const double u = noise.uniform(-2, 4);
    sum += u;
    squares += (u - 1) * (u - 1);
    lowest = std::min(lowest, u);
    highest = std::max(highest, u);
  }
  EXPECT_NEAR(sum / count, 1, 4 * std::sqrt(3.0 / count));
  EXPECT_NEAR(squares / count, 3, 4 * std::sqrt((81.0 / 5 - 9) / count));
  EXPECT_GT(lowest, -2);
  EXPECT_LT(lowest, -2 + 1e-3);
  EXPECT_LT(highest, 4);
  EXPECT_GT(highest, 4 - 1e-3);
}

/// The largest |sample covariance - wanted| over its standard error √((c_ii c_jj + c_ij²)/n).
template <int n>
double worst_covariance(const jml::Matrix<double, n, n>& wanted, std::uint64_t seed) {
  constexpr int count = 100'000;
  jml::Noise noise(seed);
  jml::Matrix<double, n, n> sample = jml::Matrix<double, n, n>::Zero();
  for (int i = 0; i < count; ++i) {
    const jml::Vector<double, n> w = noise.normal_vector(wanted);
    sample += w * w.transpose() / count;
  }
  double worst = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double error = std::sqrt((wanted(i, i) * wanted(j, j) + wanted(i, j) * wanted(i, j)) / count);
      const double off = std::abs(sample(i, j) - wanted(i, j));
      worst = std::max(worst, error > 0 ? off / error : (off > 0 ? 1e9 : 0));
    }
  }
  return worst;
}

TEST(Noise, VectorsHaveTheCovarianceAsked) {
  jml::Matrix<double, 3, 3> full, singular, mixed;
  full << 4, 1.2, -0.8, 1.2, 1, 0.3, -0.8, 0.3, 2;
  singular << 1, 2, 0, 2, 4, 0, 0, 0, 0;          // rank one, and a component without noise
  mixed << 1e12, 0, 0.6, 0, 0, 0, 0.6, 0, 1e-12;  // a zero in the middle, units far apart, correlation 0.6
  EXPECT_LT(worst_covariance(full, 1), 4);
  EXPECT_LT(worst_covariance(singular, 2), 4);
  EXPECT_LT(worst_covariance(mixed, 3), 4);
}

}  // namespace
