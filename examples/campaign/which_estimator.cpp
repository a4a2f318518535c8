// SPDX-License-Identifier: BSD-3-Clause
// Which estimator, when: flies all studies and writes the page which_estimator_when.md from what came out.
// No verdict in it is written by hand. Times, which are no two machines' the same, are in timings.md.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdarg>
#include <demo/support/figure.hpp>
#include <demo/support/output.hpp>
#include <jml/campaign/campaign_report.hpp>

#include "judgement.hpp"
#include "study_figure.hpp"

namespace {

using study::Judged, study::Judgement, study::Study;

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string say(const char* format, ...) {
  char buffer[1024];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

/// Value and standard error, rounded where the error is.
std::string with_error(double value, double error) {
  if (!(value == value)) return "-";
  if (!(error > 0)) return say("%.4g", value);
  if (error >= 1000) return say("%.2g ± %.1g", value, error);
  const int digits = std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 9);
  return say("%.*f ± %.*f", digits, value, digits, error);
}
std::string percent(const Judged& e) {
  if (std::abs(e.to_ekf.relative()) >= 1)
    return with_error(e.to_ekf.own / e.to_ekf.ekf, e.to_ekf.relative_error()) + " times the EKF's";
  return (e.to_ekf.relative() > 0 ? "+" : "") +
         with_error(100 * e.to_ekf.relative(), 100 * e.to_ekf.relative_error()) + " %";
}
std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string out;
  for (const auto& part : parts) out += (out.empty() ? "" : between) + part;
  return out;
}
std::string capital(std::string sentence) {
  sentence[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence[0])));
  return sentence;
}
std::string slug(const std::string& name) {
  std::string out;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)))
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!out.empty() && out.back() != '_')
      out += '_';
  }
  return out;
}

std::string table(const Study& one, const Judgement& j) {
  std::string out =
      "| estimator | RMSE" + (one.unit.empty() ? "" : ", " + one.unit) +
      " | against the EKF, same flights | NEES / n | its P | cost (11) | refused steps | failed, "
      "lost runs |\n|---|---|---|---|---|---|---|---|\n";
  for (const Judged& e : j.all) {
    std::string against = "-";
    if (e.name != "EKF" && e.to_ekf.difference.count > 1) {
      against = e.to_ekf.same ? "the same" : percent(e);
      if (!e.to_ekf.same) against += e.to_ekf.better() ? ", better" : e.to_ekf.worse() ? ", worse" : "";
    }
    const double nees = e.nees_ratio(one.states);
    const std::string star = e.no_nees > 0 ? "*" : "";
    out += "| " + e.name + " | " + with_error(e.rmse.value, e.rmse.standard_error) + " | " + against + " | " +
           (nees == nees ? with_error(nees, e.figures.nees().standard_error / one.states) + star : "-") +
           " | " + e.covariance + " | " + demo::text("%.4g", e.figures.cost().value) + " | " +
           say("%lld", static_cast<long long>(e.figures.refused())) + " | " +
           (e.gone() == 0 ? "0" : say("%zu, %zu", e.failed, e.lost)) + " |\n";
  }
  return out;
}

std::string box_table(const Study& one, const Judgement& j) {
  std::string out;
  for (const Judged& e : j.all) {
    if (!(e.contained == e.contained)) continue;
    if (out.empty()) {
      out = "\n| box of | holds the true state in | measurements that contradict it |";
      for (int i = 1; i <= one.states; ++i) out += say(" mean width of x_%d at the end |", i);
      out += "\n|---|---|---|";
      for (int i = 0; i < one.states; ++i) out += "---|";
      out += '\n';
    }
    out += "| " + e.name + " | " + say("%.6g %% of all samples", 100 * e.contained) + " | " +
           say("%lld", static_cast<long long>(e.figures.rejected())) + " |";
    for (int i = 0; i < one.states; ++i) out += say(" %.3g |", e.figures.at(one.steps).width(i));
    out += '\n';
  }
  return out;
}

/// Of a study with a baseline: what the best estimator is worth.
std::string against_nothing(const Study& one, const Judgement& j) {
  const auto found =
      std::find_if(j.all.begin(), j.all.end(), [&one](const Judged& e) { return e.name == one.baseline; });
  if (found == j.all.end()) return {};
  const Judged &best = j.all[j.best], &ekf = j.all[j.ekf];
  const double ratio = best.rmse.value / found->rmse.value, nees = best.nees_ratio(one.states);
  std::string out = ratio < 0.5 && nees < 2 ? "" : "Nothing is good here. ";
  out += say("The answer \"%s\" has an RMSE of %.3g; ", one.baseline.c_str(), found->rmse.value);
  if (ekf.rmse.value > found->rmse.value) out += say("the EKF is worse than that (%.3g). ", ekf.rmse.value);
  out += say("The best, %s, is at %.2f of it, and its errors are %.2g times what its P says. ",
             best.name.c_str(), ratio, std::sqrt(nees));
  return out;
}

