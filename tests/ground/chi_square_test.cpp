// SPDX-License-Identifier: BSD-3-Clause
// Chi-square tails and quantiles against printed tables, closed forms and a quadrature of the density; the
// gate.
#include <gtest/gtest.h>

#include <jml/gate.hpp>

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(ChiSquare, PrintedGateValues) {
  // Any statistics book: the 99 % and 99.9 % points for 1 to 6 degrees of freedom, three decimals.
  const double percent_99[] = {6.635, 9.210, 11.345, 13.277, 15.086, 16.812};
  const double percent_999[] = {10.828, 13.816, 16.266, 18.467, 20.515, 22.458};
  for (int degrees = 1; degrees <= 6; ++degrees) {
    EXPECT_NEAR(jml::chi_square_quantile(0.99, degrees), percent_99[degrees - 1], 5.1e-4) << degrees;
    EXPECT_NEAR(jml::chi_square_quantile(0.999, degrees), percent_999[degrees - 1], 5.1e-4) << degrees;
    // A float holds 1 - 0.999 to 3e-5 of itself, which moves the quantile by about 6e-5.
    EXPECT_NEAR(jml::chi_square_quantile(0.999F, degrees), percent_999[degrees - 1], 1e-3) << degrees;
  }
}

TEST(ChiSquare, PrintedIntervalsOfAveragedErrors) {
  // Two-sided 95 % intervals of the mean of N squared errors with n degrees each: quantiles of n N degrees
  // over N.
  const struct {
    int n, runs;
    double low, high;
  } table[] = {{1, 50, 0.647, 1.428},  {1, 100, 0.742, 1.296}, {1, 1000, 0.914, 1.090},
               {2, 50, 1.484, 2.591},  {2, 100, 1.627, 2.411}, {3, 50, 2.360, 3.716},
               {3, 100, 2.539, 3.499}, {4, 50, 3.255, 4.821},  {4, 100, 3.465, 4.573}};
  for (const auto& row : table) {
    EXPECT_NEAR(jml::chi_square_quantile(0.025, row.n * row.runs) / row.runs, row.low, 5.1e-4)
        << row.n << " " << row.runs;
    EXPECT_NEAR(jml::chi_square_quantile(0.975, row.n * row.runs) / row.runs, row.high, 5.1e-4)
        << row.n << " " << row.runs;
  }
}

/// P(χ² > value) by Simpson's rule on the density, with t = s² so that one degree has no pole. An independent
/// oracle.
long double tail_by_quadrature(long double value, int degrees) {
  const long double half = degrees / 2.0L;
  const auto density = [&](long double s) {  // of s = √χ²
    return std::exp((2 * half - 1) * std::log(s) - s * s / 2 + (1 - half) * std::log(2.0L) -
                    std::lgamma(half));
  };
  // Beyond √(value + 140) less than e^-60 of the tail is left.
  const int panels = 40000;
  const long double from = std::sqrt(value), h = (std::sqrt(value + 140) - from) / panels;
  long double sum = 0;
  for (int i = 0; i <= panels; ++i)
    sum += density(from + i * h) * (i == 0 || i == panels ? 1 : i % 2 == 1 ? 4 : 2);
  return sum * h / 3;
}

TEST(ChiSquare, TailIsTheIntegralOfTheDensity) {
  for (int degrees = 1; degrees <= 15; ++degrees) {
    for (const double value : {0.01, 0.5, 1.0, 3.0, 10.0, 40.0, 100.0}) {
      const auto wanted = static_cast<double>(tail_by_quadrature(value, degrees));
      EXPECT_NEAR(jml::chi_square_upper_tail(value, degrees), wanted, 1e-12 * wanted)
          << degrees << " " << value;
    }
  }
}

TEST(ChiSquare, TailAtItsEnds) {
  for (int degrees = 1; degrees <= 7; ++degrees) {
    EXPECT_EQ(jml::chi_square_upper_tail(0.0, degrees), 1);
    EXPECT_EQ(jml::chi_square_upper_tail(-3.0, degrees), 1);
    EXPECT_EQ(jml::chi_square_upper_tail(1e5, degrees), 0);
  }
  EXPECT_TRUE(std::isnan(jml::chi_square_upper_tail(nan, 2)));
}

TEST(ChiSquare, QuantileInvertsTheTail) {
  for (int degrees = 1; degrees <= 12; ++degrees) {
    double last = 0;
    for (const double probability : {1e-6, 0.01, 0.3, 0.5, 0.9, 0.999, 1 - 1e-9}) {
      const double value = jml::chi_square_quantile(probability, degrees);
      EXPECT_GT(value, last);
      last = value;
      EXPECT_NEAR(jml::chi_square_upper_tail(value, degrees), 1 - probability, 1e-13)
          << degrees << " " << probability;
    }
  }
}

TEST(ChiSquare, QuantileRefusesWhatIsNoProbability) {
  for (const double bad : {0.0, 1.0, -0.1, 1.1, nan})
    EXPECT_TRUE(std::isnan(jml::chi_square_quantile(bad, 3))) << bad;
  EXPECT_TRUE(std::isnan(jml::chi_square_quantile(0.5, 0)));
}

TEST(Gate, OpensAtItsQuantileAndNeverForNotANumber) {
  const jml::Gate gate{0.99};
  EXPECT_TRUE(gate.passes(6.634, 1));
  EXPECT_FALSE(gate.passes(6.636, 1));
  EXPECT_TRUE(gate.passes(13.276, 4));
  EXPECT_FALSE(gate.passes(13.278, 4));
  EXPECT_TRUE(gate.passes(0.0, 4));
  EXPECT_FALSE(gate.passes(nan, 1));
  EXPECT_FALSE(gate.passes(-1.0, 1)) << "a negative NIS comes from a matrix that is no covariance";
}

TEST(Gate, OffLetsAllPassAndBadProbabilitiesAreInvalid) {
  EXPECT_TRUE(jml::Gate{}.off());
  EXPECT_TRUE(jml::Gate{}.valid());
  EXPECT_TRUE(jml::Gate{}.passes(1e300, 1));
  for (const double bad : {0.0, -0.5, 1.0000001, nan}) EXPECT_FALSE(jml::Gate{bad}.valid()) << bad;
  EXPECT_TRUE(jml::Gate{0.5}.valid());
}

}  // namespace
