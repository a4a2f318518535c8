// SPDX-License-Identifier: BSD-3-Clause
// The journal: a campaign that was killed goes on, a torn or foreign journal is known for what it is.
// CAMPAIGN_PROGRAM is the path of campaign_program.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>
#include <thread>

#include "campaign/files.hpp"
#include "campaign/walk.hpp"

namespace {

const files::Directory directory;

jml::Campaign campaign{walk::Scenario{}, walk::kalman(), walk::brittle(4.5)};

/// Fresh options with a journal; 20 blocks.
const jml::CampaignOptions& keep(const std::string& journal) {
  campaign.options = {
      .runs = 500, .seed = 2, .threads = 2, .journal = journal, .version = "one", .blocks = 20};
  return campaign.options;
}

/// The report of the campaign without a journal.
std::string reference() {
  auto plain = campaign;
  plain.options.journal.clear();
  return files::report(plain.run(), directory);
}

TEST(Journal, AFinishedCampaignIsTakenOverWhole) {
  keep(directory / "whole");
  const auto first = campaign.run();
  ASSERT_TRUE(first.ok()) << first.message();
  EXPECT_EQ(first.blocks_taken_over(), 0);
  EXPECT_STREQ(first.warning(), "");
  const std::string journal = files::content(directory / "whole");
  const auto second = campaign.run();
  EXPECT_EQ(second.blocks_taken_over(), 20);
  EXPECT_EQ(files::report(first, directory), reference());
  EXPECT_EQ(files::report(second, directory), reference());
  EXPECT_EQ(files::content(directory / "whole"), journal) << "nothing to add";
}

// Cut at many places, the header among them: what is whole is taken over, the rest made again.
TEST(Journal, TornAnywhereItGoesOn) {
  keep(directory / "whole");
  ASSERT_TRUE(campaign.run().ok());
  const std::string whole = files::content(directory / "whole"), expected = reference();
  keep(directory / "torn");
  std::int64_t last = 0;
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 37) {
    files::write(directory / "torn", whole.substr(0, size));
    const auto result = campaign.run();
    ASSERT_TRUE(result.ok()) << size << ": " << result.message();
    EXPECT_GE(result.blocks_taken_over(), last);
    EXPECT_LT(result.blocks_taken_over(), 20);
    last = result.blocks_taken_over();
    EXPECT_EQ(files::report(result, directory), expected) << size;
    EXPECT_EQ(campaign.run().blocks_taken_over(), 20) << "the file is whole again";
  }
  EXPECT_EQ(last, 19);
}

TEST(Journal, ADamagedBlockAndAllBehindItAreMadeAgain) {
  keep(directory / "damaged");
  ASSERT_TRUE(campaign.run().ok());
  std::string bytes = files::content(directory / "damaged");
  const std::size_t middle = bytes.size() / 2;
  bytes[middle] = static_cast<char>(bytes[middle] ^ 1);
  files::write(directory / "damaged", bytes);
  const auto result = campaign.run();
  EXPECT_GT(result.blocks_taken_over(), 5);
  EXPECT_LT(result.blocks_taken_over(), 15);
  EXPECT_EQ(files::report(result, directory), reference());
}

void expect_refusal(const std::string& words) {
  const std::string before = files::content(campaign.options.journal);
  const auto result = campaign.run();
  EXPECT_FALSE(result.ok());
  EXPECT_NE(std::string(result.message()).find(words), std::string::npos) << result.message();
  EXPECT_EQ(files::content(campaign.options.journal), before) << "it must not be touched";
}

TEST(Journal, OfAnotherCampaignIsRefusedAndSaysWhy) {
  const std::string path = directory / "foreign";
  keep(path);
  ASSERT_TRUE(campaign.run().ok());
  campaign.options.seed = 3;
  expect_refusal("belongs to another campaign: seed is 2 there and 3 here");
  keep(path);
  campaign.options.version = "two";
  expect_refusal("version is \"one\" there and \"two\" here");
  keep(path);
  campaign.options.runs = 501;
  expect_refusal("runs is 500 there and 501 here");
  keep(path);
  campaign.options.blocks = 10;
  expect_refusal("blocks is 20 there and 10 here");
  jml::Campaign other{walk::Scenario{}, walk::kalman()};
  other.options = keep(path);
  EXPECT_NE(std::string(other.run().message()).find("estimators is"), std::string::npos);
  walk::Scenario longer;
  longer.steps = 6;
  jml::Campaign steps{longer, walk::kalman(), walk::brittle(4.5)};
  steps.options = keep(path);
  EXPECT_NE(std::string(steps.run().message()).find("steps is 5 there and 6 here"), std::string::npos);
  keep(path);
  EXPECT_EQ(campaign.run().blocks_taken_over(), 20) << "and threads do not matter";
}

