// SPDX-License-Identifier: BSD-3-Clause
// Flies one study many times: all estimators that fit it, on the same flights. Tables, and figures on
// request; on threads, or on the ranks of mpirun.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <demo/support/output.hpp>
#include <filesystem>
#include <jml/campaign/campaign_report.hpp>
#include <optional>

#include "study_figure.hpp"
#ifdef JML_CAMPAIGN_MPI
#include <jml/campaign/campaign_mpi.hpp>
#endif

namespace {

namespace fs = std::filesystem;
using study::Study;

constexpr int wrong_input = 2, failed = 1;

struct Request {
  std::string scenario;
  std::int64_t runs = 0, replay = -1;
  std::uint64_t seed = 1;
  int threads = 0;
  fs::path out = ".";
  std::string journal, label;
  int first = 0, count = 0;
  std::vector<std::string> merge;
  bool list = false, pictures = false;
};

/// This process among those that mpirun started.
struct Place {
  int rank = 0, ranks = 1;
  [[nodiscard]] bool speaks() const { return rank == 0; }
};

#ifdef JML_CAMPAIGN_MPI
/// Set by Open MPI, MPICH and everything that speaks PMI or PMIx. Started alone, the program needs no MPI.
bool started_by_mpirun() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMIX_RANK"}) {
    if (std::getenv(name) != nullptr) return true;
  }
  return false;
}
#endif

const Study* find(const std::string& key) {
  for (const Study& one : study::studies()) {
    if (one.key == key) return &one;
  }
  return nullptr;
}

std::string names() {
  std::string out;
  for (const Study& one : study::studies()) out += (out.empty() ? "" : ", ") + one.key;
  return out;
}

void list() {
  for (const Study& one : study::studies()) {
    std::printf("%s\n  %s, %d steps of %g s\n  stresses: %s\n  error: %s%s%s\n  estimators:", one.key.c_str(),
                one.sentence.c_str(), one.steps, one.dt, one.stresses.c_str(), one.error.c_str(),
                one.unit.empty() ? "" : ", ", one.unit.c_str());
    for (std::size_t j = 0; j < one.estimators.size(); ++j)
      std::printf("%s %s", j > 0 ? ";" : "", one.estimators[j].c_str());
    std::printf("\n\n");
  }
}

void print(const Study& one, const jml::CampaignResult& result, const jml::CampaignOptions& options) {
  if (options.first > 0 || options.count > 0)
    std::printf("A part: blocks %d to %d of %d.\n", options.first,
                (options.count > 0 ? options.first + options.count : options.blocks) - 1, options.blocks);
  std::printf("%s: %s.\n%lld runs of %d steps, seed %llu. Error: %s%s%s.\n\n", one.key.c_str(),
              one.sentence.c_str(), static_cast<long long>(options.runs), one.steps,
              static_cast<unsigned long long>(options.seed), one.error.c_str(), one.unit.empty() ? "" : ", ",
              one.unit.c_str());
  demo::Table table(
      {"", "RMSE", "± s.e.", "NEES/n", "cost (11)", "not used", "refused", "failed", "lost", "ns a step"});
  for (int j = 0; j < result.estimators(); ++j) {
    const jml::EstimatorFigures e = result.estimator(j);
    table.add({e.name(), demo::text("%.5g", e.run_rmse().value),
               demo::text("%.1g", e.run_rmse().standard_error),
               demo::text("%.3g", e.nees().value / one.states), demo::text("%.4g", e.cost().value),
               std::to_string(e.rejected()), std::to_string(e.refused()), std::to_string(e.failed().size()),
               std::to_string(e.lost().size()), demo::text("%.0f", e.ns_per_step())});
  }
  table.print();
  if (result.estimators() > 1) {
    const std::string other = result.estimator(0).name();
    std::printf("\nRMSE of a flight minus that of %s on the same flight, and its 95 %% interval:\n\n",
                other.c_str());
    demo::Table pairs({"", "difference", "from", "to", "flights"});
    for (int j = 1; j < result.estimators(); ++j) {
      const jml::Figure d = result.difference(j, 0);
      pairs.add({result.estimator(j).name(), demo::text("%+.3g", d.value), demo::text("%+.3g", d.low),
                 demo::text("%+.3g", d.high), std::to_string(result.pairs(j, 0))});
    }
    pairs.print();
  }
  if (!one.note.empty()) std::printf("\n%s\n", one.note.c_str());
}

