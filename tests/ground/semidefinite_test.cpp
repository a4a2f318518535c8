// SPDX-License-Identifier: BSD-3-Clause
// is_definite<positive_or_zero> against the eigenvalues of the correlation matrix, by Jacobi's rotations in
// long double: singular covariances of every rank pass in any units, what is clearly indefinite does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <jml/campaign/noise.hpp>
#include <jml/linear_algebra.hpp>
#include <limits>
#include <type_traits>
#include <utility>

namespace {

using jml::Definite;

constexpr int most = 8;
using Table = jml::Matrix<long double, most, most>;
using Numbers = jml::Vector<long double, most>;

template <typename Scalar, int n>
bool accepted(const Table& a) {
  jml::Matrix<Scalar, n, n> P;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) P(i, j) = static_cast<Scalar>(a(i, j));
  }
  const bool yes = jml::is_definite<Definite::positive_or_zero>(P);
  EXPECT_EQ(jml::is_covariance(P), yes);
  return yes;
}

template <typename Scalar>
bool accepted(const Table& a, int n) {
  return [&]<int... sizes>(std::integer_sequence<int, sizes...>) {
    return ((n == sizes + 2 && accepted<Scalar, sizes + 2>(a)) || ...);
  }(std::make_integer_sequence<int, most - 1>());
}

/// As Scalar holds it.
template <typename Scalar>
Table rounded(const Table& a, int n) {
  Table out = jml::kernel::zeros<Table>();
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) out(i, j) = static_cast<Scalar>(a(i, j));
  }
  return out;
}

/// a(i, j) sᵢ sⱼ.
Table in_units(const Table& a, const Numbers& s, int n) {
  Table out = jml::kernel::zeros<Table>();
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) out(i, j) = a(i, j) * s(i) * s(j);
  }
  return out;
}

Table correlation(const Table& a, int n) {
  Table out = jml::kernel::zeros<Table>();
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) out(i, j) = a(i, j) / std::sqrt(a(i, i)) / std::sqrt(a(j, j));
  }
  return out;
}

/// The smallest eigenvalue of a symmetric matrix of entries about one, by Jacobi's rotations.
long double smallest_eigenvalue(Table a, int n) {
  for (int sweep = 0; sweep < 30; ++sweep) {
    long double off = 0;
    for (int p = 0; p < n; ++p) {
      for (int q = p + 1; q < n; ++q) {
        off = std::max(off, std::abs(a(p, q)));
        if (std::abs(a(p, q)) < 1e-22L) continue;
        const long double theta = (a(q, q) - a(p, p)) / (2 * a(p, q));
        const long double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const long double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < n; ++k) {
          const long double at_p = a(k, p), at_q = a(k, q);
          a(k, p) = c * at_p - s * at_q;
          a(k, q) = s * at_p + c * at_q;
        }
        for (int k = 0; k < n; ++k) {
          const long double at_p = a(p, k), at_q = a(q, k);
          a(p, k) = c * at_p - s * at_q;
          a(q, k) = s * at_p + c * at_q;
        }
      }
    }
    if (off < 1e-20L) break;
  }
  long double smallest = a(0, 0);
  for (int i = 1; i < n; ++i) smallest = std::min(smallest, a(i, i));
  return smallest;
}

/// L Lᵀ as sums of Scalar, L being n×r and random; where `null` is given, L has it in its left null space.
template <typename Scalar>
Table random_singular(jml::Noise& noise, int n, int r, const Numbers* null = nullptr) {
  Table L = jml::kernel::zeros<Table>();
  for (int k = 0; k < r; ++k) {
    long double along = 0;
    for (int i = 0; i < n; ++i) {
      L(i, k) = noise.normal();
      if (null != nullptr) along += L(i, k) * (*null)(i);
    }
    for (int i = 0; null != nullptr && i < n; ++i) L(i, k) -= along * (*null)(i);
  }
  Table out = jml::kernel::zeros<Table>();
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      Scalar sum(0);
      for (int k = 0; k < r; ++k) sum += static_cast<Scalar>(L(i, k)) * static_cast<Scalar>(L(j, k));
      out(i, j) = out(j, i) = sum;
    }
  }
  return out;
}

