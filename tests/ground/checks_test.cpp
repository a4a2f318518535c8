// SPDX-License-Identifier: BSD-3-Clause
// all_finite, is_symmetric, is_diagonal, is_definite: the answer must not depend on the units of the
// components.
#include <gtest/gtest.h>

#include <jml/linear_algebra.hpp>
#include <limits>

namespace {

using namespace jml::operators;

using jml::Definite;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
using Matrix3 = jml::Matrix<double, 3, 3>;

template <int rows, int cols>
void every_entry_counts() {
  jml::Matrix<double, rows, cols> a =
      jml::Matrix<double, rows, cols>::Constant(1e308);  // its sum would overflow
  EXPECT_TRUE(jml::all_finite(a));
  for (int j = 0; j < cols; ++j) {
    for (int i = 0; i < rows; ++i) {
      for (const double bad : {nan, inf, -inf}) {
        const double kept = a(i, j);
        a(i, j) = bad;
        EXPECT_FALSE(jml::all_finite(a)) << rows << "x" << cols << " at " << i << ", " << j << ": " << bad;
        a(i, j) = kept;
      }
    }
  }
}

TEST(AllFinite, EveryEntryOfEverySizeCounts) {
  every_entry_counts<1, 1>();
  every_entry_counts<2, 1>();
  every_entry_counts<3, 1>();
  every_entry_counts<4, 1>();
  every_entry_counts<5, 3>();
  every_entry_counts<6, 6>();
}

TEST(AllFinite, TwoInfinitiesDoNotCancelAndTinyNumbersAreFinite) {
  EXPECT_FALSE(jml::all_finite(jml::Vector<double, 2>(inf, -inf)));
  EXPECT_TRUE(jml::all_finite(jml::Vector<double, 2>(5e-324, -0.0)));
  EXPECT_FALSE(jml::all_finite(jml::Vector<float, 2>(1.0F, std::numeric_limits<float>::infinity())));
}

// D a D with D = diag(scales): the same matrix in other units.
Matrix3 in_units(const Matrix3& a, const jml::Vector<double, 3>& scales) {
  return scales.asDiagonal() * a * scales.asDiagonal();
}

const jml::Vector<double, 3> unit_choices[] = {{1, 1, 1},      {1e8, 1, 1e-8},     {1e-8, 1e8, 1},
                                               {1, 1e-8, 1e8}, {1e-8, 1e-8, 1e-8}, {1e8, 1e8, 1e8}};

Matrix3 symmetric(double a00, double a10, double a20, double a11, double a21, double a22) {
  Matrix3 a;
  a << a00, a10, a20, a10, a11, a21, a20, a21, a22;
  return a;
}

TEST(IsSymmetric, RoundingPassesAnythingElseDoesNotInAnyUnits) {
  const Matrix3 good = symmetric(2, 0.5, -0.3, 1, 0.4, 3);
  for (const auto& units : unit_choices) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        if (i == j) continue;
        Matrix3 a = good;
        a(i, j) += 4e-16;
        EXPECT_TRUE(jml::is_symmetric(in_units(a, units)));
        a(i, j) += 1e-12;
        EXPECT_FALSE(jml::is_symmetric(in_units(a, units))) << i << j << " units " << units.transpose();
      }
    }
  }
}

TEST(IsSymmetric, NotANumberIsNot) {
  Matrix3 a = Matrix3::Identity();
  a(2, 0) = a(0, 2) = nan;
  EXPECT_FALSE(jml::is_symmetric(a));
}

TEST(IsSymmetric, ZeroDiagonalWithOppositeCorners) {
  Matrix3 a = Matrix3::Zero();
  EXPECT_TRUE(jml::is_symmetric(a));
  a(0, 1) = 1e-30;
  a(1, 0) = -1e-30;
  EXPECT_FALSE(jml::is_symmetric(a));
}

TEST(IsDiagonal, OnlyExactZerosCount) {
  Matrix3 a = jml::Vector<double, 3>(1, -2, 0).asDiagonal();
  EXPECT_TRUE(jml::is_diagonal(a));
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      if (i == j) continue;
      for (const double value : {5e-324, nan}) {
        Matrix3 b = a;
        b(i, j) = value;
        EXPECT_FALSE(jml::is_diagonal(b));
      }
    }
  }
}

