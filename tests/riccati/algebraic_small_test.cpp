// SPDX-License-Identifier: BSD-3-Clause
// Random algebraic Riccati equations, two and four states, and a small wide unknown.
#include "riccati/algebraic_random_checks.hpp"

namespace {

TEST(RandomAlgebraic, TwoStatesSymmetric) { algebraic::expect_filters_solved<2>(30); }
TEST(RandomAlgebraic, TwoStatesNonsymmetric) { algebraic::expect_solutions_found<2, 2>(30); }
TEST(RandomAlgebraic, FourStatesSymmetric) { algebraic::expect_filters_solved<4>(20); }
TEST(RandomAlgebraic, FourStatesNonsymmetric) { algebraic::expect_solutions_found<4, 4>(20); }
TEST(RandomAlgebraic, OneByFour) { algebraic::expect_solutions_found<1, 4>(15); }

}  // namespace
