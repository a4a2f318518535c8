// SPDX-License-Identifier: BSD-3-Clause
// The figure of a study: how wrong its estimators are over time, and whether they know it.
#pragma once

#include <algorithm>
#include <cmath>
#include <demo/support/figure.hpp>
#include <filesystem>
#include <jml/analysis/consistency.hpp>

#include "study.hpp"

namespace study {

/// Curves of all estimators over time with their 95 % bands, one panel each for RMSE and NEES.
inline bool draw(const Study& one, const jml::CampaignResult& result, const std::filesystem::path& file) {
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

}  // namespace study
