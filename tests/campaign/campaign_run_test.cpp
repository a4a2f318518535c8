// SPDX-License-Identifier: BSD-3-Clause
// A campaign as a whole: the same bits for any threads, runs that fail, replays, options that make no sense.
#include <gtest/gtest.h>

#include "campaign/files.hpp"
#include "campaign/walk.hpp"

namespace {

const files::Directory directory;

/// The largest first measurement of some hundred is above 3: a few runs break.
jml::Campaign campaign{walk::Scenario{}, walk::kalman(), walk::brittle(4.5)};

const jml::CampaignOptions usual{.runs = 1003, .seed = 5, .threads = 1, .blocks = 16, .progress = false};

TEST(Campaign, SameBytesForAnyThreads) {
  campaign.options = usual;
  const auto one = campaign.run();
  ASSERT_TRUE(one.ok()) << one.message();
  const std::string report = files::report(one, directory);
  EXPECT_GT(report.size(), 1000U);
  EXPECT_GT(one.estimator("brittle").failed().size(), 5U) << "the lists must be in it";
  for (const int threads : {2, 4, 0}) {
    campaign.options.threads = threads;
    EXPECT_EQ(files::report(campaign.run(), directory), report) << threads;
  }
  campaign.options.seed = 6;
  EXPECT_NE(files::report(campaign.run(), directory), report) << "another seed must show";
}

TEST(Campaign, EveryRunIsCountedOnce) {
  for (const int blocks : {1, 3, 16, 1003, 5000}) {
    campaign.options = usual;
    campaign.options.blocks = blocks;
    campaign.options.threads = 2;
    const auto result = campaign.run();
    EXPECT_EQ(result.estimator(0).kept(), 1003) << blocks;
    const auto brittle = result.estimator(1);
    EXPECT_EQ(brittle.kept() + static_cast<std::int64_t>(brittle.failed().size()), 1003) << blocks;
  }
}

TEST(Campaign, RunsHaveTheirOwnNumbersWhateverTheirCount) {
  campaign.options = usual;
  const auto late = campaign.replay(1000);
  campaign.options.runs = 2000;
  campaign.options.blocks = 7;
  const auto again = campaign.replay(1000), other = campaign.replay(999);
  ASSERT_TRUE(late.ok()) << late.error;
  EXPECT_EQ(late.flight.y[3], again.flight.y[3]);
  EXPECT_NE(late.flight.y[3], other.flight.y[3]);
}

// Every sum of the campaign, made again from the replays of its runs: bit by bit, with one block.
TEST(Campaign, ReplaysAreWhatTheCampaignSaw) {
  campaign.options = usual;
  campaign.options.runs = 40;
  campaign.options.blocks = 1;
  const auto result = campaign.run();
  double squares = 0, nees = 0, runs = 0;
  for (int run = 0; run < 40; ++run) {
    const auto replay = campaign.replay(run);
    ASSERT_TRUE(replay.ok());
    const auto& row = replay.tracks[0].rows[4];
    const double error = row.x(0) - replay.flight.truth[4](0);
    squares += error * error;
    nees += row.nees;
    ++runs;
    EXPECT_EQ(replay.tracks[0].rows.size(), 6U);
    EXPECT_EQ(row.error(0), error);
  }
  EXPECT_EQ(result.estimator(0).at(4).mse(0).value, squares / runs);
  EXPECT_EQ(result.estimator(0).at(4).nees().value, nees / runs);
}

// Again from the replays, which know nothing of the sums.
TEST(Campaign, DifferencesArePairedFlightByFlight) {
  campaign.options = usual;
  campaign.options.runs = 300;
  const auto result = campaign.run();
  const auto broken = static_cast<std::int64_t>(result.estimator(1).failed().size());
  ASSERT_GT(broken, 0);
  EXPECT_EQ(result.pairs(0, 1), 300 - broken);
  EXPECT_EQ(result.difference(0, 1).value, 0) << "the same filter";
  EXPECT_EQ(result.difference(0, 1).standard_error, 0);

  const auto lazy =
      jml::Estimator{"lazy", [](const auto&) {
                       return jml::Filter{jml::Kalman{}, walk::Walk{},
                                          jml::Estimate{jml::Vector<double, 1>(0.5), walk::Number(0.1)}};
                     }};
  jml::Campaign three{walk::Scenario{}, walk::kalman(), walk::brittle(4.5), lazy};
  three.options = campaign.options;
  const auto all = three.run();
  double sum = 0, squares = 0, count = 0;
  for (int run = 0; run < 300; ++run) {
    const auto replay = three.replay(run);
    if (replay.tracks[1].fault) continue;
    double error[3] = {};
    for (std::size_t j = 1; j < 3; ++j) {
      for (int k = 1; k <= 5; ++k) {
        const double e = replay.tracks[j].rows[static_cast<std::size_t>(k)].x(0) -
                         replay.flight.truth[static_cast<std::size_t>(k)](0);
        error[j] += e * e / 5;
      }
    }
    const double d = std::sqrt(error[2]) - std::sqrt(error[1]);
    sum += d;
    squares += d * d;
    ++count;
  }
  const jml::Figure d = all.difference("lazy", "brittle");
  EXPECT_EQ(all.pairs(2, 1), static_cast<std::int64_t>(count));
  EXPECT_NEAR(d.value, sum / count, 1e-12);
  EXPECT_NEAR(d.standard_error, std::sqrt((squares - sum * sum / count) / (count - 1) / count), 1e-12);
  EXPECT_GT(d.value, 0);
  EXPECT_EQ(all.difference("brittle", "lazy").value, -d.value);
  EXPECT_EQ(all.pairs(0, 2), 300);
  for (const auto& none : {all.difference(0, 0), all.difference(0, 3), all.difference("lazy", "nobody")})
    EXPECT_TRUE(std::isnan(none.value));
}

TEST(Campaign, ProgressTellsTheTruth) {
  using jml::detail::progress_line;
  EXPECT_EQ(progress_line("radar", {0, 0, 1000, 0.2}),
            "radar [....................] 0 %, 0 of 1000 runs, 0 s");
  EXPECT_EQ(progress_line("radar", {400, 0, 1000, 20}),
            "radar [########............] 40 %, 400 of 1000 runs, 20 s, about 30 s left");
  EXPECT_EQ(progress_line("radar", {400, 300, 1000, 20}),
            "radar [########............] 40 %, 400 of 1000 runs (300 taken over), 20 s, about 120 s left");
  EXPECT_EQ(progress_line("radar", {300, 300, 1000, 20}),
            "radar [######..............] 30 %, 300 of 1000 runs (300 taken over), 20 s");
  EXPECT_EQ(progress_line("radar", {999999, 0, 1000000, 100}).substr(0, 33),
            "radar [###################.] 99 %");
  EXPECT_EQ(progress_line("radar", {1000, 0, 1000, 41}),
            "radar [####################] 100 %, 1000 of 1000 runs, 41 s");
}

TEST(Campaign, AFailedRunIsListedAndCanBeReplayed) {
  campaign.options = usual;
  const auto result = campaign.run();
  const auto failed = result.estimator("brittle").failed();
  ASSERT_FALSE(failed.empty());
  EXPECT_TRUE(result.estimator("Kalman").failed().empty());
  for (std::size_t i = 1; i < failed.size(); ++i) EXPECT_LT(failed[i - 1].run, failed[i].run);
  for (const auto& fault : failed) {
    EXPECT_EQ(fault.kind, jml::RunFault::Kind::prediction_refused);
    EXPECT_EQ(fault.status, jml::Status::riccati_escape);
    const auto replay = campaign.replay(fault.run);
    ASSERT_TRUE(replay.tracks[1].fault.has_value());
    EXPECT_EQ(replay.tracks[1].fault->step, fault.step);
    EXPECT_EQ(replay.tracks[1].fault->run, fault.run);
    EXPECT_EQ(replay.tracks[1].rows.size(), static_cast<std::size_t>(fault.step) + 1);
    EXPECT_EQ(replay.tracks[1].rows.back().status, jml::Status::not_converged);
    const auto step = static_cast<std::size_t>(fault.step);
    EXPECT_GT(replay.flight.y[step](0), 4.5) << "the first y above the bound broke it";
    for (std::size_t k = 1; k < step; ++k) EXPECT_LE(replay.flight.y[k](0), 4.5);
    EXPECT_EQ(replay.tracks[0].rows.size(), 6U);
    EXPECT_FALSE(replay.tracks[0].fault.has_value());
  }
}

/// As walk::Scenario, but something goes wrong in run 17, which is known by its first number.
struct Faulty : walk::Scenario {
  enum What { throws, resizes, throws_a_number } what = throws;
  void fly(jml::CounterNoise& noise, jml::Flight<1, 1>& flight) const {
    jml::CounterNoise first(5, 17);
    jml::CounterNoise copy = noise;
    if (first.uniform() == copy.uniform()) {
      if (what == throws) throw std::runtime_error("no more fuel");
      if (what == throws_a_number) throw 1;
      flight.truth.pop_back();
    }
    walk::Scenario::fly(noise, flight);
  }
};
TEST(Campaign, AnExceptionOfTheUserEndsItWithAMessage) {
  jml::Campaign faulty{Faulty{}, walk::kalman()};
  faulty.options = usual;
  faulty.options.threads = 2;
  const auto result = faulty.run();
  EXPECT_FALSE(result.ok());
  EXPECT_STREQ(result.message(), "run 17: no more fuel");
  EXPECT_EQ(result.estimators(), 0);
  EXPECT_EQ(result.estimator(0).kept(), 0);
  EXPECT_FALSE(result.write_csv(directory / "none.csv"));
  EXPECT_EQ(faulty.replay(17).error, "run 17: no more fuel");
  EXPECT_TRUE(faulty.replay(16).ok());

  jml::Campaign number{Faulty{{}, Faulty::throws_a_number}, walk::kalman()};
  number.options = usual;
  EXPECT_STREQ(number.run().message(), "run 17: an exception that is no std::exception");
  EXPECT_FALSE(number.replay(17).ok());
}
TEST(Campaign, AFlightKeepsItsSize) {
  struct Shrinks : walk::Scenario {
    void fly(jml::CounterNoise&, jml::Flight<1, 1>& flight) const { flight.truth.pop_back(); }
  };
  jml::Campaign faulty{Shrinks{}, walk::kalman()};
  faulty.options.threads = 1;  // of several threads any may be the first to find its run spoiled
  EXPECT_STREQ(faulty.run().message(), "run 0: fly() changed the size of the flight");
}

TEST(Campaign, AFilterInSinglePrecisionFits) {
  const auto in_float = [](const auto&) {
    return jml::Filter{jml::Kalman{}, walk::Walk{},
                       jml::Estimate<float, 1>{jml::Vector<float, 1>(0.0F), jml::Matrix<float, 1, 1>(0.5F)}};
  };
  jml::Campaign both{walk::Scenario{}, walk::kalman(), jml::Estimator{"float", in_float, jml::OneStep{}}};
  both.options = usual;
  const auto result = both.run();
  const auto in_double = result.estimator(0).at(5), single = result.estimator(1).at(5);
  EXPECT_NEAR(single.mse(0).value, in_double.mse(0).value, 1e-6);
  EXPECT_NE(single.mse(0).value, in_double.mse(0).value);
  EXPECT_NEAR(single.nees().value, in_double.nees().value, 1e-5);
  EXPECT_NEAR(single.nis().value, in_double.nis().value, 1e-5);
  EXPECT_NEAR(single.cost().value, in_double.nis().value / 2, 1e-5);
}

void expect_refusal(const jml::CampaignOptions& options, const char* words) {
  campaign.options = options;
  const auto result = campaign.run();
  EXPECT_FALSE(result.ok());
  EXPECT_NE(std::string(result.message()).find(words), std::string::npos) << result.message();
}
TEST(Campaign, OptionsWithoutSenseAreRefused) {
  expect_refusal({.runs = 0}, "0 runs");
  expect_refusal({.runs = -5}, "-5 runs");
  expect_refusal({.threads = -1}, "-1 threads");
  expect_refusal({.threads = 100'000}, "100000 threads");
  expect_refusal({.blocks = 0}, "0 blocks");
  expect_refusal({.blocks = 8, .first = 8}, "from block 8 on: the campaign has blocks 0 to 7");
  expect_refusal({.blocks = 8, .first = -1}, "from block -1 on");
  expect_refusal({.blocks = 8, .first = 3, .count = 6}, "6 blocks from block 3 on");
  expect_refusal({.blocks = 8, .count = -2}, "-2 blocks");
  expect_refusal({.journal = "/no/such/place/a.journal"},
                 "/no/such/place/a.journal: No such file or directory");
  expect_refusal({.journal = "/"}, "cannot open the journal /");
  expect_refusal({.journal = "/dev/null"}, "is not a regular file");
  EXPECT_FALSE(campaign.replay(-1).ok());
  campaign.options = usual;
  EXPECT_EQ(campaign.replay(1003).error, "there is no run 1003: the campaign has 1003");
}

template <typename Scenario, typename... E>
std::string refusal(const Scenario& scenario, const E&... estimators) {
  return jml::Campaign{scenario, estimators...}.run().message();
}
TEST(Campaign, ScenariosAndNamesWithoutSenseAreRefused) {
  walk::Scenario scenario;
  EXPECT_EQ(refusal(scenario, walk::kalman(), walk::kalman()), "two estimators are named Kalman");
  auto nameless = walk::kalman();
  nameless.name.clear();
  EXPECT_EQ(refusal(scenario, nameless), "an estimator has no name");
  scenario.steps = 0;
  EXPECT_NE(refusal(scenario, walk::kalman()).find("0 steps"), std::string::npos);
  scenario.steps = 1;
  scenario.dt = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(scenario, walk::kalman()).find("dt"), std::string::npos);
}

TEST(Campaign, AFileThatCannotBeWrittenIsSaid) {
  campaign.options = usual;
  const auto result = campaign.run();
  EXPECT_FALSE(result.write_csv("/no/such/place/a.csv"));
  EXPECT_FALSE(result.write_json("/no/such/place/a.json"));
  EXPECT_FALSE(result.write_timings("/no/such/place/a.json"));
  EXPECT_TRUE(result.write_timings(directory / "times.json"));
}

TEST(Campaign, CsvAndJsonHoldTheFigures) {
  campaign.options = usual;
  const auto result = campaign.run();
  ASSERT_TRUE(result.write_json(directory / "a.json"));
  const auto json = nlohmann::json::parse(files::content(directory / "a.json"));
  EXPECT_EQ(json["estimators"][0]["run_rmse"]["value"].get<double>(), result.estimator(0).run_rmse().value);
  EXPECT_EQ(json["estimators"][1]["failed"].size(), result.estimator(1).failed().size());
  EXPECT_EQ(json["estimators"][1]["failed"][0]["run"], result.estimator(1).failed()[0].run);
  EXPECT_TRUE(json["estimators"][0]["cost"]["value"].is_null());

  ASSERT_TRUE(result.write_csv(directory / "a.csv"));
  std::istringstream csv(files::content(directory / "a.csv"));
  std::string names, line;
  std::getline(csv, names);
  int rows = 0;
  while (std::getline(csv, line)) {
    ++rows;
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), std::count(names.begin(), names.end(), ','));
    std::istringstream fields(line);
    std::string name, step, time, runs, rmse;
    for (auto* field : {&name, &step, &time, &runs, &rmse}) std::getline(fields, *field, ',');
    EXPECT_EQ(std::stod(rmse), result.estimator(name).at(std::stoi(step)).rmse().value) << line;
  }
  EXPECT_EQ(rows, 10) << "two estimators, five samples";
}

}  // namespace