std::string verdict(const Study& one, const Judgement& j) {
  const Judged &best = j.all[j.best], &ekf = j.all[j.ekf];
  std::vector<std::string> same, alike, better, worse, gone;
  for (const Judged& e : j.all) {
    if (e.gone() > 0)
      gone.push_back(say("%s %zu of %lld", e.name.c_str(), e.gone(), static_cast<long long>(j.runs)));
    if (e.name == "EKF" || e.name == one.baseline || e.to_ekf.difference.count < 2) continue;
    if (e.to_ekf.same)
      same.push_back(e.name);
    else if (e.to_ekf.better() && e.gone() <= ekf.gone())
      better.push_back(e.name + " (" + percent(e) + ")");
    else if (e.to_ekf.worse() || e.to_ekf.better())
      worse.push_back(e.name + " (" + percent(e) + ")");
    else
      alike.push_back(e.name + " (" + percent(e) + ")");
  }
  std::string out = "**Verdict.** ";
  if (same.size() + 1 == j.all.size()) {
    out += "All are the same to rounding: the EKF is enough. ";
  } else if (better.empty()) {
    out +=
        say("The EKF is enough: nothing is better by more than %g standard errors. ", study::standard_errors);
  } else if (j.ekf_enough()) {
    out += "The EKF is enough: " + joined(better, ", ") + " gain less than 1 %. ";
  } else {
    out += capital(best.name) + " is best, by " +
           with_error(-100 * best.to_ekf.relative(), 100 * best.to_ekf.relative_error()) +
           " % of the EKF's RMSE";
    out += j.ekf_enough_later()
               ? ". It is gained at the start: in the second half of the flight the EKF is as good. "
               : say(", in the second half of the flight by %.0f %%. ", 100 * j.gain_later());
    if (better.size() > 1) out += "Better than the EKF: " + joined(better, ", ") + ". ";
  }
  out += against_nothing(one, j);
  if (!same.empty() && same.size() + 1 < j.all.size())
    out += "The same to rounding: " + joined(same, ", ") + ". ";
  if (!alike.empty()) out += "Not told apart from it: " + joined(alike, ", ") + ". ";
  if (!worse.empty()) out += "Worse: " + joined(worse, ", ") + ". ";
  if (!gone.empty()) out += "Runs failed or lost: " + joined(gone, ", ") + ". ";
  if (ekf.covariance == "both in turn")
    out += "The EKF's P is optimistic at some times and pessimistic at others.";
  else
    out += "The EKF's P is " + ekf.covariance + ".";
  return out;
}

/// Is the EKF enough?
std::string in_a_word(const Study& one, const Judgement& j) {
  if (!j.all[j.best].to_ekf.better()) return j.best == j.ekf ? "yes" : "yes: not told apart";
  if (j.ekf_enough()) return "yes: the gain is below 1 %";
  if (!one.baseline.empty()) return "no, and nothing is good";
  return j.ekf_enough_later() ? "not at the start" : "no";
}

std::string section(const Study& one, const Judgement& j) {
  std::string out = "## " + one.key + "\n\n";
  out += capital(one.sentence) + ". Stresses: " + one.stresses + ". " +
         say("%lld runs of %d steps of %g s; error: ", static_cast<long long>(j.runs), one.steps, one.dt) +
         one.error + ".\n\n" + table(one, j);
  if (std::any_of(j.all.begin(), j.all.end(), [](const Judged& e) { return e.no_nees > 0; }))
    out += "\n\\* over the samples at which the symmetric part of P is positive definite.\n";
  out += box_table(one, j) + "\n" + verdict(one, j) + "\n";
  if (!one.note.empty()) out += "\n" + one.note + "\n";
  return out + "\n";
}

