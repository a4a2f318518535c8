// SPDX-License-Identifier: BSD-3-Clause
// Random algebraic Riccati equations of one size: filters (symmetric), and equations made from their
// solution.
//
// On these 80 filters scipy 1.17.1 (solve_continuous_are, LAPACK) has relative residuals, evaluated as here,
// of at most 2.4e-13, 2.4e-14, 1.0e-14, 6.4e-15 for 2, 4, 9, 15 states; this library 2.8e-15, 2.5e-16, 1e-16,
// 1e-16. The two answers differ by at most 4.8e-13 of the norm.
#pragma once

#include <gtest/gtest.h>

#include "riccati/algebraic_checks.hpp"

namespace algebraic {

template <int n1, int n2>
void expect_solved(const jml::AlgebraicRiccati<double, n1, n2>& e, int seed) {
  const auto cold = jml::solve_algebraic_riccati(e);
  ASSERT_EQ(cold.status, jml::Status::ok) << describe(cold.status) << ", case " << seed;
  EXPECT_LT(relative_residual(e, cold.X), 1e-14) << seed;
  EXPECT_TRUE(stabilizes(e, cold.X)) << seed;

  auto moved = e;
  moved.A *= 1.001;
  moved.B *= 1.001;
  moved.Q *= 0.999;
  const auto there = jml::solve_algebraic_riccati(moved);
  const auto warm = jml::solve_algebraic_riccati(moved, cold.X);
  EXPECT_TRUE(warm.warm) << seed;
  EXPECT_LT(distance(warm.X, there.X), 1e-12) << seed;
}

template <int n>
void expect_filters_solved(int cases) {
  jml::Noise noise(100 + n);
  for (int i = 0; i < cases; ++i) {
    const auto e = random_filter<n>(noise);
    expect_solved(e, i);
    const jml::Matrix<double, n, n> X = jml::solve_algebraic_riccati(e).X;
    EXPECT_EQ(X, jml::kernel::transposed(X));
  }
}

/// Neither square nor symmetric, no sign of Q or S; the stabilising solution is unique, so it is the one put
/// in.
template <int n1, int n2>
void expect_solutions_found(int cases) {
  jml::Noise noise(200 + 20 * n1 + n2);
  for (int i = 0; i < cases; ++i) {
    const auto X = models::random_matrix<n1, n2>(noise);
    const auto S = models::random_matrix<n2, n1>(noise);
    const auto left = random_stable<n1>(noise);
    const auto right = random_stable<n2>(noise);
    const auto e = with_solution<double, n1, n2>(X, S, left, right);
    expect_solved(e, i);
    const auto got = jml::solve_algebraic_riccati(e);
    EXPECT_LT(distance(got.X, X), 1e-12) << i;
    EXPECT_LE(distance(got.X, X), got.error) << i;
  }
}

}  // namespace algebraic
