// SPDX-License-Identifier: BSD-3-Clause
// The numbers that the demo of the car's log wrote, against those of gtsam's estimators on the same problem
// and what the demo says of them. Without the package gtsam there is no log, and this is skipped.
#include <gtest/gtest.h>

#include "summary.hpp"

namespace {

using demo_results::Summary;

class CarLog : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(demo_results::output("car_log") / "summary.csv"))
      GTEST_SKIP() << "skipped: the package gtsam is not installed";
  }
};

TEST_F(CarLog, WritesTheSameBytesTwice) { demo_results::expect_same_bytes_twice("car_log"); }

TEST_F(CarLog, NothingIsRefused) {
  const Summary car("car_log");
  for (const std::string noise : {"metadata_", "likely_", "coarse_"}) {
    for (const std::string key :
         {"ekf", "factored", "iterated", "ekf_once", "iterated_once", "lag2", "lag5", "lag10", "batch"})
      EXPECT_EQ(car[noise + key + "_refused"], 0) << noise << key;
  }
  EXPECT_EQ(car["likely_batch_samples_refused"], 0);
}

// gtsam 4.3.0 by examples/demo/car_log_gtsam.py: RMSE in 3D of ISAM2, and Levenberg-Marquardt of the whole
// flight.
TEST_F(CarLog, TheErrorsAreThoseOfGtsam) {
  const Summary car("car_log");
  EXPECT_NEAR(car["metadata_ekf_once_causal_rmse"], 1.702, 0.02);
  EXPECT_NEAR(car["metadata_lag2_later_rmse"], 0.361, 0.02);
  EXPECT_NEAR(car["metadata_batch_later_rmse"], 0.704, 0.002);
  for (const std::string key : {"ekf", "ekf_once", "iterated", "lag2", "lag10"})
    EXPECT_NEAR(car["likely_" + key + "_causal_rmse"], 0.233, 0.002) << key;
  EXPECT_NEAR(car["likely_lag2_later_rmse"], 0.076, 0.001);
  EXPECT_NEAR(car["likely_lag10_later_rmse"], 0.080, 0.001);
  for (const std::string key : {"batch", "batch_samples"})
    EXPECT_NEAR(car["likely_" + key + "_later_rmse"], 0.079, 0.001) << key;
  EXPECT_NEAR(car["coarse_batch_later_rmse"], 0.079, 0.001);
}

TEST_F(CarLog, WhoeverHoldsTheSamplesTheMinimumIsTheSame) {
  const Summary car("car_log");
  EXPECT_NEAR(car["metadata_batch_cost"], 5461.77, 2);  // gtsam's, whose increments are in other coordinates
  EXPECT_NEAR(car["likely_batch_cost"], 456.31, 0.2);
  EXPECT_NEAR(car["coarse_batch_cost"], 457.82, 0.2);
  EXPECT_NEAR(car["likely_batch_cost"], car["likely_batch_samples_cost"], 0.1);
}

// A heading that is off by 150°. ISAM2: 0.243.
TEST_F(CarLog, AStepOfAWholeSecondIsWorthIterating) {
  const Summary car("car_log");
  EXPECT_GT(car["coarse_ekf_causal_rmse"], 0.35);
  EXPECT_GT(car["coarse_ekf_once_causal_rmse"], 0.35);
  EXPECT_GT(car["coarse_iterated_causal_rmse"], 0.35);
  for (const std::string key : {"iterated_once", "lag2", "lag5", "lag10"})
    EXPECT_LT(car["coarse_" + key + "_causal_rmse"], 0.26) << key;
}

}  // namespace
