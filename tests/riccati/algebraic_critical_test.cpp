// SPDX-License-Identifier: BSD-3-Clause
// Critical equations: a double eigenvalue at the split, on the imaginary axis. A generic method keeps half of
// the digits here. True error and claimed error must agree: claim above truth, and not 1000 times above where
// it is above rounding.
#include <gtest/gtest.h>

#include "riccati/algebraic_checks.hpp"

namespace {

template <int rows, int cols, typename... Entries>
jml::Matrix<double, rows, cols> matrix(Entries... entries) {
  jml::Matrix<double, rows, cols> m;
  const double list[] = {static_cast<double>(entries)...};
  for (int i = 0; i < rows * cols; ++i) m(i / cols, i % cols) = list[i];
  return m;
}

template <int n1, int n2>
void expect_critical(const jml::AlgebraicRiccati<double, n1, n2>& e, const jml::Matrix<double, n1, n2>& X,
                     double tolerance) {
  const auto got = jml::solve_algebraic_riccati(e);
  EXPECT_EQ(got.status, jml::Status::accepted_critical);
  EXPECT_TRUE(got.shifted);
  const double error = algebraic::distance(got.X, X);
  EXPECT_LE(error, tolerance);
  EXPECT_LE(error, got.error);
  EXPECT_LE(got.error, std::max(1e3 * error, 1e-13));
  EXPECT_LT(algebraic::relative_residual(e, got.X), 1e-14);
}

// (x - 1)² = 0, and with numbers that binary fractions cannot hold: s x² - 2 a x + a²/s = s (x - a/s)².
TEST(Critical, Scalar) {
  using One = jml::Matrix<double, 1, 1>;
  expect_critical<1, 1>({One(1), One(1), One(-1), One(1)}, One(1), 1e-15);
  const double a = 0.3, s = 0.7;
  expect_critical<1, 1>({One(a), One(a), One(-a * a / s), One(s)}, One(a / s), 1e-15);
}

// Closed loops diag(0, -1) in other coordinates, on both sides: one double zero beside a pair ±1.
TEST(Critical, DoubleZeroBesideAStableMode) {
  const auto X = matrix<2, 2>(2, 1, 1, 3), S = matrix<2, 2>(2, 1, 1, 4), K = matrix<2, 2>(-2, -2, 1, 1);
  expect_critical<2, 2>(algebraic::with_solution<double, 2, 2>(X, S, K, jml::kernel::transposed(K)), X,
                        1e-15);
}

// An undamped oscillator in the closed loop: double eigenvalues at ±3i.
TEST(Critical, DoublePairOnTheAxis) {
  const auto X = matrix<2, 2>(2, 1, 1, 2), S = matrix<2, 2>(2, 0.5, 0.5, 1), K = matrix<2, 2>(0, 3, -3, 0);
  expect_critical<2, 2>(algebraic::with_solution<double, 2, 2>(X, S, K, jml::kernel::transposed(K)), X,
                        1e-14);
}

// A closed loop that is zero altogether: two Jordan blocks at zero.
TEST(Critical, TwoBlocksAtZero) {
  const auto X = matrix<2, 2>(2, 1, 1, 2), S = matrix<2, 2>(2, 1, 1, 3);
  const jml::Matrix<double, 2, 2> K = jml::Matrix<double, 2, 2>::Zero();
  expect_critical<2, 2>(algebraic::with_solution<double, 2, 2>(X, S, K, K), X, 1e-14);
}

// A closed loop that is a double integrator: one block of four, split by the fourth root of rounding.
TEST(Critical, OneBlockOfFour) {
  const auto X = matrix<2, 2>(2, 1, 1, 2), S = matrix<2, 2>(1, 0, 0, 0), K = matrix<2, 2>(0, 1, 0, 0);
  expect_critical<2, 2>(algebraic::with_solution<double, 2, 2>(X, S, K, jml::kernel::transposed(K)), X,
                        1e-14);
}

// The null recurrent M-matrix problem X C X - A X - X D + B = 0 with A = D = 8 I - ones, B = C = ones of four
// states: all rows of [D -C; -B A] are (8 - 4) - 4 = 0, and X = ones/4: C X = ones, D - C X = 8 I - 2 ones is
// singular, and so is A - X C.
TEST(Critical, NullRecurrentMMatrix) {
  using M4 = jml::Matrix<double, 4, 4>;
  const M4 D = 8 * M4::Identity() - M4::Ones();
  expect_critical<4, 4>({D, D, M4::Ones(), M4::Ones(), {-1, -1, 1, 1}}, M4::Ones() / 4, 1e-15);
}

// Nonsymmetric and rectangular, integer coefficients: closed loops of one row and of three, each with a zero.
TEST(Critical, Rectangular) {
  const auto X = matrix<1, 3>(1, 2, -1);
  const auto S = matrix<3, 1>(1, 1, 3);
  const auto left = matrix<1, 1>(0);
  const auto right = matrix<3, 3>(-1, 1, 0, 2, -3, 1, 0, 1, -1);  // rows sum to zero
  expect_critical<1, 3>(algebraic::with_solution<double, 1, 3>(X, S, left, right), X, 1e-14);
}

// Near a critical equation, not at it: s x² - 2 a x + q = 0 with x = (a + √(a² - s q))/s. No shift; the error
// is ε over the gap, and the claim says so.
TEST(Critical, NearlyIsNot) {
  using One = jml::Matrix<double, 1, 1>;
  for (const double gap : {1e-2, 1e-4, 1e-6}) {
    const double root = std::round(gap * 0x1p24) * 0x1p-24;  // 1 - root² is exact
    const auto got = jml::solve_algebraic_riccati(
        jml::AlgebraicRiccati<double, 1>{One(1), One(1), One(root * root - 1), One(1)});
    EXPECT_EQ(got.status, jml::Status::ok) << gap;
    EXPECT_FALSE(got.shifted);
    EXPECT_LE(std::abs(got.X(0) - 1 - root), got.error * (1 + root));
    EXPECT_LT(got.error, 1e-14 / gap);
  }
}

TEST(Critical, WarmStartFallsBack) {
  const auto X = matrix<2, 2>(2, 1, 1, 3), S = matrix<2, 2>(2, 1, 1, 4), K = matrix<2, 2>(-2, -2, 1, 1);
  const auto e = algebraic::with_solution<double, 2, 2>(X, S, K, jml::kernel::transposed(K));
  const auto got = jml::solve_algebraic_riccati(e, jml::Matrix<double, 2, 2>(1.01 * X));
  EXPECT_EQ(got.status, jml::Status::accepted_critical);
  EXPECT_FALSE(got.warm);
  EXPECT_LE(algebraic::distance(got.X, X), 1e-15);
}

}  // namespace