Numbers random_units(jml::Noise& noise, int n, double decades) {
  Numbers s = jml::kernel::zeros<Numbers>();
  for (int i = 0; i < n; ++i)
    s(i) = std::pow(10.0L, static_cast<long double>(noise.uniform(-decades, decades)));
  return s;
}

/// 10 to the power -far or far, by chance: they put variances at either end of what a Scalar holds.
Numbers extreme_units(jml::Noise& noise, int n, long double far) {
  Numbers s = jml::kernel::zeros<Numbers>();
  for (int i = 0; i < n; ++i) s(i) = std::pow(10.0L, noise.uniform() < 0.5 ? -far : far);
  return s;
}

template <typename Scalar>
constexpr long double far = sizeof(Scalar) == sizeof(float) ? 18.5L : 150.0L;

template <typename Scalar>
void no_singular_covariance_is_refused(unsigned seed) {
  constexpr long double epsilon = std::numeric_limits<Scalar>::epsilon();
  constexpr int count = 20000;
  jml::Noise noise(seed);
  int made = 0, refused = 0, refused_in_units = 0, refused_at_the_ends = 0;
  for (int round = 0; made < count; ++round) {
    for (int n = 2; n <= most; ++n) {
      for (int r = 1; r <= n; ++r, ++made) {
        const Table P = random_singular<Scalar>(noise, n, r);
        const Table scaled = rounded<Scalar>(in_units(P, random_units(noise, n, 9), n), n);
        const Table ends =
            rounded<Scalar>(in_units(correlation(P, n), extreme_units(noise, n, far<Scalar>), n), n);
        if (round % 10 == 0) {
          for (const Table& a : {P, scaled, ends}) {
            ASSERT_GE(smallest_eigenvalue(correlation(a, n), n), -n * n * epsilon) << "not what it should be";
          }
        }
        refused += !accepted<Scalar>(P, n);
        refused_in_units += !accepted<Scalar>(scaled, n);
        refused_at_the_ends += !accepted<Scalar>(ends, n);
      }
    }
  }
  EXPECT_EQ(refused, 0) << "of " << made;
  EXPECT_EQ(refused_in_units, 0) << "of " << made;
  EXPECT_EQ(refused_at_the_ends, 0) << "of " << made;
}

TEST(Semidefinite, NoSingularCovarianceIsRefusedInAnyUnits) { no_singular_covariance_is_refused<double>(1); }
TEST(Semidefinite, NoSingularCovarianceIsRefusedInFloat) { no_singular_covariance_is_refused<float>(2); }

/// C - δ v vᵀ, where C is a singular correlation matrix and C v = 0: the eigenvalue -δ, among other zeros.
Table nearly_semidefinite(jml::Noise& noise, int n, int r, long double delta) {
  Numbers null = jml::kernel::zeros<Numbers>();
  long double square = 0;
  for (int i = 0; i < n; ++i) {
    null(i) = noise.normal();
    square += null(i) * null(i);
  }
  for (int i = 0; i < n; ++i) null(i) /= std::sqrt(square);
  const Table P = random_singular<long double>(noise, n, r, &null);
  Table C = correlation(P, n);
  square = 0;
  for (int i = 0; i < n; ++i) {
    null(i) *= std::sqrt(P(i, i));
    square += null(i) * null(i);
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) C(i, j) -= delta * null(i) * null(j) / square;
  }
  return C;
}