int replay(const Study& one, jml::CampaignOptions options, const Request& request) {
  options.runs = std::max(options.runs, request.replay + 1);  // a run's numbers do not depend on how many
  const fs::path file = request.out / (one.key + "_run_" + std::to_string(request.replay) + ".csv");
  std::FILE* out = std::fopen(file.c_str(), "w");
  if (out == nullptr) {
    std::fprintf(stderr, "campaign: cannot write %s\n", file.c_str());
    return failed;
  }
  const std::string error = one.replay(options, request.replay, out);
  if (std::fclose(out) != 0 || !error.empty()) {
    std::fprintf(stderr, "campaign: %s\n", error.empty() ? "the file could not be written" : error.c_str());
    return failed;
  }
  std::printf("run %lld of %s, sample by sample: %s\n", static_cast<long long>(request.replay),
              one.key.c_str(), file.c_str());
  return 0;
}

int fly(const Study& one, const Request& request, const Place& place) {
  const jml::CampaignOptions options{.runs = request.runs > 0 ? request.runs : one.runs,
                                     .seed = request.seed,
                                     .threads = request.threads,
                                     .journal = request.journal,
                                     .version = request.label,
                                     .first = request.first,
                                     .count = request.count,
                                     .parts = request.merge};
  if (request.replay >= 0) return place.speaks() ? replay(one, options, request) : 0;
#ifdef JML_CAMPAIGN_MPI
  const jml::CampaignResult result = place.ranks > 1 ? one.run_on_ranks(options) : one.run(options);
#else
  const jml::CampaignResult result = one.run(options);
#endif
  if (!result.ok()) {
    if (place.speaks()) std::fprintf(stderr, "campaign: %s\n", result.message());
    return failed;
  }
  if (!place.speaks()) return 0;
  if (*result.warning() != '\0') std::fprintf(stderr, "campaign: %s\n", result.warning());
  if (result.blocks_taken_over() > 0)
    std::printf("%lld blocks taken over from journals\n\n",
                static_cast<long long>(result.blocks_taken_over()));
  print(one, result, options);
  const std::string base = (request.out / one.key).string();
  if (!result.write_csv(base + ".csv") || !result.write_json(base + ".json") ||
      !result.write_timings(base + "_timings.json")) {
    std::fprintf(stderr, "campaign: cannot write to %s\n", request.out.c_str());
    return failed;
  }
  std::printf("\n%.1f s, %.0f %% of them inside the estimators. Files: %s.csv, .json, _timings.json",
              result.wall_seconds(), 100 * result.share_inside(), base.c_str());
  const bool drawn = request.pictures && study::draw(one, result, base + ".svg");
  std::printf("%s\n", drawn ? ", .svg" : "");
  return request.pictures && !drawn ? failed : 0;
}

constexpr const char* description =
    "Flies a scenario many times with every estimator of the library that fits it, all on the\n"
    "same flights, and says how good each one is and whether it knows it.\n";
constexpr const char* footer =
    "\nFiles written into DIR:\n"
    "  SCENARIO.csv           every estimator at every sample: RMSE, NEES, NIS, cost, with intervals\n"
    "  SCENARIO.json          whole flights; the failed and lost runs by number\n"
    "  SCENARIO_timings.json  what it cost; the two others are the same bytes for any number of\n"
    "                         threads or ranks\n"
    "  SCENARIO.svg           with --pictures\n"
    "\nExamples:\n"
    "  campaign --list\n"
    "  campaign reentry --runs 1000 --threads 2 --out results --pictures\n"
    "  campaign radar --runs 100000 --journal radar.journal    killed? the same again goes on\n"
    "  campaign radar --replay 17                              run 17 alone, sample by sample\n"
    "  mpirun -n 4 campaign radar --runs 100000 --threads 1\n"
    "  campaign radar --runs 100000 --first 0 --count 64 --journal a     on one machine,\n"
    "  campaign radar --runs 100000 --first 64 --journal b               on another,\n"
    "  campaign radar --runs 100000 --merge a b                          then: the whole, to the bit\n"
    "\nExit code: 0; 1 where the campaign could not be flown or a file not be written; 2 for wrong input.\n";