void add(demo::Summary& summary, const Study& one, const Judgement& j) {
  const std::string unit = one.unit.empty() ? "-" : one.unit,
                    squared = one.unit.empty() ? "-" : one.unit + "²";
  summary.add(one.key + "_runs", static_cast<double>(j.runs), "-");
  summary.add(one.key + "_ekf_enough", j.ekf_enough(), "-");
  for (const Judged& e : j.all) {
    const std::string prefix = one.key + "_" + slug(e.name);
    summary.add(prefix + "_rmse", e.rmse.value, unit);
    summary.add(prefix + "_rmse_se", e.rmse.standard_error, unit);
    summary.add(prefix + "_mse", e.mse.value, squared);
    summary.add(prefix + "_mse_se", e.mse.standard_error, squared);
    summary.add(prefix + "_mse_but_one", e.mse_but_one.value, squared);
    summary.add(prefix + "_mse_but_one_se", e.mse_but_one.standard_error, squared);
    summary.add(prefix + "_difference", e.to_ekf.difference.value, unit);
    summary.add(prefix + "_difference_se", e.to_ekf.difference.standard_error, unit);
    summary.add(prefix + "_nees", e.nees_ratio(one.states), "-");
    summary.add(prefix + "_nees_se", e.figures.nees().standard_error / one.states, "-");
    summary.add(prefix + "_consistent", e.covariance == "consistent", "-");
    summary.add(prefix + "_cost", e.figures.cost().value, "-");
    summary.add(prefix + "_refused", static_cast<double>(e.figures.refused()), "-");
    summary.add(prefix + "_rejected", static_cast<double>(e.figures.rejected()), "-");
    summary.add(prefix + "_failed", static_cast<double>(e.failed), "-");
    summary.add(prefix + "_lost", static_cast<double>(e.lost), "-");
    if (e.contained == e.contained) summary.add(prefix + "_contained", e.contained, "-");
  }
}

std::string timing(const Study& one, const jml::CampaignResult& result, const Judgement& j) {
  const double ekf = j.all[j.ekf].figures.ns_per_step();
  std::string out = "## " + one.key +
                    say("\n\n%d states, %.0f %% of the threads' time in the estimators.\n\n", one.states,
                        100 * result.share_inside());
  out += "| estimator | ns a step | EKF steps |\n|---|---|---|\n";
  for (const Judged& e : j.all)
    out += "| " + e.name + say(" | %.0f | %.1f |\n", e.figures.ns_per_step(), e.figures.ns_per_step() / ekf);
  return out + "\n";
}

/// RMSE over the EKF's, paired, of the estimators that most scenarios have: a column of points each.
class Overview {
 public:
  void add(const Study& one, const Judgement& j) {
    std::string name = one.key;
    std::replace(name.begin(), name.end(), '_', ' ');  // gnuplot's sign of an index
    tics_ += (count_ == 0 ? "'" : ", '") + name + say("' %d", count_);
    for (const Judged& e : j.all) {
      for (std::size_t k = 0; k < series_.size(); ++k) {
        if (e.name != series_[k].label || e.to_ekf.difference.count < 2) continue;
        series_[k].x.push_back(count_ + 0.1 * (static_cast<double>(k) - 3));  // beside each other
        series_[k].y.push_back(e.to_ekf.own / e.to_ekf.ekf);
      }
    }
    ++count_;
  }
  void write(const std::filesystem::path& file) const {
    const std::string options =
        "set logscale y\nset yrange [0.6:5]\nset ytics (0.6, 0.8, 1, 1.25, 1.5, 2, 3, 5)\nset xtics rotate "
        "by -35 (" +
        tics_ + say(")\nset xrange [-0.6:%g]", count_ - 0.4);
    std::vector<demo::Series> all{{"EKF", demo::colour::black, {-0.6, count_ - 0.4}, {1, 1}, "lines lw 1.2"}};
    for (const demo::Series& series : series_) {
      if (!series.x.empty()) all.push_back(series);
    }
    demo::Figure{"RMSE against the EKF's, same flights",
                 "scenario",
                 {{"RMSE / RMSE of the EKF (-)", all, options}},
                 1000,
                 640}
        .write(file,
               "Of no source: the scenarios of which_estimator_when.md. Below 1 is better than the EKF. Not "
               "drawn: what is "
               "beyond 5, runs that failed or got lost.");
  }

 private:
  int count_ = 0;
  std::string tics_;
  std::vector<demo::Series> series_{
      {"IEKF", demo::colour::sky, {}, {}, "points pt 7 ps 0.9"},
      {"SDDRE", demo::colour::green, {}, {}, "points pt 5 ps 0.8"},
      {"JML", demo::colour::red, {}, {}, "points pt 9 ps 1"},
      {"iterated JML", demo::colour::purple, {}, {}, "points pt 11 ps 1"},
      {"fixed lag 20", demo::colour::blue, {}, {}, "points pt 13 ps 1.1"},
      {"RNLS, continuous", demo::colour::orange, {}, {}, "points pt 6 ps 0.9"},
      {"bounded noise, guaranteed", demo::colour::grey, {}, {}, "points pt 4 ps 0.9"}};
};

constexpr const char* opening = R"(# Which estimator, when