// Eigenvalues by hand: the Gram matrix of three independent vectors; of two (rank 2); 1, 1, -0.5 by a
// rotation.
TEST(IsDefinite, DefiniteSemidefiniteAndIndefiniteInAnyUnits) {
  const Matrix3 definite = symmetric(14, 8, 5, 5, 3, 2);   // a aᵀ, a = (1,2,3; 0,1,2; 0,1,1), determinant 1
  const Matrix3 rank_two = symmetric(5, 4, 9, 5, 9, 18);   // u = (2,1,3), v = (1,2,3): u uᵀ + v vᵀ
  const Matrix3 rank_one = symmetric(4, 2, 6, 1, 3, 9);    // u uᵀ
  const Matrix3 indefinite = symmetric(1, 2, 0, 1, 0, 1);  // eigenvalues 3, -1, 1
  const Matrix3 last_negative = symmetric(1, 0, 1, 1, 1, 1);  // determinant -1, the leading minors positive
  for (const auto& units : unit_choices) {
    SCOPED_TRACE(units.transpose());
    const auto is = [&](Definite wanted, const Matrix3& a) {
      return wanted == Definite::positive ? jml::is_definite<Definite::positive>(in_units(a, units))
                                          : jml::is_definite<Definite::positive_or_zero>(in_units(a, units));
    };
    EXPECT_TRUE(is(Definite::positive, definite));
    EXPECT_TRUE(is(Definite::positive_or_zero, definite));
    EXPECT_FALSE(is(Definite::positive, rank_two));
    EXPECT_TRUE(is(Definite::positive_or_zero, rank_two));
    EXPECT_FALSE(is(Definite::positive, rank_one));
    EXPECT_TRUE(is(Definite::positive_or_zero, rank_one));
    EXPECT_FALSE(is(Definite::positive_or_zero, indefinite));
    EXPECT_FALSE(is(Definite::positive_or_zero, last_negative));
    EXPECT_FALSE(is(Definite::positive, Matrix3(-definite)));
  }
}

TEST(IsDefinite, ZeroMatrixAndZeroVariances) {
  EXPECT_TRUE(jml::is_definite<Definite::positive_or_zero>(Matrix3(Matrix3::Zero())));
  EXPECT_FALSE(jml::is_definite<Definite::positive>(Matrix3(Matrix3::Zero())));
  const Matrix3 one_known = symmetric(0, 0, 0, 2, 1, 1);
  EXPECT_TRUE(jml::is_definite<Definite::positive_or_zero>(one_known));
  // A zero variance with a covariance: eigenvalues of either sign.
  EXPECT_FALSE(jml::is_definite<Definite::positive_or_zero>(symmetric(0, 1e-3, 0, 2, 0, 1)));
  EXPECT_FALSE(jml::is_definite<Definite::positive_or_zero>(symmetric(2, 0, 1e-3, 1, 0, 0)));
  EXPECT_FALSE(jml::is_definite<Definite::positive_or_zero>(symmetric(0, 0, 0, 0, 1e-30, 0)));
}

TEST(IsDefinite, NearlySingularIsJudgedByItsOwnScale) {
  // [1 1-d; 1-d 1] has the eigenvalue d: definite at d = 1e-12, and negative at d = -1e-12.
  const auto pair = [](double d) { return symmetric(1, 1 - d, 0, 1, 0, 1e-20); };
  EXPECT_TRUE(jml::is_definite<Definite::positive>(pair(1e-12)));
  EXPECT_FALSE(jml::is_definite<Definite::positive_or_zero>(pair(-1e-12)));
  EXPECT_TRUE(jml::is_definite<Definite::positive_or_zero>(pair(0)));
}

TEST(IsDefinite, NotANumberAnywhereIsNot) {
  for (int j = 0; j < 3; ++j) {
    for (int i = j; i < 3; ++i) {
      Matrix3 a = Matrix3::Identity();
      a(i, j) = a(j, i) = nan;
      EXPECT_FALSE(jml::is_definite<Definite::positive>(a)) << i << j;
      EXPECT_FALSE(jml::is_definite<Definite::positive_or_zero>(a)) << i << j;
    }
  }
}

}  // namespace
