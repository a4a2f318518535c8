// SPDX-License-Identifier: BSD-3-Clause
// The pivots of a covariance P = L D Lᵀ and what rounding has grown by in them, of an L and a D that are
// known beforehand: in any units, where products of two variances are no numbers too; indefinite and infinite
// ones are named.
#include <gtest/gtest.h>

#include <cmath>
#include <jml/campaign/noise.hpp>
#include <jml/pivots.hpp>
#include <limits>

namespace {

using jml::detail::Pivots;

template <typename Scalar, int n>
struct Known {
  jml::Matrix<Scalar, n, n> P;
  jml::Vector<Scalar, n> sizes;
  double loss = 0;
};

/// D over `decades`, L of entries up to 1, in units about 10^`units`; `flipped`: that entry of D is negative.
template <typename Scalar, int n>
Known<Scalar, n> make(jml::Noise& noise, double decades, double units, int flipped = -1) {
  long double L[n][n] = {}, D[n], unit[n], from[n];
  Known<Scalar, n> out;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) L[i][j] = std::tanh(noise.normal());
    L[i][i] = 1;
    D[i] = std::pow(10.0L, -decades * std::abs(std::tanh(noise.normal())));
    if (i == flipped) D[i] = -D[i];
    unit[i] = std::pow(10.0L, units + std::round(2 * std::tanh(noise.normal())));
  }
  for (int i = 0; i < n; ++i) {
    long double variance = 0;
    for (int j = 0; j < n; ++j) {
      long double sum = 0;
      for (int k = 0; k <= i && k <= j; ++k) sum += L[i][k] * D[k] * L[j][k];
      // what is above the diagonal is not to be read
      out.P(i, j) =
          j > i ? std::numeric_limits<Scalar>::quiet_NaN() : static_cast<Scalar>(sum * unit[i] * unit[j]);
      if (i == j) variance = sum;
    }
    from[i] = (1 + std::abs(noise.normal())) * std::abs(variance);
    out.sizes(i) = static_cast<Scalar>(from[i] * unit[i] * unit[i]);
    for (int k = 0; k < i; ++k) from[i] += L[i][k] * L[i][k] * from[k];
    out.loss = std::max(out.loss, static_cast<double>(from[i] / D[i]));
  }
  return out;
}

/// As a step asks; of two states it is `loss` that is no number where one of P is none.
template <typename Scalar, int n>
Pivots<Scalar> asked(const Known<Scalar, n>& known) {
  const auto found = jml::detail::pivots_of(known.P, known.sizes);
  return found.positive ? found : jml::detail::pivots_with_zeros<Scalar, n>(known.P, known.sizes);
}
template <typename Scalar>
bool held(const Pivots<Scalar>& found) {
  return found.positive && found.loss <= std::numeric_limits<Scalar>::max();
}

template <typename Scalar, int n>
void check() {
  SCOPED_TRACE(n);
  constexpr bool single = std::is_same_v<Scalar, float>;
  const double decades = single ? 2 : 4, tolerance = single ? 2e-2 : 1e-9;
  jml::Noise noise(static_cast<std::uint64_t>(n));
  for (int run = 0; run < 60; ++run) {
    // Variances of some 1e±200 in double, 1e28 and 1e-22 in float: a product of two is no number.
    const double units = run < 20   ? 0
                         : run < 40 ? (single ? 14 : 100)
                                    : (single     ? -11
                                       : run < 50 ? -100
                                                  : -78);
    const auto known = make<Scalar, n>(noise, decades, units);
    const auto found = asked(known);
    ASSERT_TRUE(found.positive) << run;
    ASSERT_GE(found.loss / known.loss, 1 - tolerance) << run;
    ASSERT_LE(found.loss / known.loss, n == 2 ? 2 : 1 + tolerance) << run;  // of two the sum is taken
    const auto again = jml::detail::pivots_with_zeros<Scalar, n>(known.P, known.sizes);
    ASSERT_TRUE(again.positive) << run;
    ASSERT_NEAR(again.loss / found.loss, 1, tolerance) << run;
    if (run < 20) {
      ASSERT_TRUE(jml::detail::pivots_of(known.P, known.sizes).positive) << run;
    }
    for (int i = 0; i < n; ++i) {
      ASSERT_FALSE(held(asked(make<Scalar, n>(noise, 1, units, i)))) << run << ' ' << i;
      for (int j = 0; j <= i; ++j) {
        for (const Scalar bad :
             {std::numeric_limits<Scalar>::quiet_NaN(), std::numeric_limits<Scalar>::infinity()}) {
          auto spoilt = known;
          spoilt.P(i, j) = bad;
          if (i == j) spoilt.sizes(i) = bad;  // what a variance came from is no less
          ASSERT_FALSE(held(asked(spoilt))) << run << ' ' << i << ' ' << j << ' ' << bad;
        }
      }
    }
  }
}

TEST(Pivots, OfKnownFactorsInDouble) {
  check<double, 1>();
  check<double, 2>();
  check<double, 3>();
  check<double, 4>();
  check<double, 5>();
  check<double, 6>();
  check<double, 7>();
  check<double, 8>();
  check<double, 9>();
  check<double, 15>();
}

TEST(Pivots, OfKnownFactorsInFloat) {
  check<float, 3>();
  check<float, 6>();
  check<float, 10>();
}

// The last two are so small that their product has few digits or none: they are asked one by one.
TEST(Pivots, AProductThatIsNoNumberAtTheEnd) {
  for (const double unit : {1e-160, 1e-157, 1e-154, 1.0, 1e160}) {
    Known<double, 4> known;
    known.P = jml::kernel::identity<jml::Matrix<double, 4, 4>>();
    known.P(2, 2) = known.P(3, 3) = 2.123456789 * unit;
    known.P(3, 2) = unit;
    known.sizes = 3 * jml::kernel::diagonal(known.P);
    const double l = 1 / 2.123456789, size = 3 * 2.123456789;
    EXPECT_NEAR(asked(known).loss, (size + l * l * size) / (2.123456789 - l), 1e-12) << unit;
  }
}

// A state that is known exactly counts for nothing, where its size says so too.
TEST(Pivots, AZeroThatIsMeant) {
  jml::Noise noise(7);
  auto known = make<double, 4>(noise, 2, 0);
  for (int i = 0; i < 4; ++i) known.P(i > 2 ? i : 2, i > 2 ? 2 : i) = 0;
  EXPECT_FALSE(asked(known).positive);
  known.sizes(2) = 0;
  EXPECT_FALSE(jml::detail::pivots_of(known.P, known.sizes).positive);
  EXPECT_TRUE(asked(known).positive);
}

}  // namespace
