// SPDX-License-Identifier: BSD-3-Clause
// The noise of a campaign's runs: published numbers of Philox, and the moments it promises.
#include <gtest/gtest.h>

#include <jml/campaign/counter_noise.hpp>

namespace {

/// The uniform number of two words of Philox, low word first.
double uniform_of(std::uint64_t low, std::uint64_t high) {
  return (static_cast<double>((low | high << 32) >> 12) + 0.5) * 0x1p-52;
}

// Random123's kat_vectors for philox4x32 with 10 rounds: counter, key, words. Counter words 0, 1 are the
// draw, 2, 3 the run; key words 0, 1 the seed; low word first.
TEST(CounterNoise, PublishedNumbers) {
  jml::CounterNoise zeros(0, 0);
  EXPECT_EQ(zeros.uniform(), uniform_of(0x6627e8d5, 0xe169c58d));
  EXPECT_EQ(zeros.uniform(), uniform_of(0xbc57ac4c, 0x9b00dbd8));
  const std::uint64_t all = ~std::uint64_t{0};
  jml::CounterNoise ones(all, all, all);
  EXPECT_EQ(ones.uniform(), uniform_of(0x408f276d, 0x41c83b0e));
  EXPECT_EQ(ones.uniform(), uniform_of(0xa20bc7c6, 0x6d5451fd));
  jml::CounterNoise pi(0x299f31d0a4093822, 0x0370734413198a2e, 0x85a308d3243f6a88);
  EXPECT_EQ(pi.uniform(), uniform_of(0xd16cfe09, 0x94fdcceb));
  EXPECT_EQ(pi.uniform(), uniform_of(0x5001e420, 0x24126ea1));
}

TEST(CounterNoise, DrawsFollowOneAnother) {
  jml::CounterNoise run(5, 17), later(5, 17, 3);
  for (int i = 0; i < 6; ++i) run.uniform();
  EXPECT_EQ(run.uniform(), later.uniform()) << "two numbers a draw";
}

TEST(CounterNoise, NormalIsBoxAndMullersPair) {
  jml::CounterNoise uniform(3, 4), normal(3, 4);
  for (int pair = 0; pair < 3; ++pair) {
    const double first = uniform.uniform(), second = uniform.uniform();
    const double radius = std::sqrt(-2 * std::log(first)), angle = 2 * 3.141592653589793 * second;
    EXPECT_NEAR(normal.normal(), radius * std::cos(angle), 1e-14);
    EXPECT_NEAR(normal.normal(), radius * std::sin(angle), 1e-14);
  }
}

TEST(CounterNoise, OtherRunOrSeedOtherNumbers) {
  jml::CounterNoise a(1, 1), again(1, 1), run(1, 2), seed(2, 1), high_run(1, 1 | std::uint64_t{1} << 32);
  for (int i = 0; i < 1000; ++i) {
    const double number = a.uniform();
    EXPECT_EQ(number, again.uniform());
    EXPECT_NE(number, run.uniform());
    EXPECT_NE(number, seed.uniform());
    EXPECT_NE(number, high_run.uniform());
  }
}

// Standard errors with n numbers: mean 1/√n, variance √(2/n), third moment √(15/n), fourth √(96/n); 4 of
// each. First over one long run, then over the first number of many runs: streams must not be related either.
template <typename Next>
void expect_normal(const Next& next) {
  constexpr int count = 400'000;
  double sum[5] = {}, lagged = 0, last = 0;
  for (int i = 0; i < count; ++i) {
    const double z = next(i);
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
  EXPECT_NEAR(lagged / count, 0, 4 / root);
}
TEST(CounterNoise, NormalMomentsOfARun) {
  jml::CounterNoise noise(11, 0);
  expect_normal([&](int) { return noise.normal(); });
}
TEST(CounterNoise, NormalMomentsOverRuns) {
  expect_normal([](int run) { return jml::CounterNoise(12, static_cast<std::uint64_t>(run)).normal(); });
}

TEST(CounterNoise, UniformMomentsAndBounds) {
  constexpr int count = 400'000;
  jml::CounterNoise noise(12, 7);
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

TEST(CounterNoise, VectorsHaveTheCovarianceAsked) {
  constexpr int count = 100'000;
  jml::Matrix<double, 2, 2> wanted, sample = jml::Matrix<double, 2, 2>::Zero();
  wanted << 4, 1.2, 1.2, 1;
  jml::CounterNoise noise(1, 1);
  for (int i = 0; i < count; ++i) {
    const jml::Vector<double, 2> w = noise.normal_vector(wanted);
    sample += w * w.transpose() / count;
  }
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      const double error = std::sqrt((wanted(i, i) * wanted(j, j) + wanted(i, j) * wanted(i, j)) / count);
      EXPECT_NEAR(sample(i, j), wanted(i, j), 4 * error);
    }
  }
}

}  // namespace
