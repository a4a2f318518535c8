// SPDX-License-Identifier: BSD-3-Clause
// Whiteness of innovations against NumPy, closed forms, and how often the test fails on what is white.
#include <gtest/gtest.h>

#include <cmath>
#include <jml/analysis/whiteness.hpp>
#include <jml/campaign/noise.hpp>
#include <vector>

namespace {

using namespace jml::operators;

using jml::WhitenessVerdict;
using Matrix2 = jml::Matrix<double, 2, 2>;
using Vector2 = jml::Vector<double, 2>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
const double no_probability[] = {0.0, 1.0, -0.5, 1.5, nan, infinity};

/// Counts of a share that should be `expected`: within `errors` standard errors of a binomial.
void expect_share(int count, int trials, double expected, double errors) {
  const double share = static_cast<double>(count) / trials;
  EXPECT_NEAR(share, expected, errors * std::sqrt(expected * (1 - expected) / trials));
}

jml::StepReport<double, 3, 2> report_of(const Vector2& innovation, const Matrix2& S) {
  jml::StepReport<double, 3, 2> report;
  report.innovation = innovation;
  report.innovation_matrix = S;
  return report;
}

// 40 made-up innovations and a made-up S; `whiteness` below was computed apart, with NumPy.
template <typename Whiteness>
void add_made_up(Whiteness& test) {
  Matrix2 S;
  S << 2, 0.6, 0.6, 0.9;
  for (int t = 1; t <= 40; ++t)
    test.add(Vector2(std::sin(1.7 * t * t) + 0.3 * std::cos(t), 1.5 * std::cos(2.3 * t * t + 0.5)), S);
}

TEST(Whiteness, OfNumpy) {
  // z = solve(cholesky(S), v); C[k] = z[k:].T @ z[:N-k]; W = inv(C[0]);
  // 2*N*(N+2)*(N-1)/(2*(N+1)-2) * sum(trace(C[k].T @ W @ C[k] @ W) / (N - k) for k in (1, 2, 3))
  jml::Whiteness<2, 3> test;
  add_made_up(test);
  EXPECT_EQ(test.samples(), 40);
  EXPECT_NEAR(test.statistic(), 16.140099635289697, 1e-9);
  EXPECT_EQ(test.degrees(), 12);
  // C[2] / sqrt(outer(diag(C[0]), diag(C[0]))); its transpose would be lag -2
  Matrix2 wanted;
  wanted << -0.06763253784274788, -0.2579554662762699, 0.1829293140909171, -0.11322091610044813;
  EXPECT_LT((test.autocorrelation(2) - wanted).norm(), 1e-10);
  wanted << 0.25996624434555893, -0.051366065667947505, -0.051366065667947505,
      1.5629052718269234;  // C[0] / N
  EXPECT_LT((test.covariance() - wanted).norm(), 1e-10);
}

TEST(Whiteness, LjungAndBox) {
  // r = [(x[k:] * x[:N-k]).sum() / (x * x).sum() for k in range(6)]; N*(N+2)*sum(r[k]**2/(N-k) for k in
  // range(1, 6))
  jml::Whiteness<1, 5> test;
  for (int t = 1; t <= 40; ++t) {
    const jml::Vector<double, 1> v(std::sin(1.7 * t * t) + 0.3 * std::cos(t));
    test.add(v, jml::Matrix<double, 1, 1>(7.0));
  }
  EXPECT_NEAR(test.statistic(), 2.522791608190911, 1e-10);
}

TEST(Whiteness, Bounds) {
  // scipy.stats.chi2.isf(0.05, 10), chi2.isf(0.01, 12); norm.isf(0.025), norm.isf(0.005)
  jml::Whiteness<2, 3> strict(0.99);
  add_made_up(strict);
  EXPECT_NEAR(strict.statistic_bound(), 26.216967305535857, 1e-11);
  EXPECT_NEAR(strict.bound(), 2.575829303548901 / std::sqrt(40.0), 1e-12);
  EXPECT_NEAR((jml::Whiteness<1, 10>{}.statistic_bound()), 18.30703805327515, 1e-11);
}

TEST(Whiteness, ScaleOfSAndUnitsDoNotMatter) {
  jml::Whiteness<2, 3> plain, scaled;
  Matrix2 S, units;
  S << 2, 0.6, 0.6, 0.9;
  units << 1e6, 3e-3, 0, 1e-5;
  jml::Noise noise(3);
  for (int t = 0; t < 100; ++t) {
    const Vector2 v = noise.normal_vector<2>();
    plain.add(v, S);
    scaled.add(units * v, 17 * units * S * units.transpose());
  }
  EXPECT_NEAR(scaled.statistic(), plain.statistic(), 1e-9 * plain.statistic());
  EXPECT_NEAR(scaled.covariance().trace(), plain.covariance().trace() / 17, 1e-9);
}

TEST(Whiteness, RunsAreNotJoined) {
  // Pairs within runs, by brute force.
  constexpr int runs = 7, steps = 5, lags = 3, samples = runs * steps;
  jml::Noise noise(4);
  std::vector<double> z;
  jml::Whiteness<1, lags> test;
  for (int run = 0; run < runs; ++run) {
    test.start_run();
    for (int i = 0; i < steps; ++i) {
      z.push_back(noise.normal());
      test.add(jml::Vector<double, 1>(z.back()), jml::Matrix<double, 1, 1>(1.0));
    }
  }
  double power = 0, sum = 0;
  for (const double value : z) power += value * value;
  for (int k = 1; k <= lags; ++k) {
    double product = 0;
    for (int i = k; i < samples; ++i) {
      if (i / steps == (i - k) / steps)
        product += z[static_cast<std::size_t>(i)] * z[static_cast<std::size_t>(i - k)];
    }
    EXPECT_NEAR(test.autocorrelation(k)(0, 0), product / power, 1e-13) << k;
    sum += product * product / (power * power) / (runs * (steps - k));
  }
  EXPECT_NEAR(test.statistic(), samples * (samples + 2) * sum, 1e-12);
}

TEST(Whiteness, UndefinedIsNamed) {
  jml::Whiteness<2, 3> test;
  EXPECT_EQ(test.verdict(), WhitenessVerdict::undefined);
  EXPECT_TRUE(std::isnan(test.statistic()));
  const Matrix2 one = Matrix2::Identity();
  Matrix2 indefinite;
  indefinite << 1, 2, 2, 1;
  jml::Noise noise(5);
  const auto value = [&noise]() -> Vector2 { return noise.normal_vector<2>(); };
  for (int i = 0; i < 3; ++i) {
    test.add(value(), one);
    test.add(value(), indefinite);
    test.add(Vector2(nan, 0), one);
    test.add(Vector2(0, infinity), one);
    test.add(jml::StepReport<double, 3, 2>{});
  }
  auto refused = report_of(value(), one);
  refused.status = jml::Status::covariance_lost;
  test.add(refused);
  EXPECT_EQ(test.samples(), 3);
  EXPECT_EQ(test.left_out(), 13);
  EXPECT_EQ(test.verdict(), WhitenessVerdict::undefined) << "no pair yet at lag 3";
  test.add(report_of(value(), one));
  EXPECT_EQ(test.verdict(), WhitenessVerdict::white);
  EXPECT_TRUE(std::isnan(test.autocorrelation(-1)(0, 0)));
  EXPECT_TRUE(std::isnan(test.autocorrelation(4)(1, 0)));
  EXPECT_FALSE(std::isnan(test.autocorrelation(3)(0, 0)));
  for (const double bad : no_probability) {
    jml::Whiteness<2, 3> other(bad);
    add_made_up(other);
    EXPECT_EQ(other.verdict(), WhitenessVerdict::undefined) << bad;
    EXPECT_TRUE(std::isnan(other.bound()));
  }
}

/// Share called coloured and mean statistic over `sequences` of N standard normals.
template <int p, int lags>
void white_sequences(int samples, int sequences, unsigned seed, double& share, double& mean) {
  jml::Noise noise(seed);
  const jml::Matrix<double, p, p> S = jml::Matrix<double, p, p>::Identity();
  int coloured = 0;
  mean = 0;
  for (int s = 0; s < sequences; ++s) {
    jml::Whiteness<p, lags> test;
    for (int i = 0; i < samples; ++i) test.add(noise.normal_vector<p>(), S);
    mean += test.statistic() / sequences;
    if (test.verdict() == WhitenessVerdict::coloured) ++coloured;
  }
  share = static_cast<double>(coloured) / sequences;
}

TEST(Whiteness, OnWhiteNoiseTheMeanIsExact) {
  // Twelve samples, where the asymptotic weight N² would give 25.9 for 27 (and 10.9 for 12). A standard error
  // is 0.03 (0.02) at most: √(2 · 27 / 60 000).
  double share, mean;
  white_sequences<3, 3>(12, 60000, 21, share, mean);
  EXPECT_NEAR(mean, 27, 3 * 0.03);
  white_sequences<2, 3>(12, 60000, 22, share, mean);
  EXPECT_NEAR(mean, 12, 3 * 0.02);
}

TEST(Whiteness, OnWhiteNoiseOneInTwentyFails) {
  // The χ² law is asymptotic: at N = 10 p lags a percent more than 5 fails.
  double share, mean;
  white_sequences<2, 10>(200, 4000, 23, share, mean);
  EXPECT_NEAR(share, 0.055, 3 * 0.0034);
  white_sequences<1, 10>(1000, 2000, 24, share, mean);
  EXPECT_NEAR(share, 0.05, 3 * 0.005);
}

template <int lags>
int coloured_of(int sequences, double coefficient) {
  jml::Noise noise(31);
  const jml::Matrix<double, 1, 1> S(1.0);
  int coloured = 0;
  for (int s = 0; s < sequences; ++s) {
    jml::Whiteness<1, lags> test;
    double x = noise.normal() / std::sqrt(1 - coefficient * coefficient);
    for (int i = 0; i < 2000; ++i) {
      test.add(jml::Vector<double, 1>(x), S);
      x = coefficient * x + noise.normal();
    }
    if (test.verdict() == WhitenessVerdict::coloured) ++coloured;
  }
  return coloured;
}

TEST(Whiteness, FirstOrderNoiseOfATenthIsSeenAsOftenAsTheoryHasIt) {
  // scipy.stats.ncx2.sf(chi2.isf(0.05, K), K, 2000 * 0.01 / 0.99): Σ r_k² of r_k = 0.1^k
  expect_share(coloured_of<1>(1000, 0.1), 1000, 0.99437, 3);
  expect_share(coloured_of<5>(1000, 0.1), 1000, 0.95440, 3);
  expect_share(coloured_of<10>(1000, 0.1), 1000, 0.89420, 3);
  EXPECT_EQ(coloured_of<10>(200, 0.2), 200);
  EXPECT_EQ(coloured_of<10>(200, -0.2), 200);
}

TEST(Whiteness, ABiasIsSeen) {
  // A mean of 0.3 standard deviations: r_k = 0.09 / 1.09 at all lags, so the statistic is about
  // 10 + 2000 · 10 · r² = 146, against a bound of 18.
  jml::Noise noise(32);
  jml::Whiteness<1, 10> test;
  for (int i = 0; i < 2000; ++i)
    test.add(jml::Vector<double, 1>(0.3 + noise.normal()), jml::Matrix<double, 1, 1>(1.0));
  EXPECT_EQ(test.verdict(), WhitenessVerdict::coloured);
}

}  // namespace
