// SPDX-License-Identifier: BSD-3-Clause
// Random algebraic Riccati equations, nine and fifteen states.
#include "riccati/algebraic_random_checks.hpp"

namespace {

TEST(RandomAlgebraic, NineStatesSymmetric) { algebraic::expect_filters_solved<9>(15); }
TEST(RandomAlgebraic, NineStatesNonsymmetric) { algebraic::expect_solutions_found<9, 9>(15); }
TEST(RandomAlgebraic, FifteenStatesSymmetric) { algebraic::expect_filters_solved<15>(15); }
TEST(RandomAlgebraic, FifteenStatesNonsymmetric) { algebraic::expect_solutions_found<15, 15>(15); }

}  // namespace
