// SPDX-License-Identifier: BSD-3-Clause
// Random algebraic Riccati equations with a wide unknown.
#include "riccati/algebraic_random_checks.hpp"

namespace {

TEST(RandomAlgebraic, ThreeByFive) { algebraic::expect_solutions_found<3, 5>(15); }

}  // namespace
