// SPDX-License-Identifier: BSD-3-Clause
// The statistics of a campaign against the closed law of a Kalman filter in its steady state: the error of
// every sample is normal with variance P = ½, NEES and NIS are χ² with one degree of freedom.
#include <gtest/gtest.h>

#include "campaign/walk.hpp"
#include "figure.hpp"

namespace {

void expect_inside(const jml::Figure& f, double expected, const char* what) {
  // Four standard errors; a hundred figures are looked at.
  EXPECT_LT(std::abs(f.value - expected), 4 * f.standard_error) << what;
}

TEST(CampaignStatistics, TheLawOfTheSteadyKalmanFilter) {
  jml::Campaign campaign{
      walk::Scenario{}, jml::Estimator{"Kalman", [](const auto&) { return walk::filter(); }, jml::OneStep{}}};
  campaign.options = {.runs = 20'000, .seed = 3, .threads = 2};
  const auto result = campaign.run();
  const auto kalman = result.estimator(0);
  for (int k = 1; k <= 5; ++k) {
    const auto sample = kalman.at(k);
    expect_inside(sample.mean_error(0), 0, "mean");
    expect_inside(sample.mse(0), walk::P, "mse");
    expect_inside(sample.rmse(0), std::sqrt(walk::P), "rmse");
    expect_inside(sample.nees(), 1, "nees");
    expect_inside(sample.nis(), 1, "nis");
    expect_inside(sample.cost(), 0.5, "cost: half the NIS on a linear system");
    // Standard errors themselves, from the moments of the normal law: √(P/n), P √(2/n), √(2/n). The largest
    // scatter is that of the fourth powers', √(96/4/n)/2 of itself.
    const double n = 20'000, root = std::sqrt(n);
    EXPECT_NEAR(sample.mean_error(0).standard_error * root, std::sqrt(walk::P), 0.03 * std::sqrt(walk::P));
    EXPECT_NEAR(sample.mse(0).standard_error * root, walk::P * std::sqrt(2), 0.06 * walk::P);
    EXPECT_NEAR(sample.rmse(0).standard_error * root, std::sqrt(walk::P / 2), 0.06 * std::sqrt(walk::P));
    EXPECT_NEAR(sample.nees().standard_error * root, std::sqrt(2), 0.08);
  }
  expect_inside(kalman.nees(), 1, "nees of the runs");
  expect_inside(kalman.nis(), 1, "nis of the runs");
  // NIS of the steps of a run are independent, so their mean over 5 has a fifth of the variance.
  EXPECT_NEAR(kalman.nis().standard_error * std::sqrt(20'000), std::sqrt(2.0 / 5), 0.03);
}

/// Of many campaigns with other seeds, the share whose interval holds the true value.
TEST(CampaignStatistics, IntervalsCoverTheTruthAsOftenAsTheySay) {
  constexpr int campaigns = 4000;
  walk::Scenario scenario;
  scenario.steps = 1;
  jml::Campaign campaign{scenario, walk::kalman()};
  int mean = 0, mse = 0, rmse = 0, nees = 0, nis = 0, run_rmse = 0;
  const auto covers = [](const jml::Figure& f, double truth) { return f.low <= truth && truth <= f.high; };
  for (int i = 0; i < campaigns; ++i) {
    campaign.options = {.runs = 300, .seed = static_cast<std::uint64_t>(1000 + i), .threads = 1, .blocks = 1};
    const auto result = campaign.run();
    const auto sample = result.estimator(0).at(1);
    mean += covers(sample.mean_error(0), 0);
    mse += covers(sample.mse(0), walk::P);
    rmse += covers(sample.rmse(0), std::sqrt(walk::P));
    nees += covers(sample.nees(), 1);
    nis += covers(sample.nis(), 1);
    run_rmse += covers(result.estimator(0).run_rmse(), std::sqrt(2 * walk::P / 3.141592653589793));  // E|e|
  }
  // 95 % ± 1 %; the scatter of 4000 campaigns is 0.34 %.
  const std::pair<const char*, int> all[] = {{"mean", mean}, {"mse", mse}, {"rmse", rmse}, {"nees", nees}, {"nis", nis}, {"run_rmse", run_rmse}};
  for (const auto& [name, hits] : all) {
    figure::print(std::string(name) + "_covered", 100.0 * hits / campaigns, "%");
    EXPECT_NEAR(static_cast<double>(hits) / campaigns, 0.95, 0.01);
  }
}

}  // namespace
