// SPDX-License-Identifier: BSD-3-Clause
// Flies one study many times: all estimators that fit it, on the same flights. Tables, and figures on
// request; on threads, or on the ranks of mpirun.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <demo/support/figure.hpp>
#include <demo/support/output.hpp>
#include <filesystem>
#include <jml/analysis/consistency.hpp>
#include <jml/campaign/campaign_report.hpp>
#include <optional>

#include "study.hpp"
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
  if (!one.note.empty()) std::printf("\n%s\n", one.note.c_str());
}

/// Curves of all estimators over time with their 95 % bands, one panel each for RMSE and NEES.
bool draw(const Study& one, const jml::CampaignResult& result, const fs::path& file) {
  using namespace demo;
  const char* inks[] = {colour::black,  colour::blue,   colour::red, colour::green,
                        colour::purple, colour::orange, colour::sky, colour::grey};
  const std::string unit = " (" + (one.unit.empty() ? "-" : one.unit) + ")";
  Panel error{one.error + " RMSE" + unit, {}, "set logscale y\nset format y '10^{%T}'\nset key off"};
  Panel nees{"NEES / n (-)", {}, "set logscale y\nset key below vertical maxrows 6 samplen 2 height 1"};
  std::vector<Series> error_lines, nees_lines;
  const auto kept = static_cast<long>(result.estimator(0).kept());
  const jml::ConfidenceInterval chi = jml::chi_square_average_interval(one.states, kept);
  const std::vector<double> ends{one.dt, one.dt * one.steps};
  const double n = one.states;
  if (chi.defined())
    nees.series.push_back(band("consistent (95 %)", colour::grey, ends, {chi.low / n, chi.low / n},
                               {chi.high / n, chi.high / n}));
  for (int j = 0; j < result.estimators(); ++j) {
    const jml::EstimatorFigures e = result.estimator(j);
    std::vector<double> time, rmse, low, high, mean, mean_low, mean_high;
    const int every = one.steps / 400 + 1;
    for (int k = every; k <= one.steps; k += every) {
      const jml::Figure r = e.at(k).rmse(), c = e.at(k).nees();
      time.push_back(k * one.dt);
      rmse.push_back(r.value);
      low.push_back(r.low);
      high.push_back(r.high);
      mean.push_back(c.value / n);
      mean_low.push_back(std::max(c.low, c.value / 10) / n);  // the scale is logarithmic
      mean_high.push_back(c.high / n);
    }
    const char* ink = inks[j % 8];
    const char* style = j < 8 ? "lines lw 1.6" : "lines lw 1.6 dt (6,4)";
    const auto any = [](const std::vector<double>& values) {
      return std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
    };
    if (any(rmse)) {
      error.series.push_back(band("", ink, time, low, high));
      error_lines.push_back({e.name(), ink, time, rmse, style});
    }
    if (any(mean)) nees.series.push_back(band("", ink, time, mean_low, mean_high));
    // This panel has the key of both: a line of one point is named and not seen.
    if (any(mean))
      nees_lines.push_back({e.name(), ink, time, mean, style});
    else if (any(rmse))
      nees_lines.push_back({e.name(), ink, {one.dt}, {1}, style});
  }
  error.series.insert(error.series.end(), error_lines.begin(), error_lines.end());
  nees.series.insert(nees.series.end(), nees_lines.begin(), nees_lines.end());
  std::string title = one.key;
  std::replace(title.begin(), title.end(), '_', ' ');  // gnuplot's sign of an index
  return Figure{
      title + ": " + std::to_string(kept) + " runs, mean and 95 % bands", "time (s)", {error, nees}, 900, 900}
      .write(file, "Of no source. Campaign " + title);
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
                                     .version = request.label};
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
    std::printf("%lld blocks taken over from the journal\n\n",
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
  const bool drawn = request.pictures && draw(one, result, base + ".svg");
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
