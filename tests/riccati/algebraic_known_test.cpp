// SPDX-License-Identifier: BSD-3-Clause
// Algebraic Riccati equations whose solutions are known in closed form.
#include <gtest/gtest.h>

#include "riccati/algebraic_checks.hpp"

namespace {

using algebraic::distance;
using M2 = jml::Matrix<double, 2, 2>;

// 0 = Q + Aᵀ X + X A - X G X, as the CAREX collection writes it.
jml::AlgebraicRiccati<double, 2> control(const M2& A, const M2& G, const M2& Q) {
  return {jml::kernel::transposed(A), A, Q, G};
}

M2 matrix(double a, double b, double c, double d) { return (M2() << a, b, c, d).finished(); }

void expect_solution(const jml::AlgebraicRiccati<double, 2>& e, const M2& X, double tolerance) {
  const auto got = jml::solve_algebraic_riccati(e);
  EXPECT_EQ(got.status, jml::Status::ok);
  EXPECT_LT(distance(got.X, X), tolerance);
  EXPECT_LE(distance(got.X, X), got.error);
  EXPECT_LT(algebraic::relative_residual(e, got.X), 1e-15);
  EXPECT_LT(got.residual, 1e-15);
  EXPECT_FALSE(got.warm);
  EXPECT_FALSE(got.shifted);
}

TEST(Carex, Example11) {
  expect_solution(control(matrix(0, 1, 0, 0), matrix(0, 0, 0, 1), matrix(1, 0, 0, 2)), matrix(2, 1, 1, 2),
                  1e-15);
}

TEST(Carex, Example12) {
  const M2 X = (1 + std::sqrt(2.0)) * matrix(9, 6, 6, 4);
  expect_solution(control(matrix(4, 3, -4.5, -3.5), matrix(1, -1, -1, 1), matrix(9, 6, 6, 4)), X, 1e-14);
}

TEST(Carex, Example23WithItsLargestParameter) {
  const double eps = 1e6, root = std::sqrt(1 + 2 * eps);
  const auto e = control(matrix(0, eps, 0, 0), matrix(0, 0, 0, 1), matrix(1, 0, 0, 1));
  expect_solution(e, matrix(root / eps, 1, 1, root), 1e-15);
  const M2 X = jml::solve_algebraic_riccati(e).X;  // each entry for itself: they differ by 1e6
  EXPECT_NEAR(X(0, 0) * eps / root, 1, 1e-15);
  EXPECT_NEAR(X(0, 1), 1, 1e-15);
  EXPECT_EQ(X(0, 1), X(1, 0));
}

TEST(Carex, InSinglePrecision) {
  const auto d = control(matrix(4, 3, -4.5, -3.5), matrix(1, -1, -1, 1), matrix(9, 6, 6, 4));
  const jml::AlgebraicRiccati<float, 2> e{d.A.cast<float>(), d.B.cast<float>(), d.Q.cast<float>(),
                                          d.S.cast<float>()};
  const auto got = jml::solve_algebraic_riccati(e);
  EXPECT_EQ(got.status, jml::Status::ok);
  EXPECT_LT(distance(got.X, (1 + std::sqrt(2.0)) * matrix(9, 6, 6, 4)), 1e-6);
}

// X C X - A X - X D + B = 0: the minimal nonnegative solution of two M-matrix problems. In the first A - X C,
// in the second D - C X is singular: a simple eigenvalue at zero, beside a gap.
TEST(MMatrix, TwoByTwo) {
  const jml::AlgebraicRiccati<double, 2> e{matrix(.003, -.0001, -.0001, .003),
                                           .003 * M2::Identity(),
                                           matrix(.0019, .001, .0019, .001),
                                           matrix(.0015, .0015, .0029, .0001),
                                           {-1, -1, 1, 1}};
  const auto got = jml::solve_algebraic_riccati(e);
  EXPECT_EQ(got.status, jml::Status::ok);
  EXPECT_LT(distance(got.X, matrix(19. / 30, 1. / 3, 19. / 30, 1. / 3)), 1e-14);
  EXPECT_LT(got.error, 1e-11);
}

// The eighteen entries of a row of X D cancel from 9.4 to 1e-4, and the eigenvalues are 180 and 0.016: the
// last digit of 170.002 moves X by 6e-13. Stored that way, the exact answer is 6e-13 away, and so is ours.
TEST(MMatrix, TwoByEighteen) {
  jml::AlgebraicRiccati<double, 2, 18> e;
  e.A = .018 * M2::Identity();
  e.B.setConstant(-10);
  e.B.diagonal().setConstant(170.002);
  e.Q.setConstant(.001);
  e.S.setConstant(.001);
  e.signs = {-1, -1, 1, 1};
  const jml::Matrix<double, 2, 18> X = jml::Matrix<double, 2, 18>::Constant(1. / 18);
  const auto got = jml::solve_algebraic_riccati(e);
  EXPECT_EQ(got.status, jml::Status::ok);
  EXPECT_LT(distance(got.X, X), 1e-12);
  EXPECT_LE(distance(got.X, X), got.error);
  EXPECT_LT(got.error, 1e-10);
}

// Four signs are four flips of coefficients.
TEST(Signs, AreThoseOfTheTerms) {
  const auto plain = control(matrix(1, 2, -1, 0.5), matrix(2, 1, 1, 3), matrix(1, 0.5, 0.5, 4));
  const M2 X = jml::solve_algebraic_riccati(plain).X;
  for (int bits = 0; bits < 16; ++bits) {
    auto e = plain;
    e.signs = {bits & 1 ? 1 : -1, bits & 2 ? 1 : -1, bits & 4 ? 1 : -1, bits & 8 ? 1 : -1};
    e.A *= e.signs.AX;
    e.B *= e.signs.XB;
    e.Q *= e.signs.Q;
    e.S *= -e.signs.XSX;
    EXPECT_LT(distance(jml::solve_algebraic_riccati(e).X, X), 1e-15) << bits;
  }
}

// Other units of the states, of time and of X: the same answer in these units, however far apart.
TEST(Units, DoNotMatter) {
  const auto e = control(matrix(1, 2, -1, 0.5), matrix(2, 1, 1, 3), matrix(1, 0.5, 0.5, 4));
  const auto plain = jml::solve_algebraic_riccati(e);
  for (const double unit : {1e-150, 1e-9, 1e12, 1e140}) {
    for (const double time : {1e-9, 1e6}) {
      const M2 T = matrix(1, 0, 0, time * 1e-3), U = matrix(1, 0, 0, 1e3 / time);
      const jml::AlgebraicRiccati<double, 2> other{T * e.A * U * time, U * e.B * T * time,
                                                   T * e.Q * T * unit * time, U * e.S * U / unit * time};
      const auto got = jml::solve_algebraic_riccati(other);
      EXPECT_EQ(got.status, jml::Status::ok);
      EXPECT_LT(distance(U * (got.X / unit) * U, plain.X), 1e-13) << unit << " " << time;
    }
  }
}

TEST(Units, WhereOneCoefficientIsZero) {  // 2 a x + q = 0, and x = 2 a/s from the unstable side
  using One = jml::Matrix<double, 1, 1>;
  for (const double size : {1e-200, 1e-20, 1., 1e20, 1e200}) {
    const auto lyapunov =
        jml::solve_algebraic_riccati(jml::AlgebraicRiccati<double, 1>{One(-1), One(-1), One(size), One(0)});
    EXPECT_EQ(lyapunov.status, jml::Status::ok);
    EXPECT_NEAR(lyapunov.X(0) / size, 0.5, 1e-15);
    const auto undriven =
        jml::solve_algebraic_riccati(jml::AlgebraicRiccati<double, 1>{One(1), One(1), One(0), One(size)});
    EXPECT_EQ(undriven.status, jml::Status::ok);
    EXPECT_NEAR(undriven.X(0) * size, 2, 1e-15);
    const auto hardly = jml::solve_algebraic_riccati(
        jml::AlgebraicRiccati<double, 1>{One(1), One(1), One(1e-30 / size), One(size)});
    EXPECT_EQ(hardly.status, jml::Status::ok);
    EXPECT_NEAR(hardly.X(0) * size, 2, 1e-14);
  }
}

}  // namespace