template <typename Scalar>
void indefinite_ones_are_refused(unsigned seed) {
  constexpr long double epsilon = std::numeric_limits<Scalar>::epsilon();
  jml::Noise noise(seed);
  int clear = 0, close = 0, wrong = 0;
  for (int round = 0; round < 120; ++round) {
    for (int n = 2; n <= most; ++n) {
      for (int r = 1; r < n; ++r) {
        const long double limit = 1000 * n * epsilon;
        const long double delta = limit * std::pow(10.0L, static_cast<long double>(noise.uniform(0, 2)));
        const Table C = nearly_semidefinite(noise, n, r, delta);
        for (const Numbers& units : {random_units(noise, n, 0), random_units(noise, n, 9),
                                     extreme_units(noise, n, far<Scalar> - 0.1L)}) {
          const Table a = rounded<Scalar>(in_units(C, units, n), n);
          const long double smallest = smallest_eigenvalue(correlation(a, n), n);
          if (smallest >= -limit) continue;  // by the unit diagonal, which C has lost by δ
          ++clear;
          close += smallest > -2 * limit;
          wrong += accepted<Scalar>(a, n);
        }
      }
    }
  }
  EXPECT_GT(clear, 8000);
  EXPECT_GT(close, 1000);
  EXPECT_EQ(wrong, 0) << "of " << clear;
}

TEST(Semidefinite, ClearlyIndefiniteIsRefusedInAnyUnits) { indefinite_ones_are_refused<double>(3); }
TEST(Semidefinite, ClearlyIndefiniteIsRefusedInFloat) { indefinite_ones_are_refused<float>(4); }

// Not near any border.
TEST(Semidefinite, AnySymmetricMatrixIsJudgedByItsSmallestEigenvalue) {
  jml::Noise noise(5);
  int positive = 0, negative = 0;
  for (int run = 0; run < 4000; ++run) {
    const int n = 2 + run % (most - 1);
    Table C = jml::kernel::zeros<Table>();
    for (int i = 0; i < n; ++i) {
      C(i, i) = 1;
      for (int j = 0; j < i; ++j) C(i, j) = C(j, i) = noise.uniform(-1, 1) * (run % 3 == 0 ? 1.2 : 0.5);
    }
    const Table a = rounded<double>(in_units(C, random_units(noise, n, 9), n), n);
    const long double smallest = smallest_eigenvalue(correlation(a, n), n);
    if (std::abs(smallest) < 1e-9L) continue;
    ++(smallest > 0 ? positive : negative);
    EXPECT_EQ(accepted<double>(a, n), smallest > 0) << static_cast<double>(smallest);
  }
  EXPECT_GT(positive, 1000);
  EXPECT_GT(negative, 1000);
}

template <typename Scalar>
bool one(Scalar a) {
  return jml::is_definite<Definite::positive_or_zero>(jml::Matrix<Scalar, 1, 1>(a));
}

template <typename Scalar>
bool two(Scalar a, Scalar b, Scalar c) {
  jml::Matrix<Scalar, 2, 2> P;
  P << a, b, b, c;
  return jml::is_definite<Definite::positive_or_zero>(P);
}

