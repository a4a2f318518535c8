// SPDX-License-Identifier: BSD-3-Clause
// The warm solver: close to the start it answers alone, elsewhere the cold one does, and never with another
// root. And neither touches the heap.
#include <gtest/gtest.h>

#include <cstdlib>

#include "heap_trap.hpp"
#include "riccati/algebraic_checks.hpp"

namespace {

using heap_trap::allocations, heap_trap::armed;

using jml::Status;
using M3 = jml::Matrix<double, 3, 3>;
using One = jml::Matrix<double, 1, 1>;

jml::AlgebraicRiccati<double, 3> filter() {
  jml::Noise noise(7);
  return algebraic::random_filter<3>(noise);
}

TEST(Warm, TheSolutionItselfNeedsOneDoubling) {
  const auto e = filter();
  const auto cold = jml::solve_algebraic_riccati(e);
  const auto warm = jml::solve_algebraic_riccati(e, cold.X);
  EXPECT_EQ(warm.status, Status::ok);
  EXPECT_TRUE(warm.warm);
  EXPECT_LE(warm.iterations, 2);
  EXPECT_LT(algebraic::distance(warm.X, cold.X), 1e-15);
}

TEST(Warm, UselessStartsFallBack) {
  const auto e = filter();
  const auto cold = jml::solve_algebraic_riccati(e);
  for (const double bad : {1e30, 1e-3 / 0.0, std::nan("")}) {
    const M3 start = M3::Constant(bad);
    const auto got = jml::solve_algebraic_riccati(e, start);
    EXPECT_EQ(got.status, Status::ok) << bad;
    EXPECT_FALSE(got.warm) << bad;
    EXPECT_EQ(got.X, cold.X) << bad;
  }
}

// x² - 2 x - 3 = 0: 3 stabilises, -1 does not. Starts on, near and beyond the wrong root.
TEST(Warm, UnstableStartsDoNotFindTheOtherRoot) {
  const jml::AlgebraicRiccati<double, 1> e{One(1), One(1), One(3), One(1)};
  for (const double start : {-1., -1 + 1e-15, -1 - 1e-9, -1.5, -30., 0., 1.}) {
    const auto got = jml::solve_algebraic_riccati(e, One(start));
    EXPECT_EQ(got.status, Status::ok) << start;
    EXPECT_NEAR(got.X(0), 3, 1e-14) << start;
  }
}

// The filter equation's other solutions: V of the time-reversed equation (antistabilising), and starts
// towards it.
TEST(Warm, UnstableStartsOfThreeStates) {
  const auto e = filter();
  const auto wanted = jml::solve_algebraic_riccati(e);
  auto reversed = e;
  reversed.signs = {-1, -1, 1, -1};
  const M3 other = -jml::solve_algebraic_riccati(reversed).X;
  ASSERT_LT(algebraic::relative_residual(e, other), 1e-13);
  ASSERT_FALSE(algebraic::stabilizes(e, other));
  for (int i = 0; i <= 20; ++i) {
    const M3 start = other + i / 10. * (wanted.X - other);
    const auto got = jml::solve_algebraic_riccati(e, start);
    EXPECT_EQ(got.status, Status::ok) << i;
    EXPECT_LT(algebraic::distance(got.X, wanted.X), 1e-12) << i;
  }
}

TEST(Warm, FollowsAMovingEquation) {
  auto e = filter();
  M3 X = jml::solve_algebraic_riccati(e).X;
  const M3 direction = (M3() << 0, 0.01, 0, -0.02, 0, 0.01, 0, 0.01, -0.01).finished();
  for (int i = 0; i < 100; ++i) {
    e.A += direction;
    e.B = jml::kernel::transposed(e.A);
    const auto warm = jml::solve_algebraic_riccati(e, X);
    ASSERT_TRUE(warm.warm) << i;
    EXPECT_LT(algebraic::distance(warm.X, jml::solve_algebraic_riccati(e).X), 1e-12) << i;
    EXPECT_EQ(warm.X, jml::kernel::transposed(warm.X)) << i;
    X = warm.X;
  }
}

TEST(NoHeap, TheTrapWorks) {
  allocations = 0;
  armed = true;
  void* volatile block = std::malloc(8);
  armed = false;
  std::free(block);
  EXPECT_EQ(allocations, 1);
}

TEST(NoHeap, ColdWarmCriticalRefused) {
  const auto e = filter();
  jml::AlgebraicRiccati<double, 3> critical{M3::Identity(), M3::Identity(), -M3::Identity(), M3::Identity()},
      bad = e;
  bad.Q(0) = std::nan("");
  allocations = 0;
  armed = true;
  const auto cold = jml::solve_algebraic_riccati(e), warm = jml::solve_algebraic_riccati(e, cold.X);
  const auto shifted = jml::solve_algebraic_riccati(critical), refused = jml::solve_algebraic_riccati(bad);
  const auto axis =
      jml::solve_algebraic_riccati(jml::AlgebraicRiccati<double, 1>{One(0), One(0), One(-1), One(1)});
  armed = false;
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(cold.status, Status::ok);
  EXPECT_TRUE(warm.warm);
  EXPECT_EQ(shifted.status, Status::accepted_critical);
  EXPECT_LT((shifted.X - M3::Identity()).norm(), 1e-14);
  EXPECT_EQ(refused.status, Status::invalid_option);
  EXPECT_EQ(axis.status, Status::eigenvalues_on_axis);
}

}  // namespace
