// SPDX-License-Identifier: BSD-3-Clause
// The numbers that the demos of the deeper estimators wrote, against their bounds, the references and what
// the demos say of them.
#include <gtest/gtest.h>

#include "summary.hpp"

namespace {

using demo_results::Summary;

TEST(LagDemos, WriteTheSameBytesTwice) {
  demo_results::expect_same_bytes_twice("van_der_pol_lag");
  demo_results::expect_same_bytes_twice("plaza1_whole_flight");
}

class LagOfVanDerPol : public testing::Test {
 protected:
  const Summary lag{"van_der_pol_lag"};

  double ekf_over(const std::string& dt, const std::string& setting) const {
    return lag[dt + "_ekf_distance"] / lag[dt + "_" + setting + "_distance"];
  }
  /// use(key of the run) for all windows.
  template <typename Use>
  static void for_each_window(const Use& use) {
    for (const std::string sweeps : {"_sweeps1", "_sweeps2", "_sweeps3", "_converged"}) {
      for (const std::string window :
           {"dt50ms_lag1", "dt50ms_lag5", "dt50ms_lag10", "dt50ms_lag20", "dt50ms_lag40", "dt10ms_lag5",
            "dt10ms_lag20", "dt10ms_lag100", "dt10ms_lag200"})
        use(window + sweeps);
    }
  }
};

// What is asked of the fixed lag: a twentieth with the default two sweeps, a three hundredth to convergence.
TEST_F(LagOfVanDerPol, TwoSecondsReachTheExactAnswer) {
  EXPECT_GE(ekf_over("dt50ms", "lag20_sweeps2"), 20);
  EXPECT_GE(ekf_over("dt50ms", "lag40_converged"), 300);
  EXPECT_GE(ekf_over("dt10ms", "lag200_converged"), 300);
}

// An independent computation: at dt = 0.01 s, 20 steps give a half of the EKF's distance, 100 a thirty-fifth.
TEST_F(LagOfVanDerPol, LagTimeCountsAndNotTheNumberOfSteps) {
  EXPECT_NEAR(ekf_over("dt10ms", "lag20_converged"), 2, 0.4);
  EXPECT_GE(ekf_over("dt10ms", "lag100_sweeps2"), 35);
  EXPECT_NEAR(ekf_over("dt10ms", "lag100_converged") / ekf_over("dt50ms", "lag20_converged"), 1, 0.5);
  EXPECT_NEAR(ekf_over("dt10ms", "lag5_converged") / ekf_over("dt50ms", "lag1_converged"), 1, 0.1);
}

TEST_F(LagOfVanDerPol, ALongerWindowIsNearer) {
  for (const std::string sweeps : {"_sweeps2", "_converged"}) {
    const auto falls = [&](const std::string& dt, const std::string& from, const std::string& to) {
      EXPECT_LT(lag[dt + "_lag" + to + sweeps + "_distance"],
                0.5 * lag[dt + "_lag" + from + sweeps + "_distance"])
          << dt << " " << to << sweeps;
    };
    falls("dt50ms", "1", "5");
    falls("dt50ms", "5", "10");
    falls("dt50ms", "10", "20");
    falls("dt50ms", "20", "40");
    falls("dt10ms", "5", "20");
    falls("dt10ms", "20", "100");
    falls("dt10ms", "100", "200");
  }
}

TEST_F(LagOfVanDerPol, SweepsCountToo) {
  EXPECT_LT(ekf_over("dt50ms", "lag40_sweeps1"), 5);
  EXPECT_LT(ekf_over("dt10ms", "lag200_sweeps1"), 10);
  EXPECT_NEAR(ekf_over("dt50ms", "lag40_sweeps1"), ekf_over("dt50ms", "lag20_sweeps1"), 0.2);
  EXPECT_LT(ekf_over("dt50ms", "lag40_sweeps2"), ekf_over("dt50ms", "lag40_sweeps3") / 5);
  for_each_window([&](const std::string& window) {
    EXPECT_LE(lag[window + "_sweeps"], 7) << window;  // a warm start needs few
  });
}

TEST_F(LagOfVanDerPol, OneStepIsNoNearerThanTheEkfAndTheRecursionFarther) {
  EXPECT_NEAR(ekf_over("dt50ms", "lag1_converged"), 1, 0.1);
  EXPECT_LT(ekf_over("dt50ms", "iterated"), 0.8);
  EXPECT_LT(ekf_over("dt10ms", "iterated"), 0.8);
  EXPECT_GT(lag["dt50ms_iterated_excess_cost"], lag["dt50ms_ekf_excess_cost"]);
}

TEST_F(LagOfVanDerPol, ExcessCostsAreDefinedPositiveAndFallWithTheDistance) {
  for_each_window([&](const std::string& window) {
    EXPECT_EQ(lag[window + "_refused"], 0) << window;
    EXPECT_EQ(lag[window + "_excess_cost_undefined"], 0) << window;
    EXPECT_GT(lag[window + "_excess_cost"], 0) << window;
  });
  for (const std::string dt : {"dt50ms", "dt10ms"}) {
    EXPECT_EQ(lag[dt + "_ekf_refused"], 0);
    EXPECT_EQ(lag[dt + "_iterated_refused"], 0);
    EXPECT_NEAR(lag[dt + "_ekf_excess_cost"], 0.02, 0.005);  // 0.2 standard deviations
  }
  EXPECT_LT(lag["dt50ms_lag20_sweeps2_excess_cost"], lag["dt50ms_ekf_excess_cost"] / 100);
  EXPECT_LT(lag["dt50ms_lag40_converged_excess_cost"], lag["dt50ms_ekf_excess_cost"] / 1e5);
}

// JML is optimal in J, not in RMSE.
TEST_F(LagOfVanDerPol, TheRmseDoesNotShowAnyOfThis) {
  for (const std::string dt : {"dt50ms", "dt10ms"}) {
    for (const std::string what : {"_position_rmse", "_velocity_rmse"}) {
      const double exact = lag[dt + "_optimum" + what];
      EXPECT_NEAR(lag[dt + "_ekf" + what], exact, 0.015 * exact) << dt << what;
      EXPECT_NEAR(lag[dt + "_iterated" + what], exact, 0.1 * exact) << dt << what;
      for_each_window([&](const std::string& window) {
        if (!window.starts_with(dt)) return;
        EXPECT_NEAR(lag[window + what], exact, 0.05 * exact) << window << what;
      });
    }
  }
}

class WholeFlightOfPlaza1 : public testing::Test {
 protected:
  const Summary plaza{"plaza1_whole_flight"};
  const std::vector<std::string> lags{"lag1", "lag5", "lag20", "lag100", "lag100_converged"};
};

// An independent implementation: 1.09 m.
TEST_F(WholeFlightOfPlaza1, HubersLossIsWithinTheBound) {
  EXPECT_LE(plaza["whole_huber_rmse"], 1.15);
  EXPECT_LE(plaza["file_order_whole_huber_rmse"], 1.15);
}

TEST_F(WholeFlightOfPlaza1, NothingIsRefused) {
  for (const std::string key : {"ekf", "whole_huber", "whole_plain", "whole_cauchy"}) {
    EXPECT_EQ(plaza[key + "_refused"], 0) << key;
    EXPECT_EQ(plaza["file_order_" + key + "_refused"], 0) << key;
  }
  for (const auto& key : lags) EXPECT_EQ(plaza[key + "_refused"], 0) << key;
}

// An independent implementation, in the order of the file: 0.89 m, 181 rejected, largest 2.70 m.
TEST_F(WholeFlightOfPlaza1, TheEkfIsThatOfTheReference) {
  EXPECT_NEAR(plaza["file_order_ekf_rmse"], 0.887, 0.01);
  EXPECT_NEAR(plaza["file_order_ekf_rejected"], 181, 3);
  EXPECT_NEAR(plaza["file_order_ekf_largest_error"], 2.70, 0.05);
  EXPECT_NEAR(plaza["ekf_rmse"], plaza["file_order_ekf_rmse"], 0.05);
  EXPECT_LE(plaza["ekf_rejected"], 5);  // in order of time there is next to nothing to reject
}

TEST_F(WholeFlightOfPlaza1, DepthBringsTheOptimumNearerAndNotTheTruth) {
  double before = plaza["ekf_distance"];
  EXPECT_LT(before, 0.1);
  for (const std::string key : {"lag1", "lag5", "lag20", "lag100"}) {
    EXPECT_LT(plaza[key + "_distance"], 1.02 * before) << key;
    before = plaza[key + "_distance"];
  }
  EXPECT_LT(plaza["lag100_distance"], 0.5 * plaza["ekf_distance"]);
  EXPECT_LT(plaza["lag100_excess_cost"], 0.25 * plaza["ekf_excess_cost"]);
  EXPECT_NEAR(plaza["lag100_rmse"], plaza["lag100_converged_rmse"], 0.01);
  EXPECT_EQ(plaza["ekf_excess_cost_undefined"], 0);
  for (const auto& key : lags) {
    EXPECT_NEAR(plaza[key + "_rmse"], plaza["ekf_rmse"], 0.03) << key;
    EXPECT_EQ(plaza[key + "_excess_cost_undefined"], 0) << key;
    EXPECT_GT(plaza[key + "_excess_cost"], 0) << key;
  }
  EXPECT_LT(plaza["whole_huber_rmse"], 0.93 * plaza["ekf_rmse"]);  // it is smoothed
}

TEST_F(WholeFlightOfPlaza1, WhiteNoiseIsTheWrongModelOfTheRadios) {
  EXPECT_NEAR(plaza["correlation_of_errors"], 0.76, 0.05);
  EXPECT_NEAR(plaza["ekf_nees"], 8, 1);  // 2 is expected
  EXPECT_GT(plaza["whole_huber_nees"], plaza["ekf_nees"]);
}

TEST_F(WholeFlightOfPlaza1, ALossSavesTheWholeIntervalFromLateRangesAndAGateTheEkf) {
  EXPECT_GT(plaza["file_order_late_ranges"], 200);
  EXPECT_GT(plaza["file_order_ekf_ungated_rmse"], 2);
  EXPECT_GT(plaza["file_order_whole_plain_rmse"], 2);
  EXPECT_LT(plaza["file_order_whole_huber_rmse"], plaza["file_order_ekf_rmse"]);
  EXPECT_LT(plaza["file_order_whole_cauchy_rmse"], plaza["file_order_ekf_rmse"]);
  EXPECT_NEAR(plaza["whole_huber_rmse"], plaza["whole_plain_rmse"], 0.02);
  EXPECT_NEAR(plaza["whole_cauchy_rmse"], plaza["whole_plain_rmse"], 0.02);
}

}  // namespace
