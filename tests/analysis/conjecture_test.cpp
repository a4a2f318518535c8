// SPDX-License-Identifier: BSD-3-Clause
// Theorem 1 and Conjectures 1 and 2 of Rusnak 2018, section 5: a counterexample by hand, and random pairs.
// The shares are those of an independent computation with numpy's eigenvectors of the 4×4 matrix of (29).
#include <gtest/gtest.h>

#include <cmath>
#include <demo/support/claims_pairs.hpp>

namespace {

using demo::claims::count_pairs, demo::claims::PairCount;
using One = jml::Matrix<double, 1, 1>;

double steady_P(double F, double f_x, double M, double m_x) {
  const jml::AlgebraicRiccati<double, 1, 1> equation{One(F), One(f_x), One(1.0), One(m_x * M)};
  const auto solution = jml::solve_algebraic_riccati(equation);
  EXPECT_EQ(solution.status, jml::Status::ok);
  return solution.X(0, 0);
}

// F = f_x = M = G = Q = R = 1, m_x = 0.21: 2P + 1 - 0.21 P² = 0 has P = 10, at which P' falls: every P_0 ≥ 0
// goes there. All is observable and controllable, and f_x - K₂ m_x = 1 - 10 · 0.21² = 0.559 > 0.
TEST(Conjecture1, FailsAsPrintedInOneState) {
  const double P = steady_P(1, 1, 1, 0.21);
  EXPECT_NEAR(P, 10, 1e-13);
  EXPECT_LT(2 - 2 * 0.21 * P, 0);  // the slope of P' there
  EXPECT_NEAR(1 - P * 0.21 * 0.21, 0.559, 1e-13);
  EXPECT_LT(1 - P * 1, 0);     // F - K₁ M is stable
  EXPECT_LT(1 - P * 0.21, 0);  // and F - P m_xᵀ R⁻¹ M
}

// M = ε, m_x = 0.21 ε: P m_x² = 0.21 (1 + √(1 + 0.21 ε²)) < 1 for every ε ≤ 1, however small m_x - M is.
TEST(Conjecture2, NoBoundServesAllSystems) {
  for (const double e : {1.0, 0.1, 0.01, 1e-3}) {
    const double m_x = 0.21 * e, P = steady_P(1, 1, e, m_x), gain = P * m_x * m_x;
    EXPECT_NEAR(gain, 0.21 * (1 + std::sqrt(1 + 0.21 * e * e)), 1e-9) << e;
    EXPECT_GT(1 - gain, 0.5) << e;
  }
}

TEST(Theorem1, HoldsOnRandomPairs) {
  const PairCount c = count_pairs({.gap = 0}, 20000, 1);
  EXPECT_EQ(c.solved, c.pairs);
  EXPECT_EQ(c.either + c.mixed, 0);
  EXPECT_EQ(c.light, c.pairs);
}

void near_share(long part, long whole, double expected, double error) {
  const double n = static_cast<double>(whole), ours = static_cast<double>(part) / n;
  EXPECT_NEAR(ours, expected, 4 * std::hypot(error, std::sqrt(expected * (1 - expected) / n)));
}

TEST(Conjecture1, FailsInAShareOfRandomPairs) {
  const PairCount free = count_pairs({}, 20000, 2), tenth = count_pairs({.gap = 0.1}, 40000, 3);
  near_share(free.solved, free.pairs, 1 - 0.5818, 0.0026);
  near_share(free.either, free.solved, 0.7611, 0.0035);
  near_share(tenth.first, tenth.solved, 0.0348, 0.0009);
  near_share(tenth.second, tenth.solved, 0.0423, 0.0010);
  near_share(tenth.either, tenth.solved, 0.0627, 0.0012);
  EXPECT_EQ(free.mixed + tenth.mixed, 0);
}

// By Lyapunov: with f_x = F and m_x = s M, P is symmetric and P⁻¹ serves both loops for ½ ≤ s ≤ 2; below a
// load of one, the X of the Lyapunov equation of F - P m_xᵀ R⁻¹ M does.
TEST(Conjecture1, HoldsUnderEitherConditionMore) {
  const PairCount mild = count_pairs({.same_dynamics = true, .least_ratio = 0.5, .most_ratio = 2}, 20000, 5);
  EXPECT_EQ(mild.solved, mild.pairs);
  EXPECT_EQ(mild.either, 0);
  const PairCount steep =
      count_pairs({.same_dynamics = true, .least_ratio = 0.05, .most_ratio = 0.5}, 2000, 6);
  EXPECT_GT(steep.second, steep.pairs / 4);
  EXPECT_EQ(steep.first, 0);
  for (const double gap : {0.02, 0.1, 0.5}) {
    const PairCount c = count_pairs({.gap = gap}, 20000, 7);
    EXPECT_EQ(c.light_bad, 0) << gap;
    EXPECT_GT(c.light, 500) << gap;
  }
}

}  // namespace