/// Not empty: what the program ends with.
std::optional<int> parse(int count, char** arguments, const Place& place, Request& request) {
  CLI::App app(description, "campaign");
  app.footer(footer);
  app.add_option("SCENARIO", request.scenario, "one of those that --list shows");
  app.add_flag("--list", request.list, "show all scenarios with their estimators");
  app.add_option("--runs", request.runs, "flights (default: as many as the page \"Which estimator, when\")")
      ->type_name("N")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 53));
  app.add_option("--seed", request.seed, "of all random numbers (default 1)")->type_name("S");
  app.add_option("--threads", request.threads, "of each process (default 0: as many as the machine has)")
      ->type_name("T")
      ->check(CLI::Range(0, 4096));
  app.add_option("--out", request.out, "directory of the files, made where it is not there (default .)")
      ->type_name("DIR");
  app.add_option("--journal", request.journal,
                 "keeps what is finished; with it an interrupted campaign goes on")
      ->type_name("FILE");
  app.add_option("--first", request.first, "fly a part: from this block on (0 to 127; a campaign has 128)")
      ->type_name("BLOCK")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--count", request.count, "of so many blocks (default 0: all that follow); needs --journal")
      ->type_name("BLOCKS")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--merge", request.merge, "journals of parts: what they have is taken over, the rest flown")
      ->type_name("FILE ...");
  app.add_option("--label", request.label, "names your code; a journal with another label is refused")
      ->type_name("TEXT");
  app.add_option("--replay", request.replay, "fly this run alone (from 0) and write all its samples")
      ->type_name("RUN")
      ->check(CLI::Range(std::int64_t{0}, (std::int64_t{1} << 53) - 1));
  app.add_flag("--pictures", request.pictures, "draw RMSE and NEES over time (needs gnuplot)");
  const auto refuse = [&](const std::string& why) {
    if (place.speaks()) std::fprintf(stderr, "campaign: %s\nMore: campaign --help\n", why.c_str());
    return wrong_input;
  };
  try {
    app.parse(count, arguments);
  } catch (const CLI::CallForHelp&) {
    if (place.speaks()) std::printf("%s", app.help().c_str());
    return 0;
  } catch (const CLI::ParseError& e) {
    return refuse(e.what());
  }
  if (request.list) return {};
  if ((request.first > 0 || request.count > 0) && request.journal.empty())
    return refuse("a part needs a --journal, from which it is merged");
  if (request.scenario.empty()) return refuse("no scenario. There are: " + names());
  if (find(request.scenario) == nullptr)
    return refuse("there is no scenario '" + request.scenario + "'. There are: " + names());
  return {};
}

int work(int count, char** arguments, const Place& place) {
  Request request;
  if (const auto code = parse(count, arguments, place, request)) return *code;
  if (request.list) {
    if (place.speaks()) list();
    return 0;
  }
  if (place.speaks()) {
    std::error_code error;
    fs::create_directories(request.out, error);
  }
  // Before hours of flying, not after.
  if (place.speaks() && (!fs::is_directory(request.out) || ::access(request.out.c_str(), W_OK) != 0)) {
    std::fprintf(stderr, "campaign: cannot write to the directory %s\n", request.out.c_str());
    return failed;
  }
  return fly(*find(request.scenario), request, place);
}

}  // namespace

int main(int count, char** arguments) {
  Place place;
#ifdef JML_CAMPAIGN_MPI
  std::optional<jml::MpiSession> session;
  if (started_by_mpirun()) {
    session.emplace(&count, &arguments);
    MPI_Comm_rank(MPI_COMM_WORLD, &place.rank);
    MPI_Comm_size(MPI_COMM_WORLD, &place.ranks);
  }
#endif
  return work(count, arguments, place);
}
