// SPDX-License-Identifier: BSD-3-Clause
// A campaign allocates for each block, never for a run or a step.
#include <gtest/gtest.h>

#include "heap_trap.hpp"
#include "campaign/walk.hpp"

namespace {

int allocations(int runs, int steps) {
  walk::Scenario scenario;
  scenario.steps = steps;
  jml::Campaign campaign{scenario, walk::kalman()};
  campaign.options = {.runs = runs, .threads = 1, .blocks = 4};
  const heap_trap::Armed armed;
  EXPECT_TRUE(campaign.run().ok());
  return heap_trap::allocations;
}

TEST(CampaignNoHeap, NeitherForARunNorForAStep) {
  const int few = allocations(8, 10);
  EXPECT_GT(few, 4);
  EXPECT_EQ(allocations(800, 10), few);
  EXPECT_EQ(allocations(8, 1000), few);
}

}  // namespace
