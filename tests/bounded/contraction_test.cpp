// SPDX-License-Identifier: BSD-3-Clause
// Sums of slopes times offsets, and what one of them leaves of a box: rounded once, and still outward.
// Against long double, which hides less than 1/2000 ulp.
#include <gtest/gtest.h>

#include <jml/bounded/box_ranges.hpp>
#include <jml/bounded/contraction.hpp>

#include "random_intervals.hpp"

namespace {

using I = jml::Interval<double>;
constexpr int n = 4, runs = 100'000;
constexpr double inf = std::numeric_limits<double>::infinity(), eps = std::numeric_limits<double>::epsilon();

/// A row of slopes, some of them zero, and offsets.
struct Sum {
  jml::Matrix<I, 2, n> a;
  I offset[n], start;

  explicit Sum(RandomIntervals<double>& random) : start(random.within(-4, 4)) {
    for (int j = 0; j < n; ++j) {
      a(0, j) = I(1);
      a(1, j) = random.noise.uniform() < 0.2 ? I(0) : random.within(-4, 4);
      offset[j] = random.within(-4, 4);
    }
  }
  /// Σ_j a_j δ_j of the ends that make it least (or largest), and of the absolute values.
  long double end(bool least, long double& size) const {
    long double sum = 0;
    size = std::max(-start.low, start.high);
    for (int j = 0; j < n; ++j) {
      long double best = least ? inf : -inf, most = 0;
      for (const long double slope : {a(1, j).low, a(1, j).high}) {
        for (const long double x : {offset[j].low, offset[j].high}) {
          best = least ? std::min(best, slope * x) : std::max(best, slope * x);
          most = std::max(most, std::abs(slope * x));
        }
      }
      sum += best;
      size += most;
    }
    return sum;
  }
};

TEST(LinearForm, EnclosesTheExactSumAndLittleElse) {
  RandomIntervals<double> random{jml::Noise(1)};
  for (int run = 0; run < runs; ++run) {
    const Sum sum(random);
    const I form = jml::detail::linear_form(sum.start, sum.a, 1, sum.offset);
    long double size;
    const long double low = sum.start.low + sum.end(true, size), high = sum.start.high + sum.end(false, size);
    ASSERT_LE(form.low, low) << run;
    ASSERT_GE(form.high, high) << run;
    ASSERT_LE(low - form.low, 2 * (n + 3) * eps * size) << run;
    ASSERT_LE(form.high - high, 2 * (n + 3) * eps * size) << run;
  }
}

TEST(LinearForm, OfWhatIsNotFinite) {
  jml::Matrix<I, 1, 2> a;
  a << I(0), I(-1, 2);
  const I whole_first[] = {I::whole(), I(1, 3)}, ray[] = {I(1), I(0, inf)};
  const I form = jml::detail::linear_form(I(1), a, 0, whole_first);
  EXPECT_LE(form.low, -2);
  EXPECT_GE(form.low, -2 - 1e-14);
  EXPECT_GE(form.high, 7);
  EXPECT_TRUE(jml::detail::linear_form(I(1), a, 0, ray).contains(I(-1e300, 1e300)));
  a(0, 0) = I::whole();
  EXPECT_TRUE(jml::detail::linear_form(I(1), a, 0, ray).contains(I(-1e300, 1e300)));
  const I huge[] = {I(1), I(1e308, 1.5e308)};
  a << I(0), I(2, 3);
  EXPECT_EQ(jml::detail::linear_form(I(0), a, 0, huge).high, inf);
  const I tiny[] = {I(0), I(5e-324)};  // half of it is rounded to zero
  a << I(0), I(0.5);
  EXPECT_GT(jml::detail::linear_form(I(0), a, 0, tiny).high, 0);
}

/// True where all x_j = value[j] are left.
template <typename Value>
bool left(const I (&offset)[n], const Value& value) {
  bool all = true;
  for (int j = 0; j < n; ++j) all &= offset[j].low <= value[j] && value[j] <= offset[j].high;
  return all;
}

// Numbers that satisfy the equation stay, and where all but one is known that one is found to rounding.
TEST(ContractOnce, WhatSatisfiesTheEquationStays) {
  RandomIntervals<double> random{jml::Noise(2)};
  int cut = 0, found = 0;
  for (int run = 0; run < runs; ++run) {
    Sum sum(random);
    double value[n];
    long double exact = 0, size = 0;
    const int open = run % 2 == 0 ? -1 : run / 2 % n;  // of odd runs, the only one that is not known
    for (int j = 0; j < n; ++j) {
      value[j] = random.inside(sum.offset[j]);
      if (open >= 0) sum.offset[j] = j == open ? I(-5, 5) : I(value[j]);
      const long double slope = random.inside(sum.a(1, j));
      if (open >= 0) sum.a(1, j) = I(static_cast<double>(slope));
      exact += slope * value[j];
      size += std::abs(slope * value[j]);
    }
    const auto near = static_cast<double>(exact);
    const I target(near > exact ? std::nextafter(near, -inf) : near,
                   near < exact ? std::nextafter(near, inf) : near);
    double before = 0, after = 0;
    for (const I& side : sum.offset) before += side.high - side.low;
    ASSERT_EQ(jml::detail::contract_once(sum.a, 1, sum.offset, target), 0) << run;
    ASSERT_TRUE(left(sum.offset, value)) << run;
    for (const I& side : sum.offset) after += side.high - side.low;
    cut += after < before;
    if (open < 0 || is_zero(sum.a(1, open))) continue;
    ++found;
    const double width = sum.offset[open].high - sum.offset[open].low;
    ASSERT_LE(width * std::abs(sum.a(1, open).low), 8 * (n + 5) * eps * static_cast<double>(size + 16))
        << run;
  }
  EXPECT_GT(cut, runs / 2);
  EXPECT_GT(found, runs / 4);
}

TEST(ContractOnce, MissesByAsMuchAsTheSumDoes) {
  jml::Matrix<I, 1, n> a;
  a << I(2), I(0), I(-1, 1), I(0.5);
  const I start[n] = {I(0, 1), I(-9, 9), I(0, 1), I(2)};  // the sum is in [0, 4]
  for (const double off : {-3.0, 6.0}) {
    I offset[n];
    std::copy_n(start, n, offset);
    EXPECT_NEAR(jml::detail::contract_once(a, 0, offset, I(off - 0.5, off + 0.5)), off < 0 ? 2.5 : 1.5,
                1e-13);
    for (int j = 0; j < n; ++j) {
      EXPECT_EQ(offset[j].low, start[j].low);
      EXPECT_EQ(offset[j].high, start[j].high);
    }
  }
}

// A target that bounds one side alone, and one that holds the whole sum.
TEST(ContractOnce, OneSideIsCut) {
  jml::Matrix<I, 1, 2> a;
  a << I(2), I(-1);
  for (const bool above : {true, false}) {
    I offset[] = {I(0, 1), I(0, 1)};  // the sum is in [-1, 2]
    ASSERT_EQ(jml::detail::contract_once(a, 0, offset, above ? I(-9, 0) : I(1, 9)), 0);
    EXPECT_NEAR(offset[0].low, above ? 0 : 0.5, 1e-14);
    EXPECT_NEAR(offset[0].high, above ? 0.5 : 1, 1e-14);
    EXPECT_EQ(offset[1].low, 0);
    EXPECT_EQ(offset[1].high, 1);
  }
  I offset[] = {I(0, 1), I(0, 1)};
  ASSERT_EQ(jml::detail::contract_once(a, 0, offset, I(-1, 2)), 0);
  EXPECT_EQ(offset[0].high, 1);
  EXPECT_EQ(offset[1].high, 1);
}

// A quotient that underflows: the exact one is 0.3 of the smallest number.
TEST(ContractOnce, TinyQuotient) {
  const long double exact = 0.3L * 5e-324L;
  for (const double sign : {1.0, -1.0}) {
    jml::Matrix<I, 1, 1> a;
    a << I(sign * 1e30);
    I offset[] = {I(-1, 1)};
    const auto target = static_cast<double>(exact * 1e30L);
    ASSERT_EQ(jml::detail::contract_once(a, 0, offset, I(target * (1 - 1e-15), target * (1 + 1e-15))), 0);
    EXPECT_LE(offset[0].low, sign > 0 ? exact : -exact);
    EXPECT_GE(offset[0].high, sign > 0 ? exact : -exact);
    EXPECT_LT(offset[0].high - offset[0].low, 1e-300);
  }
}

TEST(SeenFrom, EnclosesTheDifference) {
  RandomIntervals<double> random{jml::Noise(3)};
  for (int run = 0; run < runs; ++run) {
    const I side = random.within(-4, 4);
    const double point = random.noise.uniform(-4, 4);
    const I offset = jml::detail::seen_from(point, side);
    const long double low = static_cast<long double>(side.low) - point,
                      high = static_cast<long double>(side.high) - point;
    ASSERT_LE(excess(offset, low, high), 1.51) << run;
    ASSERT_LE(offset.low, low) << run;
    ASSERT_GE(offset.high, high) << run;
  }
  const I ray = jml::detail::seen_from(3.0, I(-inf, 5));
  EXPECT_EQ(ray.low, -inf);
  EXPECT_GE(ray.high, 2);
}

}  // namespace