Written by `demo_which_estimator` from the campaigns it has flown; no figure and no verdict here is typed by hand. In
each scenario all estimators see the same flights (seed 1); `campaign SCENARIO --runs N` flies more of them, and
`campaign --list` describes them. Where nothing else is said the truth is drawn from the model, its start included.

- **RMSE**: mean over the runs of each run's root mean square error, ± its standard error.
- **Against the EKF**: the paired difference of that, in per cent of the EKF's. Better or worse: by more than %g standard
  errors. Some sixty differences are looked at; with 2 standard errors some of them would be chance.
- **NEES / n**: mean normalised estimation error squared over its expected value; 1 is right. **Its P** is consistent where
  the mean over the runs is 1 as far as they can tell, and the NEES at each of ten times of the flight is in its
  chi-square interval (each test at 99.9 %%); optimistic where one is above (errors are larger than P says), pessimistic
  where one is below. The P of JML, iterated JML and RNLS is no covariance: theirs is descriptive.
- **Cost (11)**: the one-step criterion, mean over all steps, each from the filter's own prior; of rules that have one.
- Failed: a step and its prediction were refused, or the estimate was not finite. Lost: the error passed the bound
  of the scenario. Such runs are not in the averages. No gate is used.
- Where the SDC matrices are not about the origin, the name says about what.

Times are in timings.md; they are those of one machine and one evening.

)";

}  // namespace

int main(int argc, char** argv) {
  const auto directory = demo::output_directory(argc, argv, "<output directory>");
  const auto open = [&directory](const char* name) {
    std::FILE* file = std::fopen((directory / name).c_str(), "w");
    if (file == nullptr) {
      std::fprintf(stderr, "cannot write %s\n", (directory / name).c_str());
      std::exit(1);
    }
    return file;
  };
  demo::Summary summary;
  demo::Table overview(
      {"scenario", "runs", "best estimator", "its RMSE", "EKF / best", "is the EKF enough?"});
  std::string sections, times, rows;
  Overview picture;
  for (const Study& one : study::studies()) {
    const jml::CampaignOptions options{.runs = one.runs, .progress = false};
    const jml::CampaignResult result = one.run(options);
    const Judgement j = judge(one, result, one.each_run(options));
    if (!j.error.empty()) {
      std::fprintf(stderr, "%s: %s\n", one.key.c_str(), j.error.c_str());
      return 1;
    }
    sections += section(one, j);
    times += timing(one, result, j);
    add(summary, one, j);
    picture.add(one, j);
    study::draw(one, result, directory / (one.key + ".svg"));
    const Judged& best = j.all[j.best];
    const std::string ratio = j.best == j.ekf
                                  ? "1"
                                  : with_error(best.to_ekf.ekf / best.to_ekf.own,
                                               best.to_ekf.difference.standard_error / best.to_ekf.own);
    const std::string enough = in_a_word(one, j);
    const std::string rmse =
        with_error(best.rmse.value, best.rmse.standard_error) + (one.unit.empty() ? "" : " " + one.unit);
    overview.add({one.key, std::to_string(j.runs), best.name, rmse, ratio, enough});
    rows += "| " + one.key + " | " + best.name + " | " + rmse + " | " + ratio + " | " + enough + " |\n";
  }
  std::FILE* page = open("which_estimator_when.md");
  std::fprintf(page, opening, study::standard_errors);
  std::fprintf(
      page,
      "%s## In one table\n\nBest: the least RMSE of those that lose no more runs than the EKF, whether or "
      "not it can be told apart from the EKF.\n\n"
      "| scenario | best estimator | its RMSE | EKF / best | is the EKF enough? |\n"
      "|---|---|---|---|---|\n%s",
      sections.c_str(), rows.c_str());
  std::FILE* timings = open("timings.md");
  std::fprintf(
      timings,
      "# Time a step\n\nWall clock inside the filters, of this machine and this run; what else it did is "
      "in them, and the filters are compiled without the library's forced inlining, for the sake of build "
      "time: "
      "bench/ has the time of a step.\n\n%s",
      times.c_str());
  if (std::fclose(page) != 0 || std::fclose(timings) != 0) {
    std::fprintf(stderr, "cannot write to %s\n", directory.c_str());
    return 1;
  }
  picture.write(directory / "against_the_ekf.svg");
  summary.write(directory / "summary.csv");
  overview.print();
  std::printf("\nOf each scenario, RMSE and NEES over time: %s/SCENARIO.svg\n", directory.c_str());
  std::printf("\nThe page, with every estimator of every scenario: %s\n",
              (directory / "which_estimator_when.md").c_str());
}
