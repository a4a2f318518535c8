// SPDX-License-Identifier: BSD-3-Clause
// The numbers that plaza1_bounded wrote: what a bound promises must hold on real data too.
#include <gtest/gtest.h>

#include "summary.hpp"

namespace {

using demo_results::Summary;

TEST(BoundedDemo, WritesTheSameBytesTwice) { demo_results::expect_same_bytes_twice("plaza1_bounded"); }

// Every range and every row of odometry honours these bounds: counted apart, from the recording and its
// ground truth.
TEST(BoundedDemo, TheRobotIsInTheGuaranteedBoxWhereTheBoundsAreHonoured) {
  const Summary plaza{"plaza1_bounded"};
  EXPECT_EQ(plaza["guaranteed_honoured.inside"], 1);
  EXPECT_EQ(plaza["guaranteed_honoured.contradictions"], 0);
  EXPECT_EQ(plaza["paved_honoured.inside"], 1);
  EXPECT_EQ(plaza["paved_honoured.contradictions"], 0);
  for (const std::string run : {"guaranteed_honoured", "linearised_honoured", "paved_honoured",
                                "guaranteed_tight", "linearised_tight", "paved_tight"})
    EXPECT_EQ(plaza[run + ".refused"], 0) << run;
}

// The box is bought with width: at most three times the linearised one's.
TEST(BoundedDemo, TheGuaranteedBoxStaysUseful) {
  const Summary plaza{"plaza1_bounded"};
  for (const std::string bound : {"honoured", "tight"}) {
    EXPECT_LE(plaza["guaranteed_" + bound + ".median_width_m"],
              3 * plaza["linearised_" + bound + ".median_width_m"])
        << bound;
  }
}

// Eight boxes keep the promise at the linearised one's width.
TEST(BoundedDemo, TheUnionIsNoWiderThanTheLinearisedBox) {
  const Summary plaza{"plaza1_bounded"};
  for (const std::string bound : {"honoured", "tight"}) {
    EXPECT_EQ(plaza["paved_" + bound + ".inside"], 1) << bound;
    EXPECT_LE(plaza["paved_" + bound + ".median_width_m"], plaza["linearised_" + bound + ".median_width_m"])
        << bound;
  }
}

}  // namespace
