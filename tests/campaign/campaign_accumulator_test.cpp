// SPDX-License-Identifier: BSD-3-Clause
// The figures of a campaign against a few runs worked out by hand.
#include <gtest/gtest.h>

#include "campaign/scripted.hpp"

namespace {

constexpr double t2 = 4.302652729749464;  // Student's t, 2 degrees of freedom, 97.5 %

/// Errors at samples 1 and 2: (1, 2), (-1, 4), (3, 0); the first column is no measurement.
const std::vector<std::vector<double>> three = {{0, 1, 2}, {0, -1, 4}, {0, 3, 0}};

auto campaign_of(const std::vector<std::vector<double>>& table, int blocks = 2) {
  scripted::Scenario scenario;
  scenario.table = table;
  jml::Campaign campaign{scenario, scripted::echo()};
  campaign.options = {.runs = static_cast<std::int64_t>(table.size()), .threads = 1, .blocks = blocks};
  return campaign;
}

void expect_figure(const jml::Figure& f, double value, double standard_error, double t = t2) {
  EXPECT_DOUBLE_EQ(f.value, value);
  EXPECT_NEAR(f.standard_error, standard_error, 1e-14 * std::abs(value) + 1e-15);
  EXPECT_NEAR(f.low, value - t * standard_error, 1e-13);
  EXPECT_NEAR(f.high, value + t * standard_error, 1e-13);
}

TEST(CampaignTally, ErrorsByHand) {
  const auto result = campaign_of(three).run();
  ASSERT_TRUE(result.ok()) << result.message();
  const auto first = result.estimator("echo").at(1);
  EXPECT_EQ(first.kept(), 3);
  // Errors 1, -1, 3: mean 1, sample variance 4. Squares 1, 1, 9: mean 11/3, sample variance 64/3.
  expect_figure(first.mean_error(0), 1, std::sqrt(4.0 / 3));
  const double mse = 11.0 / 3, of_mse = std::sqrt(64.0 / 9);
  EXPECT_DOUBLE_EQ(first.mse(0).value, mse);
  EXPECT_NEAR(first.mse(0).standard_error, of_mse, 1e-14);
  EXPECT_NEAR(first.mse(0).low, mse * std::exp(-t2 * of_mse / mse), 1e-13);
  EXPECT_NEAR(first.mse(0).high, mse * std::exp(t2 * of_mse / mse), 1e-11);
  EXPECT_DOUBLE_EQ(first.rmse(0).value, std::sqrt(mse));
  EXPECT_NEAR(first.rmse(0).standard_error, of_mse / (2 * std::sqrt(mse)), 1e-14);
  EXPECT_NEAR(first.rmse(0).low, std::sqrt(first.mse(0).low), 1e-14);
  EXPECT_DOUBLE_EQ(first.rmse().value, first.rmse(0).value) << "with one state the scalar error is its size";
  const auto second = result.estimator(0).at(2);
  expect_figure(second.mean_error(0), 2, std::sqrt(4.0 / 3));
  EXPECT_DOUBLE_EQ(second.mse(0).value, 20.0 / 3);
}

TEST(CampaignTally, ConsistencyBoxesAndRefusalsByHand) {
  const auto result = campaign_of(three).run();
  const auto first = result.estimator(0).at(1), second = result.estimator(0).at(2);
  expect_figure(first.nees(), 11.0 / 12, std::sqrt(64.0 / 9) / 4);  // e²/4
  expect_figure(first.nis(), 22, 2 * std::sqrt(4.0 / 3));           // 2 (10 + e)
  EXPECT_DOUBLE_EQ(second.nis().value, 2 * (12.0 + 10) / 2) << "the refused step has none";
  EXPECT_EQ(first.refused(), 0);
  EXPECT_EQ(second.refused(), 1);
  EXPECT_EQ(first.rejected(), 1);
  EXPECT_EQ(second.rejected(), 0);
  EXPECT_TRUE(std::isnan(first.cost().value));
  // The box holds the truth where -2.5 <= error <= 1.5.
  EXPECT_DOUBLE_EQ(first.contained(0), 2.0 / 3);
  EXPECT_DOUBLE_EQ(second.contained(), 1.0 / 3);
  EXPECT_DOUBLE_EQ(first.width(0), 4);
}

TEST(CampaignTally, OverallByHand) {
  const auto result = campaign_of(three).run();
  const auto echo = result.estimator(0);
  EXPECT_EQ(echo.kept(), 3);
  EXPECT_EQ(echo.refused(), 1);
  EXPECT_EQ(echo.rejected(), 1);
  const double run[] = {std::sqrt(2.5), std::sqrt(8.5), std::sqrt(4.5)};
  const double mean = (run[0] + run[1] + run[2]) / 3;
  double spread = 0;
  for (const double r : run) spread += (r - mean) * (r - mean);
  EXPECT_DOUBLE_EQ(echo.run_rmse().value, mean);
  EXPECT_NEAR(echo.run_rmse().standard_error, std::sqrt(spread / 2 / 3), 1e-14);
  EXPECT_DOUBLE_EQ(echo.nees().value, (2.5 + 8.5 + 4.5) / 4 / 3);
}

TEST(CampaignTally, WithoutFiguresWhereThereAreNone) {
  const auto result = campaign_of(three).run();
  EXPECT_EQ(result.estimator(0).at(0).kept(), 0) << "nothing was measured at the start";
  for (const auto& nothing :
       {result.estimator(0).at(3), result.estimator(0).at(-1), result.estimator(7).at(1),
        result.estimator("none").at(1), result.estimator(-1).at(1)})
    EXPECT_TRUE(std::isnan(nothing.mse(0).value));
  EXPECT_TRUE(std::isnan(result.estimator(0).at(1).mse(1).value));
  EXPECT_EQ(result.estimator("none").kept(), 0);
  const auto one = campaign_of({{0, 1, 2}}).run();
  EXPECT_EQ(one.estimator(0).at(1).mean_error(0).value, 1);
  EXPECT_TRUE(std::isnan(one.estimator(0).at(1).mean_error(0).standard_error)) << "one run has no spread";
}

TEST(CampaignTally, MeasuredAtTheStart) {
  scripted::Scenario scenario;
  scenario.measured_at_start = true;
  scenario.table = {{3, 1, 1}, {1, 1, 1}};
  jml::Campaign campaign{scenario, scripted::echo()};
  campaign.options = {.runs = 2, .threads = 1};
  const auto result = campaign.run();
  const auto start = result.estimator(0).at(0);
  EXPECT_EQ(start.kept(), 2);
  EXPECT_DOUBLE_EQ(start.mean_error(0).value, 2) << "the update with y[0] is in it";
  EXPECT_EQ(start.rejected(), 1);
  EXPECT_DOUBLE_EQ(result.estimator(0).run_rmse().value, (std::sqrt(11.0 / 3) + 1) / 2)
      << "three samples a run";
}

TEST(CampaignTally, FailedAndLostRunsAreListedAndLeftOut) {
  auto table = three;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  table.insert(table.begin() + 1, {0, nan, 1});             // run 1: not finite at 1
  table.insert(table.begin() + 2, {0, 4, scripted::dead});  // run 2: refused at 1, no prediction at 2
  table.push_back({0, 60, 70});                             // run 5: lost at 1, and stays so
  table.push_back({0, -3, -51});                            // run 6: violated bound at 1, lost at 2
  table.push_back({0, 60, nan});                            // run 7: lost, then not finite
  const auto result = campaign_of(table, 3).run(), good = campaign_of(three).run();
  const auto echo = result.estimator(0);
  EXPECT_EQ(echo.kept(), 3);
  // In other blocks: equal to rounding.
  EXPECT_DOUBLE_EQ(echo.run_rmse().value, good.estimator(0).run_rmse().value);
  EXPECT_DOUBLE_EQ(echo.at(2).mse(0).standard_error, good.estimator(0).at(2).mse(0).standard_error);
  EXPECT_EQ(echo.at(1).refused(), 1) << "refusals of every run count";
  EXPECT_EQ(echo.at(2).refused(), 2);
  EXPECT_EQ(echo.at(1).rejected(), 2);
  const auto failed = echo.failed(), lost = echo.lost();
  using Kind = jml::RunFault::Kind;
  ASSERT_EQ(failed.size(), 3U);
  EXPECT_EQ(failed[0].run, 1);
  EXPECT_EQ(failed[0].kind, Kind::not_finite);
  EXPECT_EQ(failed[0].step, 1);
  EXPECT_EQ(failed[1].run, 2);
  EXPECT_EQ(failed[1].kind, Kind::prediction_refused);
  EXPECT_EQ(failed[1].step, 2);
  EXPECT_EQ(failed[1].status, jml::Status::dynamics_not_finite);
  EXPECT_EQ(failed[2].run, 7);
  ASSERT_EQ(lost.size(), 2U);
  EXPECT_EQ(lost[0].run, 5);
  EXPECT_EQ(lost[0].step, 1);
  EXPECT_EQ(lost[0].scalar_error, 60);
  EXPECT_EQ(lost[1].run, 6);
  EXPECT_EQ(lost[1].step, 2);
}

/// Errors in other units, as the user states them.
struct Doubled : scripted::Scenario {
  double error(const scripted::Number& x, const scripted::Number& truth) const {
    return 2 * (truth(0) - x(0));
  }
};
TEST(CampaignTally, TheScenariosOwnError) {
  Doubled scenario;
  scenario.table = three;
  jml::Campaign campaign{scenario, scripted::echo(),
                         jml::Estimator{"with cost", [](const auto&) { return scripted::Echo{}; },
                                        [](const auto& filter, const auto&) { return filter.x()(0); }}};
  campaign.options = {.runs = 3, .threads = 1};
  const auto result = campaign.run();
  EXPECT_DOUBLE_EQ(result.estimator(0).at(1).rmse().value, 2 * std::sqrt(11.0 / 3));
  EXPECT_DOUBLE_EQ(result.estimator(0).at(1).rmse(0).value, std::sqrt(11.0 / 3));
  EXPECT_DOUBLE_EQ(result.estimator(1).at(2).cost().value, 11)
      << "mean of 12 and 10; no cost of a refused step";
}

}  // namespace