TEST(Journal, WhatIsNoJournalIsRefused) {
  keep(directory / "text");
  files::write(directory / "text",
               "dear diary, this is no journal of a campaign at all, and long enough to hold one");
  expect_refusal("is not a journal of a campaign");
  files::write(directory / "text", "dear");
  expect_refusal("is not a journal of a campaign");
}

// Three machines fly a share each; merged, the bytes are those of one machine that flew it all.
TEST(Parts, MergedTheyAreTheWholeToTheBit) {
  const std::string names[3] = {directory / "part_a", directory / "part_b", directory / "part_c"};
  const int first[3] = {0, 3, 14};
  std::int64_t runs = 0;
  for (int i = 0; i < 3; ++i) {
    keep(names[i]);
    campaign.options.first = first[i];
    campaign.options.count = i < 2 ? first[i + 1] - first[i] : 0;  // 0: all that follow
    campaign.options.threads = 1 + i % 2;
    const auto part = campaign.run();
    ASSERT_TRUE(part.ok()) << part.message();
    EXPECT_EQ(part.estimator(0).kept(), 25 * (i == 0 ? 3 : i == 1 ? 11 : 6)) << "20 blocks of 25 runs";
    runs += part.estimator(0).kept();
  }
  EXPECT_EQ(runs, 500);
  const std::string before = files::content(names[1]);
  keep(directory / "merged");
  campaign.options.parts = {names[2], names[0], names[1], names[0]};
  const auto merged = campaign.run();
  EXPECT_EQ(merged.blocks_taken_over(), 20);
  EXPECT_EQ(files::report(merged, directory), reference());
  EXPECT_EQ(files::content(names[1]), before);
  keep(directory / "merged");
  EXPECT_EQ(campaign.run().blocks_taken_over(), 20) << "its journal is whole";
  keep("");
  campaign.options.parts = {names[0], names[2]};
  const auto flown = campaign.run();
  EXPECT_EQ(flown.blocks_taken_over(), 9) << "what no part has is flown";
  EXPECT_EQ(files::report(flown, directory), reference());
}

TEST(Parts, OfAnotherCampaignOrWithoutAFileAreRefused) {
  keep(directory / "part_foreign");
  campaign.options.seed = 3;
  campaign.options.count = 2;
  ASSERT_TRUE(campaign.run().ok());
  keep("");
  campaign.options.parts = {directory / "part_foreign"};
  EXPECT_NE(std::string(campaign.run().message()).find("seed is 3 there and 2 here"), std::string::npos);
  campaign.options.parts = {directory / "nowhere"};
  EXPECT_NE(std::string(campaign.run().message()).find("No such file"), std::string::npos);
  files::write(directory / "short", "dear");
  campaign.options.parts = {directory / "short"};
  EXPECT_NE(std::string(campaign.run().message()).find("is not a journal"), std::string::npos);
}

TEST(Journal, OneSessionAtATime) {
  keep(directory / "busy");
  ASSERT_TRUE(campaign.run().ok());
  const int other = open((directory / "busy").c_str(), O_RDWR);
  ASSERT_EQ(flock(other, LOCK_EX), 0);
  expect_refusal("is in use by another process");
  close(other);
  EXPECT_TRUE(campaign.run().ok());
}

/// Starts campaign_program; its process.
pid_t start(const std::string& result, const std::string& journal, const char* milliseconds) {
  const pid_t child = fork();
  if (child == 0) {
    const std::string path = directory / result;
    execl(CAMPAIGN_PROGRAM, CAMPAIGN_PROGRAM, path.c_str(), "400", "2", journal.c_str(), milliseconds,
          nullptr);
    _exit(127);
  }
  return child;
}
int finish(pid_t child) {
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

void expect_resumed_after(int signal, const std::string& name) {
  const std::string journal = directory / name;
  // 10 runs a block, 2 ms a run, 2 threads: 400 ms in all. Killed when some blocks are there.
  const pid_t child = start(name, journal, "2");
  std::uintmax_t size = 0;
  for (int i = 0; i < 3000 && size < 6000; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::error_code none;
    size = std::filesystem::file_size(journal, none);
    if (none) size = 0;
  }
  kill(child, signal);
  const int status = finish(child);
  ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal) << "it ended before it could be killed";
  ASSERT_FALSE(std::filesystem::exists(directory / (name + ".csv")));

  ASSERT_EQ(finish(start(name, journal, "0")), 0);
  ASSERT_EQ(finish(start("undisturbed", directory / ("undisturbed-" + name), "0")), 0);
  EXPECT_GT(files::content(directory / (name + ".csv")).size(), 1000U);
  EXPECT_EQ(files::content(directory / (name + ".csv")), files::content(directory / "undisturbed.csv"));
  EXPECT_EQ(files::content(directory / (name + ".json")), files::content(directory / "undisturbed.json"));
}
TEST(Journal, KilledInTheMiddleItGoesOn) { expect_resumed_after(SIGKILL, "killed"); }
TEST(Journal, InterruptedInTheMiddleItGoesOn) { expect_resumed_after(SIGINT, "interrupted"); }

}  // namespace
