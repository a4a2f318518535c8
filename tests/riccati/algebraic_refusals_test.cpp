// SPDX-License-Identifier: BSD-3-Clause
// Algebraic Riccati equations without an answer, each with its name.
#include <gtest/gtest.h>

#include "riccati/algebraic_checks.hpp"

namespace {

using jml::Status;
using M2 = jml::Matrix<double, 2, 2>;
using Equation = jml::AlgebraicRiccati<double, 2>;

M2 matrix(double a, double b, double c, double d) { return (M2() << a, b, c, d).finished(); }

Equation filter(const M2& F, const M2& Q, const M2& S) { return {F, jml::kernel::transposed(F), Q, S}; }

const Equation good = filter(matrix(0, 1, -1, -0.2), matrix(0, 0, 0, 1), matrix(1, 0, 0, 0));

void expect_refused(const Equation& e, Status status) {
  const auto cold = jml::solve_algebraic_riccati(e);
  EXPECT_EQ(cold.status, status) << describe(cold.status);
  EXPECT_EQ(cold.X, M2::Zero());
  const M2 start = matrix(1, 0.5, 0.5, 2);
  const auto warm = jml::solve_algebraic_riccati(e, start);
  EXPECT_EQ(warm.status, status) << describe(warm.status);
  EXPECT_EQ(warm.X, start);
}

TEST(AlgebraicRefusals, TheGoodOneIsNot) {
  const auto got = jml::solve_algebraic_riccati(good);
  EXPECT_EQ(got.status, Status::ok);
  EXPECT_TRUE(algebraic::stabilizes(good, got.X));
}

TEST(AlgebraicRefusals, NotFinite) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (M2 Equation::* part : {&Equation::A, &Equation::B, &Equation::Q, &Equation::S}) {
      Equation e = good;
      (e.*part)(1, 0) = bad;
      expect_refused(e, Status::invalid_option);
    }
  }
}

TEST(AlgebraicRefusals, SignsOtherThanOne) {
  for (int jml::RiccatiSigns::* sign :
       {&jml::RiccatiSigns::AX, &jml::RiccatiSigns::XB, &jml::RiccatiSigns::Q, &jml::RiccatiSigns::XSX}) {
    for (const int bad : {0, 2}) {
      Equation e = good;
      e.signs.*sign = bad;
      expect_refused(e, Status::invalid_option);
    }
  }
}

// The unstable mode (eigenvalue 1, along the first axis) is not seen; in other coordinates too.
TEST(AlgebraicRefusals, UndetectableUnstableMode) {
  const M2 F = matrix(1, 0.5, 0, -2), Q = matrix(1, 0.2, 0.2, 1), S = matrix(0, 0, 0, 1);
  expect_refused(filter(F, Q, S), Status::no_stabilizing_solution);
  const M2 T = matrix(1, 0.3, -0.4, 2), inverse = T.inverse();
  expect_refused(filter(T * F * inverse, T * Q * T.transpose(), inverse.transpose() * S * inverse),
                 Status::no_stabilizing_solution);
}

// Control: u cannot reach the unstable mode.
TEST(AlgebraicRefusals, UnstabilizableMode) {
  const M2 A = matrix(1, 0, 0.5, -2), G = matrix(0, 0, 0, 1), Q = M2::Identity();
  expect_refused({jml::kernel::transposed(A), A, Q, G}, Status::no_stabilizing_solution);
}

// A drifting integrator that nobody sees: V grows without limit.
TEST(AlgebraicRefusals, UnseenIntegrator) {
  expect_refused(filter(matrix(0, 0, 0, -1), M2::Identity(), matrix(0, 0, 0, 1)),
                 Status::no_stabilizing_solution);
}

// Not symmetric: three eigenvalues of K = [-B S; Q A] in one half plane, so that no X can stabilise both
// sides.
TEST(AlgebraicRefusals, WrongCountOfEigenvalues) {
  expect_refused({matrix(-1, 0, 0, -2), matrix(3, 0, 0, -1), matrix(0.1, 0, 0, 0.1), matrix(0.1, 0.1, 0, 0)},
                 Status::no_stabilizing_solution);
  expect_refused({matrix(1, 0, 0, -2), matrix(-3, 0, 0, -1), matrix(0.1, 0, 0, 0.1), matrix(0.1, 0.1, 0, 0)},
                 Status::no_stabilizing_solution);
}

// x² + 1 = 0 twice, with different frequencies and with equal ones: simple eigenvalues ±i on the axis.
TEST(AlgebraicRefusals, EigenvaluesOnTheAxis) {
  expect_refused(filter(M2::Zero(), -matrix(1, 0, 0, 4), M2::Identity()), Status::eigenvalues_on_axis);
  expect_refused(filter(M2::Zero(), -M2::Identity(), M2::Identity()), Status::eigenvalues_on_axis);
  expect_refused(filter(matrix(-1, 0, 0, 0), -matrix(0.5, 0.1, 0.1, 1), M2::Identity()),
                 Status::eigenvalues_on_axis);
}

// Every X solves 0 = 0; and an oscillator that is neither driven nor seen: 0 = A X + X Aᵀ for any multiple of
// I.
TEST(AlgebraicRefusals, NothingToChooseBy) {
  expect_refused(filter(M2::Zero(), M2::Zero(), M2::Zero()), Status::eigenvalues_on_axis);
  expect_refused(filter(matrix(0, 1, -1, 0), M2::Zero(), M2::Zero()), Status::eigenvalues_on_axis);
}

}  // namespace
