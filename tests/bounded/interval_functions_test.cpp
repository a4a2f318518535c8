// SPDX-License-Identifier: BSD-3-Clause
// Elementary functions of intervals against the same in long double, and against values computed with 60
// digits.
#include <gtest/gtest.h>

#include <jml/bounded/interval_functions.hpp>

#include "random_intervals.hpp"

namespace {

template <typename Base>
struct IntervalFunctions : testing::Test {};
using Bases = testing::Types<float, double>;
TYPED_TEST_SUITE(IntervalFunctions, Bases);

constexpr int runs = 34000, points = 3;

/// f of random intervals contains f of numbers in them, wherever that is a number: of every size, and from
/// [low, high], where f is also tight for single numbers: `slack` in ε.
template <typename Base, typename F>
void check(std::uint64_t seed, double low, double high, double slack, const F& f) {
  RandomIntervals<Base> random{jml::Noise(seed)};
  int outside = 0, undefined = 0;
  double worst = 0;
  for (int k = 0; k < runs; ++k) {
    const jml::Interval<Base> a =
        k % 2 == 0 ? random.of_any() : random.within(static_cast<Base>(low), static_cast<Base>(high));
    const jml::Interval<Base> b = f(a);
    for (int i = 0; i < points; ++i) {
      const long double exact = f(static_cast<long double>(random.inside(a)));
      if (!std::isfinite(exact)) continue;
      outside += !encloses(b, exact);
      undefined += isnan(b);
    }
    if (k % 2 == 1 && a.low == a.high) {
      const long double exact = f(static_cast<long double>(a.low));
      if (std::isfinite(exact)) worst = std::max(worst, excess(b, exact, exact));
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_EQ(undefined, 0);
  EXPECT_LE(worst, slack);
  EXPECT_TRUE(isnan(f(jml::Interval<Base>::undefined())));
}

// 4 ε for the library, up to 1 for what it really errs, 1/2 for the rounding of the end.
constexpr double library = 5.6, rooted = 1.51;

#define FUNCTION(name, low, high, slack)                             \
  TYPED_TEST(IntervalFunctions, name) {                              \
    check<TypeParam>(__LINE__, low, high, slack, [](const auto& x) { \
      using std::name;                                               \
      return name(x);                                                \
    });                                                              \
  }
FUNCTION(sin, -10, 10, library)
FUNCTION(cos, -10, 10, library)
FUNCTION(tan, -1.5, 1.5, library)
FUNCTION(asin, -1, 1, library)
FUNCTION(acos, -1, 1, library)
FUNCTION(atan, -5, 5, library)
FUNCTION(sinh, -5, 5, library)
FUNCTION(cosh, -5, 5, library)
FUNCTION(tanh, -5, 5, library)
FUNCTION(asinh, -5, 5, library)
FUNCTION(exp, -20, 20, library)
FUNCTION(expm1, -5, 5, library)
FUNCTION(log, -1, 20, library)
FUNCTION(log10, -1, 20, library)
FUNCTION(log1p, -2, 20, library)
FUNCTION(erf, -3, 3, library)
FUNCTION(cbrt, -9, 9, 8)
FUNCTION(sqrt, -1, 9, rooted)
FUNCTION(abs, -2, 2, 0)
FUNCTION(fabs, -2, 2, 0)
#undef FUNCTION

/// The same of two arguments.
template <typename Base, typename F>
void check_two(std::uint64_t seed, double low, double high, double slack, const F& f) {
  RandomIntervals<Base> random{jml::Noise(seed)};
  const auto from = static_cast<Base>(low), to = static_cast<Base>(high);
  int outside = 0, undefined = 0;
  double worst = 0;
  for (int k = 0; k < runs; ++k) {
    const bool anything = k % 2 == 0;
    const jml::Interval<Base> a = anything ? random.of_any() : random.within(from, to);
    const jml::Interval<Base> b = anything ? random.of_any() : random.within(from, to);
    const jml::Interval<Base> c = f(a, b);
    for (int i = 0; i < points; ++i) {
      const long double x = random.inside(a), y = random.inside(b), exact = f(x, y);
      if (!std::isfinite(exact)) continue;
      outside += !encloses(c, exact);
      undefined += isnan(c);
    }
    if (!anything && a.low == a.high && b.low == b.high) {
      const long double exact = f(static_cast<long double>(a.low), static_cast<long double>(b.low));
      if (std::isfinite(exact)) worst = std::max(worst, excess(c, exact, exact));
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_EQ(undefined, 0);
  EXPECT_LE(worst, slack);
}

TYPED_TEST(IntervalFunctions, hypot) {
  check_two<TypeParam>(1, -3, 3, library, [](const auto& x, const auto& y) {
    using std::hypot;
    return hypot(x, y);
  });
}
TYPED_TEST(IntervalFunctions, maximum) {
  check_two<TypeParam>(2, -3, 3, 0, [](const auto& x, const auto& y) {
    using std::max;
    return max(x, y);
  });
}
TYPED_TEST(IntervalFunctions, minimum) {
  check_two<TypeParam>(3, -3, 3, 0, [](const auto& x, const auto& y) {
    using std::min;
    return min(x, y);
  });
}
TYPED_TEST(IntervalFunctions, pow) {
  check_two<TypeParam>(4, 0, 4, library, [](const auto& x, const auto& y) {
    using std::pow;
    return pow(x, y);
  });
}
TYPED_TEST(IntervalFunctions, powConstant) {
  for (const double p : {-3.0, -0.5, 0.0, 0.1, 2.0, 2.5, 3.0}) {
    check<TypeParam>(5, -3, 3, 11, [p](const auto& x) {
      using std::pow;
      return pow(x, p);
    });
  }
  for (const int p : {-2, 4}) {
    check<TypeParam>(6, -3, 3, library, [p](const auto& x) {
      using std::pow;
      return pow(x, p);
    });
  }
}

// atan2 over boxes, against the corners.
TYPED_TEST(IntervalFunctions, atan2) {
  RandomIntervals<TypeParam> random{jml::Noise(7)};
  int outside = 0;
  double worst = 0;
  for (int k = 0; k < runs; ++k) {
    const bool anything = k % 2 == 0;
    const jml::Interval<TypeParam> y = anything ? random.of_any() : random.within(-3, 3);
    const jml::Interval<TypeParam> x = anything ? random.of_any() : random.within(-3, 3);
    const jml::Interval<TypeParam> a = atan2(y, x);
    for (int i = 0; i < points; ++i)
      outside += !encloses(a, std::atan2(static_cast<long double>(random.inside(y)),
                                         static_cast<long double>(random.inside(x))));
    const bool cut = contains_zero(y) && x.low <= 0;
    if (cut) {
      EXPECT_EQ(a.high, jml::pi<TypeParam>().high);
      EXPECT_EQ(a.low, -jml::pi<TypeParam>().high);
    } else if (!anything) {
      long double low = 4, high = -4;
      for (int i = 0; i < 4; ++i) {
        const long double corner = std::atan2(static_cast<long double>(i < 2 ? y.low : y.high),
                                              static_cast<long double>(i % 2 == 0 ? x.low : x.high));
        low = std::min(low, corner);
        high = std::max(high, corner);
      }
      worst = std::max(worst, excess(a, low, high));
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_LE(worst, library);
}

// The range of the sine by counting its extrema in long double; of the cosine by a shift of a quarter turn.
TYPED_TEST(IntervalFunctions, ExtremaOfSineAndCosine) {
  constexpr long double half_turn = 3.14159265358979323846264338327950288L;
  RandomIntervals<TypeParam> random{jml::Noise(8)};
  const double most = std::is_same_v<TypeParam, float> ? 2e3 : 1e6;
  const auto expect = [&](const jml::Interval<TypeParam>& a, const jml::Interval<TypeParam>& range,
                          long double shift, const auto& f) {
    const long double first = std::ceil(a.low / half_turn - shift),
                      last = std::floor(a.high / half_turn - shift);
    long double low = std::min(f(a.low), f(a.high)), high = std::max(f(a.low), f(a.high));
    for (long double k = first; k <= std::min(last, first + 1); ++k)
      (std::fmod(std::abs(k), 2) == 0 ? high : low) = std::fmod(std::abs(k), 2) == 0 ? 1 : -1;
    ASSERT_TRUE(static_cast<long double>(range.low) <= low && high <= static_cast<long double>(range.high))
        << a.low << ' ' << a.high;
    // An extremum just outside may be counted: 1 - cos of what the argument's ε leaves open.
    const double open = 4 * std::numeric_limits<TypeParam>::epsilon() * (most + 1) * 3.2;
    const double allowed = library * std::numeric_limits<TypeParam>::epsilon() + open * open;
    ASSERT_LE(static_cast<double>(low - static_cast<long double>(range.low)), allowed);
    ASSERT_LE(static_cast<double>(static_cast<long double>(range.high) - high), allowed);
    ASSERT_TRUE(range.low >= -1 && range.high <= 1);
  };
  for (int k = 0; k < runs; ++k) {
    const double size = random.noise.uniform() < 0.5 ? 10 : most - 10;
    const double middle = random.noise.uniform(-size, size),
                 radius = std::exp2(random.noise.uniform(-30, 2.5));
    const jml::Interval<TypeParam> a(static_cast<TypeParam>(middle - radius),
                                     static_cast<TypeParam>(middle + radius));
    expect(a, sin(a), 0.5L, [](long double x) { return std::sin(x); });
    expect(a, cos(a), 0, [](long double x) { return std::cos(x); });
  }
  // About k π/2, and ending on its neighbours.
  for (int k = -200; k <= 200; ++k) {
    const auto at = static_cast<TypeParam>(k * half_turn / 2);
    const TypeParam before = std::nextafter(at, TypeParam(-1000)),
                    after = std::nextafter(at, TypeParam(1000));
    for (const auto& [low, high] :
         {std::pair(before, after), std::pair(at - TypeParam(0.01), at),
          std::pair(at - TypeParam(0.01), after), std::pair(at, at + TypeParam(0.01)),
          std::pair(before, at + TypeParam(1)), std::pair(at, at)}) {
      const jml::Interval<TypeParam> a(low, high);
      expect(a, sin(a), 0.5L, [](long double x) { return std::sin(x); });
      expect(a, cos(a), 0, [](long double x) { return std::cos(x); });
    }
    const jml::Interval<TypeParam> around(before, after);
    if (k % 4 == 0) {
      EXPECT_EQ(cos(around).high, 1);
    }
    if (k % 4 == 1 || k % 4 == -3) {
      EXPECT_EQ(sin(around).high, 1);
    }
    if (k % 4 == 2 || k % 4 == -2) {
      EXPECT_EQ(cos(around).low, -1);
    }
    if (k % 4 == 3 || k % 4 == -1) {
      EXPECT_EQ(sin(around).low, -1);
    }
    if (k % 2 != 0) {
      EXPECT_FALSE(isfinite(tan(around)));
    }
  }
}

TYPED_TEST(IntervalFunctions, SineOfWideAndOfLargeArguments) {
  using I = jml::Interval<TypeParam>;
  const TypeParam infinite = std::numeric_limits<TypeParam>::infinity();
  for (const I& a : {I(0, 7), I(-4, 3), I(TypeParam(1e9)), I(TypeParam(-1e9)), I::whole(), I(0, infinite),
                     I(TypeParam(1e30), TypeParam(2e30))}) {
    EXPECT_TRUE(sin(a).low == -1 && sin(a).high == 1 && cos(a).low == -1 && cos(a).high == 1);
  }
  EXPECT_FALSE(isfinite(tan(I(TypeParam(1e9)))));
  EXPECT_FALSE(isfinite(tan(I(1, 2))));
  EXPECT_TRUE(isfinite(tan(I(2, 4))));
}

// Partly outside of the domain: over what is inside. Entirely outside: NaN.
TYPED_TEST(IntervalFunctions, Domains) {
  using I = jml::Interval<TypeParam>;
  constexpr TypeParam infinite = std::numeric_limits<TypeParam>::infinity();
  EXPECT_TRUE(sqrt(I(-1, 4)).low == 0 && sqrt(I(-1, 4)).contains(2) &&
              sqrt(I(-1, 4)).high < TypeParam(2.0001));
  EXPECT_TRUE(log(I(-1, 1)).low == -infinite && log(I(-1, 1)).contains(0) &&
              log(I(-1, 1)).high < TypeParam(1e-30));
  EXPECT_EQ(log(I(0, 1)).low, -infinite);
  EXPECT_EQ(log10(I(-1, 1)).low, -infinite);
  EXPECT_EQ(log1p(I(-2, 0)).low, -infinite);
  EXPECT_EQ(log1p(I(-2, 0)).high, 0);
  EXPECT_TRUE(asin(I(-3, 3)).contains(I(TypeParam(-1.57), TypeParam(1.57))) &&
              acos(I(-3, 3)).contains(I(0, TypeParam(3.14))));
  EXPECT_TRUE(acos(I(-3, 3)).low == 0 && acos(I(-3, 3)).high == jml::pi<TypeParam>().high);
  EXPECT_TRUE(pow(I(-1, 4), 0.5).low == 0 && pow(I(-1, 4), 0.5).contains(2));
  for (const I& a :
       {sqrt(I(-4, -1)), log(I(-2, -1)), log(I(0)), log10(I(-1, 0)), log1p(I(-3, -1)), asin(I(2, 3)),
        acos(I(-3, -2)), pow(I(-2, -1), 0.5), pow(I(-2, -1), I(TypeParam(0.25), TypeParam(0.75)))})
    EXPECT_TRUE(isnan(a));
  for (const I& a : {max(I(1), I::undefined()), max(I::undefined(), I(1)), min(I(1), I::undefined()),
                     hypot(I::undefined(), I::whole()), atan2(I::undefined(), I(1)),
                     atan2(I(1), I::undefined()), pow(I::undefined(), 2), pow(I(2), I::undefined())})
    EXPECT_TRUE(isnan(a));
}

TYPED_TEST(IntervalFunctions, SpecialValues) {
  using I = jml::Interval<TypeParam>;
  constexpr TypeParam infinite = std::numeric_limits<TypeParam>::infinity(),
                      largest = std::numeric_limits<TypeParam>::max();
  for (const I& a : {sin(I(0)), tan(I(0)), asin(I(0)), atan(I(0)), sinh(I(0)), tanh(I(0)), asinh(I(0)),
                     expm1(I(0)), log1p(I(0)), erf(I(0)), cbrt(I(0)), sqrt(I(0)), abs(I(0)),
                     hypot(I(0), I(0)), atan2(I(0), I(1)), pow(I(0), 3), pow(I(0), 0.5)})
    EXPECT_TRUE(is_zero(a));
  EXPECT_TRUE(exp(I(-1e4, 1e4)).low == 0 && exp(I(-1e4, 1e4)).high == infinite);
  EXPECT_TRUE(exp(I(-1e4)).low == 0 && exp(I(-1e4)).high > 0);
  EXPECT_TRUE(exp(I(1e4)).low == largest && exp(I(1e4)).high == infinite);
  EXPECT_EQ(cosh(I(-1, 2)).low, 1);
  EXPECT_EQ(cosh(I::whole()).high, infinite);
  EXPECT_TRUE(tanh(I::whole()).low == -1 && tanh(I::whole()).high == 1);
  EXPECT_TRUE(erf(I(10)).high == 1 && expm1(I(-1e4)).low == -1);
  EXPECT_TRUE(atan(I::whole()).high == jml::pi<TypeParam>().high / 2);
  EXPECT_TRUE(pow(I(-2, 1), 2).low == 0 && pow(I(-2, 1), 4).low == 0 && pow(I(-2, 1), 4).contains(16));
  EXPECT_TRUE(pow(I(-2, 1), 3).contains(I(-8, 1)) && pow(I(-2, 1), 3).width() < TypeParam(9.0001));
  EXPECT_TRUE(pow(I(-2, -1), -1).contains(I(-1, TypeParam(-0.5))) &&
              pow(I(-2, -1), -2).contains(I(TypeParam(0.25), 1)));
  EXPECT_FALSE(isfinite(pow(I(-1, 2), -2)));
  EXPECT_TRUE(pow(I::whole(), 0).contains(1) && pow(I(2), 1e12).high == infinite);
  EXPECT_TRUE(pow(I(TypeParam(0.5), 2), I(-1, 2)).contains(I(TypeParam(0.25), 4)));
  EXPECT_TRUE(pow(I(-2, -1), I(1, 2)).contains(I(-2, 4)));
  EXPECT_TRUE(hypot(I(-3, 3), I(-1, 4)).low == 0 && hypot(I(-3, 3), I(-1, 4)).contains(5));
  EXPECT_TRUE(hypot(I::whole(), I(1)).high == infinite && hypot(I(largest), I(largest)).low == largest);
  EXPECT_TRUE(static_cast<long double>(jml::pi<TypeParam>().low) < 3.14159265358979323846264338327950288L &&
              3.14159265358979323846264338327950288L < static_cast<long double>(jml::pi<TypeParam>().high));
  EXPECT_EQ(std::nextafter(jml::pi<TypeParam>().low, TypeParam(4)), jml::pi<TypeParam>().high);
}

/// Every call as a model writes it.
template <typename T>
T as_in_a_model(const T& x, const T& y) {
  using std::sin, std::cos, std::tan, std::asin, std::acos, std::atan, std::atan2, std::sinh, std::cosh,
      std::tanh, std::asinh, std::exp, std::expm1, std::log, std::log1p, std::log10, std::sqrt, std::cbrt,
      std::abs, std::fabs, std::hypot, std::pow, std::min, std::max, std::erf, std::isfinite, std::isnan;
  T sum = sin(x) + cos(x) + tan(x) + asin(x) + acos(x) + atan(x) + sinh(x) + cosh(x) + tanh(x) + asinh(x) +
          exp(x);
  sum += expm1(x) + log(x) + log1p(x) + log10(x) + sqrt(x) + cbrt(x) + abs(x) + fabs(x) + erf(x);
  sum -= atan2(x, y) + atan2(x, 2.0) + atan2(0.5, x) + hypot(x, y) + hypot(x, 0.5) + hypot(2.0, x);
  sum *= 1.0 - (pow(x, y) + pow(x, 2) + pow(x, -1.5) + pow(2.0, x)) * 0.125f;
  sum /= 3 + max(x, y) + min(x, y) + max(x, 0.5) + min(x, 0.1);
  return isfinite(sum) && !isnan(sum) ? -sum : +sum;
}

TEST(IntervalLookup, EveryFunctionIsFound) {
  RandomIntervals<double> random{jml::Noise(9)};
  for (int k = 0; k < 1000; ++k) {
    const jml::Interval<double> x = random.within(0.1, 0.9), y = random.within(0.1, 0.9);
    const jml::Interval<double> z = as_in_a_model(x, y);
    const jml::Interval<double> dual =
        as_in_a_model(jml::Dual<jml::Interval<double>, 2>(x), jml::Dual<jml::Interval<double>, 2>(y)).value;
    const long double exact = as_in_a_model<double>(random.inside(x), random.inside(y));
    EXPECT_LT(z.width(), 1e3);
    const long double slack = 1e-13L * (1 + std::abs(exact));  // of the rounding in double
    EXPECT_TRUE(encloses(z + jml::Interval<double>(-1, 1) * slack, exact));
    EXPECT_TRUE(encloses(dual + jml::Interval<double>(-1, 1) * slack, exact));
  }
}

using I = jml::Interval<double>;
struct Known {
  I (*function)(I);
  double at, below, above;  // the doubles on either side of the exact value
};
constexpr Known known[] = {
    {[](I x) { return sin(x); }, 0.5, 0x1.eaee8744b05efp-2, 0x1.eaee8744b05f0p-2},
    {[](I x) { return sin(x); }, 355.0, -0x1.f9bd0307d1de3p-16, -0x1.f9bd0307d1de2p-16},
    {[](I x) { return sin(x); }, 1000000.0, -0x1.6664b2568d868p-2, -0x1.6664b2568d867p-2},
    {[](I x) { return cos(x); }, 0.5, 0x1.c1528065b7d4fp-1, 0x1.c1528065b7d50p-1},
    {[](I x) { return cos(x); }, -22.0, -0x1.fffadd8d4acdbp-1, -0x1.fffadd8d4acdap-1},
    {[](I x) { return cos(x); }, 1000000.0, 0x1.df9df9906d32cp-1, 0x1.df9df9906d32dp-1},
    {[](I x) { return tan(x); }, 1.5, 0x1.c33ed50b88777p+3, 0x1.c33ed50b88778p+3},
    {[](I x) { return tan(x); }, -3.0, 0x1.23ef71254b86fp-3, 0x1.23ef71254b870p-3},
    {[](I x) { return asin(x); }, 0.3, 0x1.380159e14f6fep-2, 0x1.380159e14f6ffp-2},
    {[](I x) { return asin(x); }, -0.999, -0x1.86ac9ad18f804p+0, -0x1.86ac9ad18f803p+0},
    {[](I x) { return acos(x); }, 0.3, 0x1.441f5ecbeef58p+0, 0x1.441f5ecbeef59p+0},
    {[](I x) { return acos(x); }, 0.999, 0x1.6e634e566a29dp-5, 0x1.6e634e566a29ep-5},
    {[](I x) { return atan(x); }, 0.3, 0x1.2a73a661eaf05p-2, 0x1.2a73a661eaf06p-2},
    {[](I x) { return atan(x); }, -1000.0, -0x1.91de2c0e658bdp+0, -0x1.91de2c0e658bcp+0},
    {[](I x) { return sinh(x); }, 0.3, 0x1.37d42af54b926p-2, 0x1.37d42af54b927p-2},
    {[](I x) { return sinh(x); }, 20.0, 0x1.ceb088b68e803p+27, 0x1.ceb088b68e804p+27},
    {[](I x) { return cosh(x); }, -0.3, 0x1.0b9b4e0b6ec4cp+0, 0x1.0b9b4e0b6ec4dp+0},
    {[](I x) { return cosh(x); }, 20.0, 0x1.ceb088b68e804p+27, 0x1.ceb088b68e805p+27},
    {[](I x) { return tanh(x); }, 0.3, 0x1.2a4dda7d914f9p-2, 0x1.2a4dda7d914fap-2},
    {[](I x) { return tanh(x); }, -3.0, -0x1.fd77d111a0b00p-1, -0x1.fd77d111a0affp-1},
    {[](I x) { return asinh(x); }, 0.3, 0x1.2ec4ea565fcc0p-2, 0x1.2ec4ea565fcc1p-2},
    {[](I x) { return asinh(x); }, -100000.0, -0x1.869825a9284f4p+3, -0x1.869825a9284f3p+3},
    {[](I x) { return exp(x); }, -700.0, 0x1.14f2b0fb9307fp-1010, 0x1.14f2b0fb93080p-1010},
    {[](I x) { return exp(x); }, 1.0, 0x1.5bf0a8b145769p+1, 0x1.5bf0a8b14576ap+1},
    {[](I x) { return expm1(x); }, 1e-05, 0x1.4f8bc681cdfb5p-17, 0x1.4f8bc681cdfb6p-17},
    {[](I x) { return expm1(x); }, -2.0, -0x1.bab5557101f8ep-1, -0x1.bab5557101f8dp-1},
    {[](I x) { return log(x); }, 0.3, -0x1.34378fcbda721p+0, -0x1.34378fcbda720p+0},
    {[](I x) { return log(x); }, 1e+100, 0x1.cc845b54b54f1p+7, 0x1.cc845b54b54f2p+7},
    {[](I x) { return log1p(x); }, 1e-05, 0x1.4f8aea9ae7316p-17, 0x1.4f8aea9ae7317p-17},
    {[](I x) { return log1p(x); }, -0.9, -0x1.26bb1bbb55517p+1, -0x1.26bb1bbb55516p+1},
    {[](I x) { return log10(x); }, 0.3, -0x1.0bb6c34d81502p-1, -0x1.0bb6c34d81501p-1},
    {[](I x) { return log10(x); }, 1e+100, 0x1.9000000000000p+6, 0x1.9000000000001p+6},
    {[](I x) { return sqrt(x); }, 2.0, 0x1.6a09e667f3bccp+0, 0x1.6a09e667f3bcdp+0},
    {[](I x) { return sqrt(x); }, 1e-310, 0x1.1297872d9cbadp-515, 0x1.1297872d9cbaep-515},
    {[](I x) { return cbrt(x); }, -2.0, -0x1.428a2f98d728bp+0, -0x1.428a2f98d728ap+0},
    {[](I x) { return cbrt(x); }, 1e-310, 0x1.a9d1b0b5d7426p-344, 0x1.a9d1b0b5d7427p-344},
    {[](I x) { return erf(x); }, 0.3, 0x1.50838881dea0fp-2, 0x1.50838881dea10p-2},
    {[](I x) { return erf(x); }, -2.0, -0x1.fd9ae142795e4p-1, -0x1.fd9ae142795e3p-1},
    {[](I x) { return atan2(x, -3.0); }, 1.0, 0x1.68f095fdf593cp+1, 0x1.68f095fdf593dp+1},
    {[](I x) { return hypot(x, 2.0); }, 1.0, 0x1.1e3779b97f4a7p+1, 0x1.1e3779b97f4a8p+1},
    {[](I x) { return pow(x, 2.5); }, 0.3, 0x1.93d32bceafc29p-5, 0x1.93d32bceafc2ap-5},
    {[](I x) { return pow(x, -3.0); }, 2.0, 0x1.0000000000000p-3, 0x1.0000000000000p-3},
    {[](I x) { return pow(x, 3.0); }, -1.1, -0x1.54bc6a7ef9db4p+0, -0x1.54bc6a7ef9db3p+0},
};

TEST(IntervalKnown, AgainstSixtyDigits) {
  for (const Known& k : known) {
    const I value = k.function(k.at);
    EXPECT_TRUE(value.contains(k.below) && value.contains(k.above)) << &k - known;
    EXPECT_LE(value.width(), 20 * std::max(k.above - k.below, 1e-16 * std::abs(k.below))) << &k - known;
  }
}

}  // namespace
