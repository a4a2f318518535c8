// SPDX-License-Identifier: BSD-3-Clause
// Random algebraic Riccati equations with a tall unknown.
#include "riccati/algebraic_random_checks.hpp"

namespace {

TEST(RandomAlgebraic, SevenByTwo) { algebraic::expect_solutions_found<7, 2>(15); }

}  // namespace
