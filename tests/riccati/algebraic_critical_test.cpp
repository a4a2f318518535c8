// SPDX-License-Identifier: BSD-3-Clause
// Critical equations: a double eigenvalue at the split, on the imaginary axis. A generic method keeps half of
// the digits here. True error and claimed error must agree: claim above truth, and not 1000 times above where
// it is above rounding.
#include <gtest/gtest.h>

#include <Eigen/QR>

#include "riccati/algebraic_checks.hpp"
#include "riccati/algebraic_true_solution.hpp"

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
// Rounding of a²/s moves its roots apart by the root of ε, or off the real line, and the claim says so.
TEST(Critical, Scalar) {
  using One = jml::Matrix<double, 1, 1>;
  expect_critical<1, 1>({One(1), One(1), One(-1), One(1)}, One(1), 1e-15);
  const double a = 0.3, s = 0.7;
  const auto got =
      jml::solve_algebraic_riccati(jml::AlgebraicRiccati<double, 1>{One(a), One(a), One(-a * a / s), One(s)});
  EXPECT_EQ(got.status, jml::Status::accepted_critical);
  EXPECT_NEAR(got.X(0), a / s, 1e-15);
  const double apart = std::sqrt(std::abs(static_cast<double>(  // s times the difference of the roots, halved
      algebraic::Quad(a) * a + algebraic::Quad(-a * a / s) * s)));
  EXPECT_GE(got.error, 0.1 * apart / a);  // off the line: there is no true error
  EXPECT_LE(got.error, 1e-8);
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

// CAREX 2.5, eigenvalues ±ε beside ±i: near a critical equation, nearer and at last nothing else to rounding.
// The error is that of the equation as it is stored, where rounding of its coefficients is 1e-8 of X; and ok
// is not said of a shifted equation.
TEST(Critical, Carex25IsNeverClaimedBetterThanItIs) {
  const auto carex = [](double eps) {
    return jml::AlgebraicRiccati<double, 2>{
        matrix<2, 2>(3 - eps, 4, 1, 2 - eps), matrix<2, 2>(3 - eps, 1, 4, 2 - eps),
        matrix<2, 2>(4 * eps - 11, 2 * eps - 5, 2 * eps - 5, 2 * eps - 2), matrix<2, 2>(1, 1, 1, 1)};
  };
  const auto X = matrix<2, 2>(2, 1, 1, 1);
  for (const double eps : {3e-7, 1e-7}) {
    const auto got = jml::solve_algebraic_riccati(carex(eps));
    EXPECT_EQ(got.status, jml::Status::ok);
    EXPECT_FALSE(got.shifted);
    EXPECT_LE(algebraic::distance(got.X, X), got.error) << eps;
    EXPECT_LT(got.error, 2e-7);
    EXPECT_LT((algebraic::TrueSolution<2, 2>(carex(eps), X).error_of(got.X)), 1e-15) << eps;
  }
  int known = 0;
  for (int i = 0; i <= 160; ++i) {
    const double eps = std::pow(10.0, -1 - i / 20.0);
    const algebraic::TrueSolution<2, 2> truth(carex(eps), X);
    const auto got = jml::solve_algebraic_riccati(carex(eps));
    EXPECT_TRUE(jml::usable(got.status)) << eps;
    EXPECT_LE(got.error, 6e-7) << eps;
    if (!truth.stabilizes()) continue;  // rounding of the coefficients has put the eigenvalues on the axis
    ++known;
    EXPECT_EQ(got.status, jml::Status::ok) << eps;
    EXPECT_LE(truth.error_of(got.X), got.error) << eps;
    EXPECT_LE(truth.error_of(got.X), 1e-15) << eps;
  }
  EXPECT_GT(known, 140);
}

/// A stable matrix with an eigenvalue -slow, the others -2, -3, …, in a random basis.
template <int n>
jml::Matrix<double, n, n> slow_and_stable(jml::Noise& noise, double slow) {
  const auto basis = models::random_matrix<n, n>(noise);
  jml::Vector<double, n> rates = jml::Vector<double, n>::LinSpaced(-1, -n);
  rates(0) = -slow;
  return basis * rates.asDiagonal() * basis.inverse();
}

/// Equations made from their solution, from well separated to critical; not symmetric, or filters.
template <int n>
void expect_claims_hold(bool symmetric, int cases) {
  using Square = jml::Matrix<double, n, n>;
  jml::Noise noise(300 + n);
  int known = 0;
  for (int i = 0; i < cases; ++i) {
    const double slow = std::pow(10.0, -9.0 * i / cases);
    Square X = models::random_matrix<n, n>(noise), S = models::random_matrix<n, n>(noise);
    const Square left = slow_and_stable<n>(noise, slow);
    Square right = slow_and_stable<n>(noise, slow);
    if (symmetric) {
      X = (X + X.transpose()).eval();
      S = (S * S.transpose()).eval();
      S = ((S + S.transpose()) / 2).eval();
      right = left.transpose();
    }
    auto e = algebraic::with_solution<double, n, n>(X, S, left, right);
    if (symmetric) {
      e.Q = ((e.Q + e.Q.transpose()) / 2).eval();
      e.B = e.A.transpose();
    }
    const algebraic::TrueSolution<n, n> truth(e, X);
    if (!truth.stabilizes()) continue;
    ++known;
    for (const bool warm : {false, true}) {
      const auto got = warm ? jml::solve_algebraic_riccati(e, X) : jml::solve_algebraic_riccati(e);
      EXPECT_EQ(got.status, jml::Status::ok) << i << " " << describe(got.status);
      EXPECT_LE(truth.error_of(got.X), got.error) << i << " " << slow;
      EXPECT_TRUE(warm || truth.error_of(got.X) <= 1e-14) << i << " " << slow;
      EXPECT_LE(got.error, 1e-5) << i << " " << slow;
    }
  }
  EXPECT_GT(known, 3 * cases / 4);
}
TEST(Claims, HoldUpToACriticalEquation) { expect_claims_hold<2>(false, 200); }
TEST(Claims, HoldUpToACriticalEquationOfFourStates) { expect_claims_hold<4>(false, 60); }
TEST(Claims, HoldUpToACriticalFilter) { expect_claims_hold<2>(true, 200); }
TEST(Claims, HoldUpToACriticalFilterOfFourStates) { expect_claims_hold<4>(true, 60); }

// Filters whose states have units between 1e-9 and 1e9, powers of two so that nothing but them changes:
// solved to rounding, and the claim says how well. It did say 0.3, and more than one.
template <int n>
void expect_useful_claims(int cases) {
  using Square = jml::Matrix<double, n, n>;
  jml::Noise noise(77 + n);
  for (int i = 0; i < cases; ++i) {
    const auto plain = algebraic::random_filter<n>(noise);
    jml::Vector<double, n> unit;
    for (int k = 0; k < n; ++k)
      unit(k) = std::ldexp(1.0, static_cast<int>(std::lround(30 * std::erf(noise.normal() / 1.4))));
    const Square U = unit.asDiagonal(), V = unit.cwiseInverse().asDiagonal();
    const jml::AlgebraicRiccati<double, n> e{U * plain.A * V, V * plain.B * U, U * plain.Q * U,
                                             V * plain.S * V};
    const auto got = jml::solve_algebraic_riccati(e);
    ASSERT_EQ(got.status, jml::Status::ok) << i;
    const algebraic::TrueSolution<n, n> truth(e, got.X);
    ASSERT_TRUE(truth.converged());
    EXPECT_LE(truth.error_of(got.X), got.error) << i;
    EXPECT_LE(got.error, 1e-6) << i;
  }
}
TEST(Claims, AreOfUseInUnitsFarApart) {
  expect_useful_claims<2>(300);
  expect_useful_claims<4>(60);
}

// Where seven digits leave one of X or none, the claim says so or the equation is refused.
TEST(Claims, HoldInSinglePrecision) {
  using F2 = jml::Matrix<float, 2, 2>;
  jml::Noise noise(23);
  int known = 0, refused = 0;
  for (int i = 0; i < 400; ++i) {
    const auto X = models::random_matrix<2, 2>(noise), S = models::random_matrix<2, 2>(noise);
    const double slow = std::pow(10.0, -5.0 * i / 400);
    const auto left = slow_and_stable<2>(noise, slow), right = slow_and_stable<2>(noise, slow);
    const auto d = algebraic::with_solution<double, 2, 2>(X, S, left, right);
    const jml::AlgebraicRiccati<float, 2> e{F2(d.A.cast<float>()), F2(d.B.cast<float>()),
                                            F2(d.Q.cast<float>()), F2(d.S.cast<float>())};
    const algebraic::TrueSolution<2, 2> truth(e, F2(X.cast<float>()));
    if (!truth.stabilizes()) continue;
    ++known;
    const auto got = jml::solve_algebraic_riccati(e);
    refused += !jml::usable(got.status);
    if (!jml::usable(got.status)) continue;
    EXPECT_LE(truth.error_of(got.X), static_cast<double>(got.error)) << i << " " << slow;
    EXPECT_LT(got.error, 1.0F);
  }
  EXPECT_GT(known, 300);
  EXPECT_LE(refused, known / 20);
}

// Without Q, X = 0 is a solution, and it is the one wanted where nothing is unstable.
TEST(Critical, ZeroIsAnAnswer) {
  const auto expect_zero = [](const auto& e, jml::Status status) {
    const auto got = jml::solve_algebraic_riccati(e);
    EXPECT_EQ(got.status, status) << describe(got.status);
    EXPECT_EQ(got.X.norm(), 0);
    EXPECT_EQ(got.residual, 0);
    EXPECT_LE(got.error, 1e-13);
  };
  const auto none = matrix<2, 2>(0, 0, 0, 0);
  const auto critical = jml::Status::accepted_critical;
  using Equation = jml::AlgebraicRiccati<double, 2>;
  expect_zero(Equation{matrix<2, 2>(0, -1, 1, 0), matrix<2, 2>(0, 1, -1, 0), none, matrix<2, 2>(0, 0, 0, 1)},
              critical);
  expect_zero(Equation{matrix<2, 2>(0, 1, -1, 0), matrix<2, 2>(0, -1, 1, 0), none, matrix<2, 2>(0, 0, 0, 1)},
              critical);
  expect_zero(Equation{matrix<2, 2>(0, 0, 1, 0), matrix<2, 2>(0, 1, 0, 0), none, matrix<2, 2>(1, 0, 0, 1)},
              critical);
  expect_zero(Equation{matrix<2, 2>(0, 1, 0, 0), matrix<2, 2>(0, 0, 1, 0), none, matrix<2, 2>(1, 0, 0, 1)},
              critical);

  jml::Noise noise(19);
  for (int i = 0; i < 200; ++i) {
    const auto T = models::random_matrix<4, 4>(noise), G = models::random_matrix<4, 4>(noise);
    jml::Matrix<double, 4, 4> D = jml::Matrix<double, 4, 4>::Zero();
    const double size = std::pow(10.0, 6 * std::erf(noise.normal()));
    D(0, 1) = 1 + std::abs(noise.normal());
    D(1, 0) = -D(0, 1);
    D(2, 2) = D(3, 3) = -0.5;
    D(2, 3) = noise.normal();
    if (i % 2 == 0) D(0, 0) = D(1, 1) = -0.3;
    const Eigen::HouseholderQR<jml::Matrix<double, 4, 4>> qr(T);
    const jml::Matrix<double, 4, 4> basis = qr.householderQ(), A = size * (basis * D * basis.transpose());
    const jml::Matrix<double, 4, 4> S = G * G.transpose();
    const jml::AlgebraicRiccati<double, 4> e{A, A.transpose(), jml::Matrix<double, 4, 4>::Zero(), S};
    if (i % 2 == 0) {
      expect_zero(e, jml::Status::ok);
      continue;
    }
    // Rounding of A has made the pair stable or not, by 1e-16: X is zero, or as large as that.
    const auto got = jml::solve_algebraic_riccati(e);
    EXPECT_TRUE(jml::usable(got.status)) << i << " " << describe(got.status);
    EXPECT_LE(got.X.norm() * S.norm(), 1e-12 * size) << i;
  }
}

// x² s = 2 a x: the unstable side of a zero, however near.
TEST(Critical, NearlyZeroIsNotZero) {
  using One = jml::Matrix<double, 1, 1>;
  for (const double a : {1.0, 1e-3, 1e-9, 1e-13}) {
    const auto e = jml::AlgebraicRiccati<double, 2>{matrix<2, 2>(a, 0, 0, -1), matrix<2, 2>(a, 0, 0, -1),
                                                    matrix<2, 2>(0, 0, 0, 0), matrix<2, 2>(1, 0, 0, 1)};
    const auto got = jml::solve_algebraic_riccati(e);
    EXPECT_EQ(got.status, jml::Status::ok) << a << describe(got.status);
    EXPECT_NEAR(got.X(0, 0), 2 * a, 2e-3 * a) << a;
    EXPECT_LE(std::abs(got.X(0, 0) - 2 * a), got.error * 2 * a) << a;
    const auto stable =
        jml::solve_algebraic_riccati(jml::AlgebraicRiccati<double, 1>{One(-a), One(-a), One(0), One(1)});
    EXPECT_EQ(stable.status, jml::Status::ok) << a;
    EXPECT_EQ(stable.X(0), 0) << a;
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
