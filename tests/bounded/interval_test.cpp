// SPDX-License-Identifier: BSD-3-Clause
// Interval arithmetic: every exact result is inside, and little else.
#include <gtest/gtest.h>

#include <jml/bounded/interval.hpp>

#include "random_intervals.hpp"

namespace {

using namespace jml::operators;

template <typename Base>
struct IntervalTest : testing::Test {};
using Bases = testing::Types<float, double>;
TYPED_TEST_SUITE(IntervalTest, Bases);

constexpr int runs = 100000;

/// op of random intervals contains op of numbers in them. A result may be unbounded, but not NaN.
template <typename Base, typename Op>
void check_containment(std::uint64_t seed, const Op& op) {
  RandomIntervals<Base> random{jml::Noise(seed)};
  int outside = 0, undefined = 0;
  for (int k = 0; k < runs; ++k) {
    const jml::Interval<Base> a = random.of_any(), b = random.of_any();
    const jml::Interval<Base> c = op(a, b);
    undefined += isnan(c);
    for (int i = 0; i < 3; ++i) {
      const long double x = random.inside(a), y = random.inside(b), exact = op(x, y);
      if (std::isfinite(exact)) outside += !encloses(c, exact);
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_EQ(undefined, 0);
}

TYPED_TEST(IntervalTest, SumsContainTheExactSums) {
  check_containment<TypeParam>(1, [](const auto& a, const auto& b) { return a + b; });
}
TYPED_TEST(IntervalTest, DifferencesContainTheExactDifferences) {
  check_containment<TypeParam>(2, [](const auto& a, const auto& b) { return a - b; });
}
TYPED_TEST(IntervalTest, ProductsContainTheExactProducts) {
  check_containment<TypeParam>(3, [](const auto& a, const auto& b) { return a * b; });
}
TYPED_TEST(IntervalTest, QuotientsContainTheExactQuotients) {
  check_containment<TypeParam>(4, [](const auto& a, const auto& b) { return a / b; });
}
TYPED_TEST(IntervalTest, SquaresContainTheExactSquares) {
  check_containment<TypeParam>(5, [](const auto& a, const auto&) { return a * a; });
}
TYPED_TEST(IntervalTest, ALongerExpressionContainsItsValues) {
  check_containment<TypeParam>(
      6, [](const auto& a, const auto& b) { return (a * b - 3 * a) / (1 + b * b) + (a - 2) * (b + 0.375f); });
}

// Of single numbers: one ulp on either side of the rounded result, so at most 1.5 from the exact one, which
// is up to twice as many ε; no more even where the product is subnormal.
TYPED_TEST(IntervalTest, ResultsOfNumbersAreAnUlpWide) {
  RandomIntervals<TypeParam> random{jml::Noise(7)};
  double worst = 0;
  for (int k = 0; k < runs; ++k) {
    const TypeParam x = random.any(), y = random.any();
    const jml::Interval<TypeParam> a(x), b(y);
    const long double X = x, Y = y;
    const auto look = [&](const jml::Interval<TypeParam>& c, long double exact) {
      if (std::abs(exact) < std::numeric_limits<TypeParam>::max() / 2)
        worst = std::max(worst, excess(c, exact, exact));
    };
    look(a + b, X + Y);
    look(a - b, X - Y);
    look(a * b, X * Y);
    if (y != 0) look(a / b, X / Y);
    look(a * a, X * X);
  }
  EXPECT_LE(worst, 1.51);
  EXPECT_GE(worst, 1);
}

// Ends against the exact range, from the products and quotients of the ends.
TYPED_TEST(IntervalTest, RangesAreTight) {
  RandomIntervals<TypeParam> random{jml::Noise(8)};
  double worst = 0;
  for (int k = 0; k < runs; ++k) {
    const jml::Interval<TypeParam> a = random.within(-4, 4), b = random.within(-4, 4);
    long double products[4], quotients[4];
    for (int i = 0; i < 4; ++i) {
      const long double x = i < 2 ? a.low : a.high, y = i % 2 == 0 ? b.low : b.high;
      products[i] = x * y;
      quotients[i] = x / y;
    }
    const auto [low, high] = std::minmax_element(products, products + 4);
    worst = std::max(worst, excess(a * b, *low, *high));
    if (contains_zero(b)) continue;
    const auto [least, most] = std::minmax_element(quotients, quotients + 4);
    worst = std::max(worst, excess(a / b, *least, *most));
  }
  EXPECT_LE(worst, 1.51);
}

TYPED_TEST(IntervalTest, ExactWhereItCostsNothing) {
  using I = jml::Interval<TypeParam>;
  const auto same = [](const I& a, TypeParam low, TypeParam high) {
    EXPECT_EQ(a.low, low);
    EXPECT_EQ(a.high, high);
  };
  const I a(TypeParam(0.1), TypeParam(0.7)), zero, point(TypeParam(0.3));
  same(-a, -a.high, -a.low);
  same(a + zero, a.low, a.high);
  same(zero + a, a.low, a.high);
  same(a - 0, a.low, a.high);
  same(0.0 - a, -a.high, -a.low);
  same(a * zero, 0, 0);
  same(0 * a, 0, 0);
  same(zero / a, 0, 0);
  same(point - point, 0, 0);
  same(I(-2, 3) * I(0), 0, 0);
  EXPECT_EQ((I(0, 1) * I(-2, -1)).high, 0);
  EXPECT_EQ((I(0, 1) * I(1, 2)).low, 0);
  EXPECT_EQ((I(-2, -1) * I(0, std::numeric_limits<TypeParam>::infinity())).high, 0);
  EXPECT_EQ((I(0, 1) / I(-2, -1)).high, 0);
  same(I::whole() * zero, 0, 0);
  same(zero * I::whole(), 0, 0);
}

TYPED_TEST(IntervalTest, InfiniteEnds) {
  using I = jml::Interval<TypeParam>;
  using Limits = std::numeric_limits<TypeParam>;
  constexpr TypeParam infinite = Limits::infinity(), largest = Limits::max();
  const I whole = I::whole(), up(1, infinite), down(-infinite, -2), half(0, infinite);
  EXPECT_FALSE(isfinite(whole));
  for (const I& a : {whole + 1, whole - whole, whole * I(2, 3), whole * I::whole(), up - up, up + down,
                     half * down + up, whole * I(0, 1), I(-1, 1) * up, I(-1, 1) * whole}) {
    EXPECT_EQ(a.low, -infinite);
    EXPECT_EQ(a.high, infinite);
  }
  EXPECT_EQ((up * up).high, infinite);
  EXPECT_GT((up * I(2, 3)).low, TypeParam(1.99));
  EXPECT_EQ((half * I(0, 1)).low, 0);
  EXPECT_EQ((half * I(0, 1)).high, infinite);
  EXPECT_EQ((I(-3, infinite) * I(0, 1)).high, infinite);
  EXPECT_EQ((I(0, 1) * I(-3, infinite)).high, infinite);
  EXPECT_LE((I(0, 1) * I(-3, infinite)).low, -3);
  EXPECT_LE((1 / up).low, 0);
  EXPECT_GE((1 / up).high, 1);
  // Overflow: the end that must stay inside is the largest number.
  for (const I& a :
       {I(largest) * 2, I(largest) + largest, I(largest) / TypeParam(0.25), I(largest) * I(largest)}) {
    EXPECT_EQ(a.low, largest);
    EXPECT_EQ(a.high, infinite);
  }
  EXPECT_EQ((-I(largest) - largest).high, -largest);
  const I big(-largest, largest);
  EXPECT_EQ((big * big).low, 0);
}

TYPED_TEST(IntervalTest, DivisionByWhatContainsZero) {
  using I = jml::Interval<TypeParam>;
  for (const I& b : {I(-1, 1), I(0, 1), I(-1, 0), I(0), I::whole()}) {
    const I c = I(1, 2) / b;
    EXPECT_EQ(c.low, -std::numeric_limits<TypeParam>::infinity());
    EXPECT_EQ(c.high, std::numeric_limits<TypeParam>::infinity());
    EXPECT_FALSE(isnan(I(0) / b));
  }
}

TYPED_TEST(IntervalTest, NanIsHandedOn) {
  using I = jml::Interval<TypeParam>;
  const I lost = I::undefined();
  const TypeParam nan = lost.low;
  for (const I& bad : {lost, I(nan, 1), I(1, nan), I(-1, nan), I(nan, nan)}) {
    for (const I& other : {I(1, 2), I(-1, 2), I(0), I::whole(), I(-2, -1), bad}) {
      for (const I& c : {bad + other, other + bad, bad - other, other - bad, bad * other, other * bad,
                         bad / other, other / bad, hull(bad, other), bad * bad}) {
        EXPECT_TRUE(isnan(c));
        EXPECT_FALSE(isfinite(c));
      }
      I common;
      EXPECT_FALSE(intersect(bad, other, common) && isfinite(common));
    }
  }
}

// A product of an object with itself is a square; of its copies it is not known to be.
TYPED_TEST(IntervalTest, AnObjectTimesItselfIsASquare) {
  using I = jml::Interval<TypeParam>;
  const jml::Vector<I, 2> x(I(-1, 2), I(3));
  const I copy = x(0);
  EXPECT_EQ((x(0) * x(0)).low, 0);
  EXPECT_LE((x(0) * copy).low, -2);
  EXPECT_EQ((x(0) * x(0)).high, (x(0) * copy).high);
  EXPECT_EQ(square(I(-3, 1)).low, 0);
  EXPECT_GE(square(I(-3, 1)).high, 9);
  EXPECT_GT(square(I(-3, -1)).low, TypeParam(0.99));
  EXPECT_EQ(square(I(std::numeric_limits<TypeParam>::min())).low, 0);  // underflow
  EXPECT_GT(square(I(std::numeric_limits<TypeParam>::min())).high, 0);
}

TYPED_TEST(IntervalTest, Helpers) {
  using I = jml::Interval<TypeParam>;
  using Limits = std::numeric_limits<TypeParam>;
  EXPECT_EQ(I(1, 3).centre(), 2);
  EXPECT_GE(I(1, 3).width(), 2);
  EXPECT_EQ(I(5).radius(), 0);
  EXPECT_TRUE(I(1, 3).contains(1) && I(1, 3).contains(3) && !I(1, 3).contains(TypeParam(3.1)));
  EXPECT_TRUE(I(1, 3).contains(I(1, 2)));
  EXPECT_FALSE(I(1, 3).contains(I(0, 2)) || I(1, 3).contains(I(2, 4)) ||
               I(1, 3).contains(Limits::quiet_NaN()));
  I common(7);
  EXPECT_TRUE(intersect(I(1, 3), I(2, 5), common));
  EXPECT_TRUE(common.low == 2 && common.high == 3);
  EXPECT_FALSE(intersect(I(1, 2), I(3, 4), common));
  EXPECT_TRUE(common.low == 2 && common.high == 3);
  EXPECT_TRUE(intersect(I(1, 2), I(2, 4), common));
  EXPECT_TRUE(common.low == 2 && common.high == 2);
  EXPECT_TRUE(hull(I(1, 2), I(4, 5)).low == 1 && hull(I(1, 2), I(4, 5)).high == 5);
  EXPECT_TRUE(mag(I(-3, 2)) == 3 && mig(I(-3, 2)) == 0 && mig(I(-3, -2)) == 2 && mig(I(2, 3)) == 2);
  EXPECT_TRUE(is_positive(I(1, 2)) && !is_positive(I(0, 2)) && is_negative(I(-2, -1)) &&
              !is_negative(I(-1, 0)));
  EXPECT_TRUE(contains_zero(I(0, 1)) && contains_zero(I(-1, 0)) && !contains_zero(I(1, 2)));

  RandomIntervals<TypeParam> random{jml::Noise(9)};
  for (int k = 0; k < runs; ++k) {
    const I a = random.of_any();
    const TypeParam c = a.centre(), r = a.radius();
    ASSERT_TRUE(std::isfinite(c) && a.contains(c));
    ASSERT_LE(static_cast<long double>(c) - r, static_cast<long double>(a.low));
    ASSERT_GE(static_cast<long double>(c) + r, static_cast<long double>(a.high));
    ASSERT_GE(a.width(), static_cast<long double>(a.high) - a.low);
  }
  EXPECT_EQ(I(Limits::max()).centre(), Limits::max());
  EXPECT_EQ(I::whole().centre(), 0);
  EXPECT_EQ(I::whole().radius(), Limits::infinity());
  EXPECT_EQ(I(-Limits::max(), Limits::max()).centre(), 0);
}

// A number of another type is enclosed: exactly where it fits.
TEST(IntervalConversion, OutwardFromOtherTypes) {
  const auto holds = [](const auto& a, auto number) {
    return static_cast<long double>(a.low) <= static_cast<long double>(number) &&
           static_cast<long double>(number) <= static_cast<long double>(a.high);
  };
  const jml::Interval<float> tenth = 0.1, third = 1 / 3.0, half = 0.5, huge = 1e300, tiny = -1e-300;
  EXPECT_TRUE(holds(tenth, 0.1) && holds(third, 1 / 3.0) && holds(huge, 1e300) && holds(tiny, -1e-300));
  EXPECT_LT(tenth.low, 0.1);
  EXPECT_GT(tenth.high, 0.1);
  EXPECT_LT(tenth.width(), 3e-8f);
  EXPECT_EQ(half.width(), 0);
  EXPECT_EQ(huge.low, std::numeric_limits<float>::max());
  const jml::Interval<double> wide = 0.1L, from_float = 0.1f;
  EXPECT_TRUE(holds(wide, 0.1L));
  EXPECT_EQ(from_float.low, from_float.high);
  const std::int64_t odd = (std::int64_t{1} << 53) + 1;
  EXPECT_TRUE(holds(jml::Interval<double>(odd), odd));
  EXPECT_GT(jml::Interval<double>(odd).width(), 0);
  EXPECT_GT(jml::Interval<float>((1 << 24) + 1).width(), 0);
  EXPECT_TRUE(holds(jml::Interval<float>((1 << 24) + 1), (1 << 24) + 1));
  EXPECT_EQ(jml::Interval<float>(1 << 23).width(), 0);
  EXPECT_EQ(jml::Interval<double>(-7).width(), 0);
  EXPECT_TRUE(holds(jml::Interval<double>(std::numeric_limits<std::uint64_t>::max()),
                    std::numeric_limits<std::uint64_t>::max()));
  EXPECT_TRUE(isnan(jml::Interval<float>(std::numeric_limits<double>::quiet_NaN())));
}

// By rational arithmetic: 1/10 + 2/10, 1/3, 49 (1/49), 0.1 · 0.1 of the doubles; the doubles next to the
// exact value on either side must be inside, the next but two must not.
TEST(IntervalKnown, AgainstExactRationals) {
  const auto known = [](const jml::Interval<double>& a, double below, double above) {
    EXPECT_TRUE(a.contains(below) && a.contains(above));
    EXPECT_LT(a.width(), 4 * (above - below));
  };
  using I = jml::Interval<double>;
  known(I(0.1) + 0.2, 0x1.3333333333333p-2, 0x1.3333333333334p-2);
  known(1 / I(3), 0x1.5555555555555p-2, 0x1.5555555555556p-2);
  known(I(0.1) * 0.1, 0x1.47ae147ae147bp-7, 0x1.47ae147ae147cp-7);
  known(I(0.3) - 0.1, 0x1.9999999999999p-3, 0x1.999999999999ap-3);
  known(I(10) / 0.3, 0x1.0aaaaaaaaaaaap+5, 0x1.0aaaaaaaaaaabp+5);
}

TEST(IntervalInEigen, ProductsWithNumbersAndMatrices) {
  using I = jml::Interval<double>;
  jml::Matrix<double, 2, 2> F;
  F << 1, -2, 0.5, 4;
  const jml::Vector<I, 2> x(I(-1, 2), I(3, 5));
  const jml::Vector<I, 2> y = F * x, z = 0.5 * x + x * 2.0 - F.cast<I>() * x, w = 1.0f * x;
  EXPECT_TRUE(y(0).contains(I(-11, -4)) && y(0).width() < 7.0001);
  EXPECT_TRUE(y(1).contains(I(11.5, 21)) && y(1).width() < 9.5001);
  EXPECT_TRUE(z(0).contains(I(-2.5 + 4, 5 + 11)));
  EXPECT_TRUE(w(1).contains(5));
  const jml::Matrix<I, 2, 2> identity = jml::Matrix<I, 2, 2>::Identity();
  const jml::Vector<I, 2> same = identity * x;
  EXPECT_TRUE(same(0).contains(x(0)) && same(0).width() < 3.0001);
  const I scalar = 1.0 - x(0), product = x(0) * 0.05 + 2;
  EXPECT_TRUE(scalar.contains(I(-1, 2)) && product.contains(I(1.95, 2.1)));
}

}  // namespace
