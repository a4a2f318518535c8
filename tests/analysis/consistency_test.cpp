// SPDX-License-Identifier: BSD-3-Clause
// Intervals, NEES and NIS against printed tables, closed forms, SciPy, and how often they hold.
#include <gtest/gtest.h>

#include <cmath>
#include <jml/analysis/consistency.hpp>
#include <jml/campaign/noise.hpp>
#include <vector>

namespace {

using namespace jml::operators;

using jml::CovarianceVerdict;
using Matrix2 = jml::Matrix<double, 2, 2>;
using Vector2 = jml::Vector<double, 2>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
const double no_probability[] = {0.0, 1.0, -0.5, 1.5, nan, infinity};

void expect_interval(const jml::ConfidenceInterval& got, double low, double high) {
  // SciPy's quantiles and Boost's agree to about 1e-13.
  EXPECT_NEAR(got.low, low, 1e-12 * std::abs(low));
  EXPECT_NEAR(got.high, high, 1e-12 * std::abs(high));
}

void expect_undefined(const jml::ConfidenceInterval& got) {
  EXPECT_TRUE(std::isnan(got.low) && std::isnan(got.high)) << got.low << " " << got.high;
  EXPECT_FALSE(got.defined());
  EXPECT_FALSE(got.contains(1));
}

/// Counts of a share that should be `expected`: within `errors` standard errors of a binomial.
void expect_share(int count, int trials, double expected, double errors) {
  const double share = static_cast<double>(count) / trials;
  EXPECT_NEAR(share, expected, errors * std::sqrt(expected * (1 - expected) / trials));
}

TEST(ChiSquareAverage, PrintedIntervals) {
  // Two-sided 95 % intervals of averaged NEES and NIS, three decimals.
  const struct {
    int degrees;
    long runs;
    double low, high;
  } table[] = {{1, 50, 0.647, 1.428}, {1, 100, 0.742, 1.296}, {1, 1000, 0.914, 1.090},
               {2, 50, 1.484, 2.591}, {2, 100, 1.627, 2.411}, {2, 1000, 1.878, 2.126},
               {3, 50, 2.360, 3.716}, {3, 100, 2.539, 3.499}, {3, 1000, 2.850, 3.154},
               {4, 50, 3.255, 4.821}, {4, 100, 3.465, 4.573}, {4, 1000, 3.827, 4.177}};
  for (const auto& row : table) {
    const auto interval = jml::chi_square_average_interval(row.degrees, row.runs);
    EXPECT_NEAR(interval.low, row.low, 5.1e-4) << row.degrees << " " << row.runs;
    EXPECT_NEAR(interval.high, row.high, 5.1e-4) << row.degrees << " " << row.runs;
  }
}

TEST(ChiSquareAverage, OfScipy) {
  // scipy.stats.chi2.ppf((1 - q) / 2, d * N) / N and chi2.isf((1 - q) / 2, d * N) / N
  expect_interval(jml::chi_square_average_interval(1, 1), 0.0009820691171752583, 5.023886187314888);
  expect_interval(jml::chi_square_average_interval(3, 7, 0.99), 1.1476647743189619, 5.91443782448823);
  expect_interval(jml::chi_square_average_interval(6, 2000), 5.849131204107784, 6.152763079071477);
  expect_interval(jml::chi_square_average_interval(2, 1000000, 0.999), 1.993425497547074, 2.006587605872455);
  expect_interval(jml::chi_square_average_interval(1, 3, 0.5), 0.4041776343485562, 1.3694483118774372);
}

TEST(ChiSquareAverage, TwoDegreesInClosedForm) {
  for (const double q : {1e-3, 0.5, 0.95, 0.9999}) {
    const double tail = (1 - q) / 2;
    expect_interval(jml::chi_square_average_interval(2, 1, q), -2 * std::log1p(-tail), -2 * std::log(tail));
  }
}

TEST(ChiSquareAverage, ManyDegreesAreNormal) {
  // The Cornish-Fisher expansion of χ²/d to d^-3/2. Boost leaves it at 1e12 degrees: refused.
  const double u = 1.9599639845400545;
  for (const long samples : {1000000L, 1000000000L, 100000000000L}) {
    const auto d = static_cast<double>(samples), root = std::sqrt(2 / d);
    const auto interval = jml::chi_square_average_interval(1, samples);
    const double middle = 1 + 2 * (u * u - 1) / (3 * d);
    const double half = u * root + (u * u * u - 7 * u) * root / (18 * d);
    EXPECT_NEAR(interval.low, middle - half, 1e-9 * half + 3e-16) << samples;
    EXPECT_NEAR(interval.high, middle + half, 1e-9 * half + 3e-16) << samples;
  }
  expect_undefined(jml::chi_square_average_interval(1, 1000000000000L));
}

TEST(Mean, OfScipy) {
  // scipy.stats.t.isf((1 - q) / 2, N - 1)
  expect_interval(jml::mean_interval(0, 1, 2), -12.706204736174694, 12.706204736174694);
  expect_interval(jml::mean_interval(3, 2, 5), 3 - 2 * 2.7764451051977934, 3 + 2 * 2.7764451051977934);
  expect_interval(jml::mean_interval(-1, 0.1, 30, 0.99), -1 - 0.2756385903670605, -1 + 0.2756385903670605);
  expect_interval(jml::mean_interval(0, 1, 100000), -1.9599877077718442, 1.9599877077718442);
  expect_interval(jml::mean_interval(7, 0, 30), 7, 7);
}

TEST(MeanSquare, OfScipy) {
  // N * m / scipy.stats.chi2.isf((1 - q) / 2, N) and N * m / chi2.ppf((1 - q) / 2, N)
  expect_interval(jml::mean_square_interval(2, 10), 0.9764110156089459, 6.159583511673649);
  expect_interval(jml::mean_square_interval(0.3, 500, 0.99), 0.2563197265503269, 0.3551948965618602);
}

TEST(Proportion, OfScipy) {
  // a = (1 - q) / 2; scipy.stats.beta.ppf(a, k, n - k + 1) and beta.isf(a, k + 1, n - k)
  expect_interval(jml::proportion_interval(0, 1000), 0, 0.003682083896865671);
  expect_interval(jml::proportion_interval(1000, 1000), 0.9963179161031344, 1);
  expect_interval(jml::proportion_interval(3, 10), 0.0667395111777345, 0.6524528500599973);
  expect_interval(jml::proportion_interval(57, 4000, 0.99), 0.009878240050070076, 0.01981619218451974);
  expect_interval(jml::proportion_interval(950000, 1000000), 0.949571030631536, 0.9504263604526736);
  expect_interval(jml::proportion_interval(1, 1, 0.9), 0.05, 1);
}

TEST(Proportion, NoFailureInClosedForm) {
  for (const long n : {1L, 100L, 59000L}) {
    const double log_of_end = std::log(0.05) / static_cast<double>(n);
    expect_interval(jml::proportion_interval(0, n, 0.9), 0, -std::expm1(log_of_end));
    expect_interval(jml::proportion_interval(n, n, 0.9), std::exp(log_of_end), 1);
  }
}

TEST(Proportion, HoldsForEveryTruth) {
  // The exact share of outcomes whose interval holds the truth, summed over the binomial law.
  constexpr int trials = 30;
  double least = 1;
  for (double p = 0.005; p < 1; p += 0.005) {
    double holds = 0;
    for (int k = 0; k <= trials; ++k) {
      const double log_choose =
          std::lgamma(trials + 1.0) - std::lgamma(k + 1.0) - std::lgamma(trials - k + 1.0);
      if (jml::proportion_interval(k, trials, 0.9).contains(p))
        holds += std::exp(log_choose + k * std::log(p) + (trials - k) * std::log1p(-p));
    }
    least = std::min(least, holds);
  }
  EXPECT_GE(least, 0.9);
  EXPECT_LT(least, 0.92) << "it is not wider than it need be, either";
}

TEST(Intervals, WhatIsNotDefinedIsNotANumber) {
  for (const double bad : no_probability) {
    expect_undefined(jml::chi_square_average_interval(2, 10, bad));
    expect_undefined(jml::mean_interval(0, 1, 10, bad));
    expect_undefined(jml::mean_square_interval(1, 10, bad));
    expect_undefined(jml::proportion_interval(3, 10, bad));
  }
  for (const long samples : {0L, -1L, -5L}) {
    expect_undefined(jml::chi_square_average_interval(2, samples));
    expect_undefined(jml::chi_square_average_interval(-2, samples));
    expect_undefined(jml::mean_interval(0, 1, samples));
    expect_undefined(jml::mean_square_interval(1, samples));
    expect_undefined(jml::proportion_interval(0, samples));
  }
  expect_undefined(jml::chi_square_average_interval(0, 10));
  expect_undefined(jml::mean_interval(0, 1, 1));
  for (const double bad : {-1.0, nan, infinity}) {
    expect_undefined(jml::mean_interval(0, bad, 10));
    expect_undefined(jml::mean_square_interval(bad, 10));
  }
  expect_undefined(jml::mean_interval(nan, 1, 10));
  expect_undefined(jml::mean_interval(infinity, 1, 10));
  expect_undefined(jml::proportion_interval(-1, 10));
  expect_undefined(jml::proportion_interval(11, 10));
}

TEST(Intervals, ExtremesDoNotThrow) {
  const double close = std::nextafter(1.0, 0.0), tiny = 5e-324, huge = std::numeric_limits<double>::max();
  const long many = std::numeric_limits<long>::max();
  for (const double q : {tiny, 0.5, close}) {
    for (const long n : {1L, 2L, 1000L, many}) {
      EXPECT_NO_THROW((void)jml::chi_square_average_interval(1, n, q));
      EXPECT_NO_THROW((void)jml::mean_interval(1, huge, n, q));
      EXPECT_NO_THROW((void)jml::mean_square_interval(huge, n, q));
      EXPECT_NO_THROW((void)jml::proportion_interval(n / 2, n, q));
      EXPECT_NO_THROW((void)jml::proportion_interval(0, n, q));
      EXPECT_NO_THROW((void)jml::proportion_interval(n, n, q));
    }
  }
}

TEST(Nees, ByHand) {
  Matrix2 P;
  P << 4, 1, 1, 2;  // inverse [2 -1; -1 4] / 7
  EXPECT_NEAR(jml::nees(Vector2(3, -1), P), (2 * 9 + 2 * 3 + 4 * 1) / 7.0, 1e-14);
  Matrix2 twisted = P;
  twisted(0, 1) += 5;
  twisted(1, 0) -= 5;
  EXPECT_NEAR(jml::nees(Vector2(3, -1), twisted), 4, 1e-14) << "only the symmetric part counts";
  const jml::Vector<double, 3> truth(1, 2, 3), estimate(0, 2, 5);
  const jml::Matrix<double, 3, 3> variances = jml::Vector<double, 3>(0.5, 1, 2).asDiagonal();
  EXPECT_NEAR(jml::nees(truth - estimate, variances), 2 + 0 + 2, 1e-14);
  EXPECT_NEAR(jml::nees((truth - estimate).tail<1>(), variances.bottomRightCorner<1, 1>()), 2, 1e-14);
}

TEST(Nees, WithoutACovarianceNotANumber) {
  Matrix2 P;
  P << 1, 2, 2, 1;
  EXPECT_TRUE(std::isnan(jml::nees(Vector2(1, 1), P)));
  P << 1, 1, 1, 1;
  EXPECT_TRUE(std::isnan(jml::nees(Vector2(1, 1), P)));
  P << 1, nan, nan, 1;
  EXPECT_TRUE(std::isnan(jml::nees(Vector2(1, 1), P)));
  EXPECT_TRUE(std::isnan(jml::nees(Vector2(1, nan), Matrix2(Matrix2::Identity()))));
  EXPECT_TRUE(std::isnan(jml::nees(Vector2(0, 0), Matrix2(Matrix2::Zero()))));
}

TEST(Consistency, SaysWhichWay) {
  // 100 values of 2 degrees: 1.627 to 2.411.
  const struct {
    double value;
    CovarianceVerdict verdict;
  } cases[] = {{1.62, CovarianceVerdict::pessimistic},
               {1.63, CovarianceVerdict::consistent},
               {2.41, CovarianceVerdict::consistent},
               {2.42, CovarianceVerdict::optimistic},
               {infinity, CovarianceVerdict::optimistic}};
  for (const auto& one : cases) {
    jml::Consistency nees;
    for (int i = 0; i < 100; ++i) nees.add(one.value, 2);
    EXPECT_EQ(nees.verdict(), one.verdict) << one.value;
    EXPECT_EQ(nees.samples(), 100);
    EXPECT_EQ(nees.expected(), 2);
  }
}

TEST(Consistency, SensorsOfDifferentSize) {
  jml::Consistency nis(0.99);
  nis.add(0.5, 1);
  nis.add(7.5, 3);
  nis.add(1.0, 3);
  EXPECT_DOUBLE_EQ(nis.average(), 3);
  EXPECT_DOUBLE_EQ(nis.expected(), 7.0 / 3);
  // scipy.stats.chi2.ppf([0.005, 0.995], 7) / 3
  expect_interval(nis.interval(), 0.3297518943776501, 6.759246624987541);
}

TEST(Consistency, LeavesOutWhatIsUndefinedAndCountsIt) {
  jml::Consistency nees;
  EXPECT_EQ(nees.verdict(), CovarianceVerdict::undefined);
  EXPECT_TRUE(std::isnan(nees.average()));
  expect_undefined(nees.interval());
  nees.add(nan, 2);
  nees.add(-1, 2);
  nees.add(1, 0);
  nees.add(1, -3);
  EXPECT_EQ(nees.verdict(), CovarianceVerdict::undefined);
  EXPECT_EQ(nees.left_out(), 4);
  nees.add(2, 2);
  EXPECT_EQ(nees.samples(), 1);
  EXPECT_EQ(nees.average(), 2);
  EXPECT_EQ(nees.verdict(), CovarianceVerdict::consistent);
  for (const double bad : no_probability) {
    jml::Consistency other(bad);
    other.add(2, 2);
    EXPECT_EQ(other.verdict(), CovarianceVerdict::undefined) << bad;
  }
}

jml::StepReport<double, 3, 2> report_of(const Vector2& innovation, const Matrix2& S) {
  jml::StepReport<double, 3, 2> report;
  report.innovation = innovation;
  report.innovation_matrix = S;
  return report;
}

TEST(Consistency, TakesReports) {
  Matrix2 S;
  S << 4, 1, 1, 2;
  auto report = report_of({3, -1}, S);
  jml::Consistency nis;
  nis.add(report);
  EXPECT_NEAR(nis.average(), 4, 1e-14);
  EXPECT_EQ(nis.expected(), 2);
  report.gate = jml::Verdict::rejected;
  nis.add(report);
  EXPECT_EQ(nis.samples(), 2) << "the gate's rejects belong to the law";
  report.status = jml::Status::covariance_lost;
  nis.add(report);
  nis.add(jml::StepReport<double, 3, 2>{});  // S = 0
  EXPECT_EQ(nis.samples(), 2);
  EXPECT_EQ(nis.left_out(), 2);
}

TEST(Coverage, AverageNeesInNinetyFiveOfAHundredCampaigns) {
  jml::Noise noise(11);
  constexpr int campaigns = 4000;
  int holds = 0;
  for (int c = 0; c < campaigns; ++c) {
    jml::Consistency nees;
    for (int run = 0; run < 20; ++run) nees.add(noise.normal_vector<3>().squaredNorm(), 3);
    if (nees.verdict() == CovarianceVerdict::consistent) ++holds;
  }
  expect_share(holds, campaigns, 0.95, 2.9);  // 1 %
}

TEST(Coverage, MeansAndMeanSquares) {
  jml::Noise noise(12);
  constexpr int campaigns = 4000, few = 5, more = 50;
  int mean_holds = 0, square_holds = 0, plain_holds = 0;
  for (int c = 0; c < campaigns; ++c) {
    double sum = 0, squares = 0, fourth = 0;
    for (int i = 0; i < more; ++i) {
      const double value = 2 * noise.normal();
      sum += i < few ? value + 10 : 0;
      squares += value * value;
      fourth += value * value * value * value;
      if (i + 1 == few) {
        const double mean = sum / few, off = mean - 10;  // Σ(value + 10 - mean)² = Σ value² - few off²
        const double error = std::sqrt((squares - few * off * off) / (few - 1) / few);
        if (jml::mean_interval(mean, error, few).contains(10)) ++mean_holds;
      }
    }
    const double mean_square = squares / more;
    const double error = std::sqrt((fourth / more - mean_square * mean_square) / (more - 1));
    if (jml::mean_square_interval(mean_square, more).contains(4)) ++square_holds;
    if (jml::mean_interval(mean_square, error, more).contains(4)) ++plain_holds;
  }
  expect_share(mean_holds, campaigns, 0.95, 2.9);
  expect_share(square_holds, campaigns, 0.95, 2.9);
  expect_share(plain_holds, campaigns, 0.92, 3);  // 0.9237 of 20 000: squares are skewed
}

}  // namespace