template <typename Scalar>
void small_cases_by_hand() {
  constexpr Scalar nan = std::numeric_limits<Scalar>::quiet_NaN(),
                   inf = std::numeric_limits<Scalar>::infinity();
  constexpr Scalar huge = std::is_same_v<Scalar, float> ? Scalar(1e37) : Scalar(1e300), tiny = 1 / huge;
  EXPECT_TRUE(jml::is_definite<Definite::positive_or_zero>(jml::Matrix<Scalar, 0, 0>()));
  for (const Scalar good : {Scalar(0), -Scalar(0), Scalar(1), huge, tiny}) EXPECT_TRUE(one(good)) << good;
  for (const Scalar bad : {Scalar(-1), -huge, -tiny, nan, inf, -inf}) EXPECT_FALSE(one(bad)) << bad;

  EXPECT_TRUE(two<Scalar>(1, 1, 1));
  EXPECT_TRUE(two<Scalar>(1, -1, 1));
  EXPECT_TRUE(two<Scalar>(4, 2, 1));
  EXPECT_TRUE(two<Scalar>(0, 0, 0));
  EXPECT_TRUE(two<Scalar>(0, 0, 1));
  EXPECT_TRUE(two<Scalar>(1, 0, 0));
  EXPECT_FALSE(two<Scalar>(1, 2, 1));
  EXPECT_FALSE(two<Scalar>(1, -2, 1));
  EXPECT_FALSE(two<Scalar>(0, 1, 0));
  EXPECT_FALSE(two<Scalar>(0, 1, 1));
  EXPECT_FALSE(two<Scalar>(1, 1, 0));
  EXPECT_FALSE(two<Scalar>(-1, 0, 1));
  EXPECT_FALSE(two<Scalar>(1, 0, -1));
  EXPECT_FALSE(two<Scalar>(-1, 0, -1));
  EXPECT_FALSE(two<Scalar>(-1, 0, 0));
  EXPECT_FALSE(two<Scalar>(1, 0, -tiny));

  for (const Scalar bad : {nan, inf, -inf}) {
    EXPECT_FALSE(two<Scalar>(bad, 0, 1)) << bad;
    EXPECT_FALSE(two<Scalar>(1, 0, bad)) << bad;
    EXPECT_FALSE(two<Scalar>(1, bad, 1)) << bad;
    EXPECT_FALSE(two<Scalar>(0, bad, 1)) << bad;
    EXPECT_FALSE(two<Scalar>(0, bad, 0)) << bad;
    EXPECT_FALSE(two<Scalar>(bad, bad, bad)) << bad;
    EXPECT_FALSE(two<Scalar>(inf, bad, inf)) << bad;
  }

  EXPECT_TRUE(two(huge, huge, huge));
  EXPECT_TRUE(two(tiny, tiny, tiny));
  EXPECT_TRUE(two(huge, Scalar(1), tiny));  // 1² = huge tiny
  EXPECT_TRUE(two(tiny, Scalar(-1), huge));
  EXPECT_TRUE(two(huge, Scalar(0), tiny));
  EXPECT_TRUE(two(huge, tiny, tiny));
  EXPECT_FALSE(two(huge, Scalar(2), tiny));
  EXPECT_FALSE(two(tiny, Scalar(2), huge));
  EXPECT_FALSE(two(huge, 2 * huge, huge));
  EXPECT_FALSE(two(tiny, 2 * tiny, tiny));
  EXPECT_FALSE(two(tiny, huge, tiny));
  EXPECT_FALSE(two(huge, huge, tiny));
  EXPECT_FALSE(two(Scalar(0), tiny, huge));
  EXPECT_FALSE(two(huge, tiny, Scalar(0)));
  EXPECT_FALSE(two(Scalar(0), tiny, Scalar(0)));
  EXPECT_FALSE(two(huge, Scalar(0), -tiny));
}

/// Of a singular matrix, a definite one, and one that is zero elsewhere.
template <typename Scalar>
void what_is_not_finite_is_refused() {
  for (const Scalar bad : {std::numeric_limits<Scalar>::quiet_NaN(), std::numeric_limits<Scalar>::infinity(),
                           -std::numeric_limits<Scalar>::infinity()}) {
    for (const auto& [variance, covariance] : {std::pair(1, 1), std::pair(2, 1), std::pair(0, 0)}) {
      for (int j = 0; j < 4; ++j) {
        for (int i = j; i < 4; ++i) {
          jml::Matrix<Scalar, 4, 4> P;
          for (int k = 0; k < 16; ++k) P(k / 4, k % 4) = Scalar(k % 5 == 0 ? variance : covariance);
          EXPECT_TRUE(jml::is_definite<Definite::positive_or_zero>(P));
          P(i, j) = P(j, i) = bad;
          EXPECT_FALSE(jml::is_definite<Definite::positive_or_zero>(P)) << i << j << " " << bad;
        }
      }
    }
  }
}

TEST(Semidefinite, WhatIsNotFiniteIsRefused) {
  what_is_not_finite_is_refused<double>();
  what_is_not_finite_is_refused<float>();
}

TEST(Semidefinite, SmallCasesByHand) {
  small_cases_by_hand<double>();
  small_cases_by_hand<float>();
}

}  // namespace
