// SPDX-License-Identifier: BSD-3-Clause
// The numbers that the radar demo wrote, against a published interval and against theory.
#include <gtest/gtest.h>

#include "summary.hpp"

namespace {

using demo_results::Summary;

TEST(RadarTrack, WritesTheSameBytesTwice) { demo_results::expect_same_bytes_twice("radar"); }

// A mean over 100 runs and 600 steps, which are not independent along a run: the interval of a single time is
// wide enough for it (published for n = 6: 6 ± 1.96 √(12/100)), and an EKF with Q/10 or R/10 is far outside.
TEST(RadarTrack, TheEkfIsConsistent) {
  const Summary radar("radar");
  EXPECT_NEAR(radar["ekf_nees"], 6, 0.68);
  EXPECT_NEAR(radar["iekf_nees"], 6, 0.68);
  EXPECT_EQ(radar["ekf_refused"], 0);
}

TEST(RadarTrack, WhereTheReferenceIsOnTheTrackJmlIsAsGoodAsTheEkf) {
  const Summary radar("radar");
  for (const std::string rule : {"jml_start", "iterated_estimate", "iekf"}) {
    EXPECT_NEAR(radar[rule + "_position_rmse"], radar["ekf_position_rmse"], 0.05 * radar["ekf_position_rmse"])
        << rule;
    EXPECT_EQ(radar[rule + "_refused"], 0) << rule;
  }
  EXPECT_TRUE(std::isfinite(radar["jml_origin_position_rmse"]));
  EXPECT_TRUE(std::isfinite(radar["iterated_origin_position_rmse"]));
}

}  // namespace
