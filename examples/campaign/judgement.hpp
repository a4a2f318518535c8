// SPDX-License-Identifier: BSD-3-Clause
// What the numbers of a study say: which estimators differ from the EKF, flight by flight, and whose
// covariance can be believed.
#pragma once

#include <algorithm>
#include <cmath>
#include <jml/analysis/consistency.hpp>

#include "study.hpp"

namespace study {

/// Differences of more than this many standard errors count. Some sixty are looked at: at 2 a few of them
/// would be chance.
inline constexpr double standard_errors = 3;
/// Below this nobody will see a difference.
inline constexpr double worth_it = 0.01;

struct Mean {
  double value = std::nan(""), standard_error = std::nan("");
  long count = 0;
};

/// Of those that are numbers.
inline Mean mean_of(const std::vector<double>& numbers) {
  Mean out;
  double sum = 0, squares = 0;
  for (const double x : numbers) {
    if (!(x == x)) continue;
    sum += x;
    ++out.count;
  }
  const auto count = static_cast<double>(out.count);
  if (out.count > 0) out.value = sum / count;
  for (const double x : numbers) {
    if (x == x) squares += (x - out.value) * (x - out.value);
  }
  if (out.count > 1) out.standard_error = std::sqrt(squares / (count - 1) / count);
  return out;
}

/// RMSE minus that of the EKF on the same flights, over the runs that count for both.
struct Paired {
  Mean difference;
  double ekf = std::nan(""), own = std::nan("");  ///< mean RMSE over these runs
  bool same = false;                              ///< to rounding, in every run
  [[nodiscard]] double relative() const { return difference.value / ekf; }
  [[nodiscard]] double relative_error() const { return difference.standard_error / ekf; }
  [[nodiscard]] bool better() const {
    return difference.value < -standard_errors * difference.standard_error;
  }
  [[nodiscard]] bool worse() const { return difference.value > standard_errors * difference.standard_error; }
};

inline Paired compare(const std::vector<double>& own, const std::vector<double>& ekf) {
  std::vector<double> differences(own.size()), both_own(own.size()), both_ekf(own.size());
  double largest = 0;
  for (std::size_t run = 0; run < own.size(); ++run) {
    differences[run] = own[run] - ekf[run];
    both_own[run] = ekf[run] == ekf[run] ? own[run] : std::nan("");
    both_ekf[run] = own[run] == own[run] ? ekf[run] : std::nan("");
    if (differences[run] == differences[run])
      largest = std::max(largest, std::abs(differences[run]) / ekf[run]);
  }
  Paired out{mean_of(differences), mean_of(both_ekf).value, mean_of(both_own).value};
  out.same = out.difference.count > 0 && largest < 1e-9;
  return out;
}

/// The mean of NEES over the runs, by Student's t, and NEES at ten times of the flight, each an average over
/// independent runs, by chi-square. Many filters are looked at, so a right one passes each of the two with
/// 99.9 %.
inline std::string consistency(const jml::EstimatorFigures& e, int states, int steps) {
  constexpr int times = 10;
  constexpr double passes = 0.999;
  const auto kept = static_cast<long>(e.kept());
  const jml::ConfidenceInterval mean =
      jml::mean_interval(e.nees().value, e.nees().standard_error, kept, passes);
  const jml::ConfidenceInterval range =
      jml::chi_square_average_interval(states, kept, 1 - (1 - passes) / times);
  if (!mean.defined() || !range.defined()) return "-";
  bool above = mean.low > states, below = mean.high < states;
  for (int i = 1; i <= times; ++i) {
    const double nees = e.at(steps * i / times).nees().value;
    if (!(nees == nees)) return "-";
    above |= nees > range.high;
    below |= nees < range.low;
  }
  return above && below ? "both in turn" : above ? "optimistic" : below ? "pessimistic" : "consistent";
}

struct Judged {
  std::string name;
  jml::EstimatorFigures figures;
  Mean rmse{}, mse{};  ///< means over the runs of each run's RMSE and its square
  Mean mse_but_one{};  ///< of the squares without the largest: a single run can be most of the mean
  Paired to_ekf{};
  std::string covariance{};  ///< of consistency()
  std::int64_t no_nees = 0;  ///< samples at which sym(P) is not positive definite
  std::size_t failed = 0, lost = 0;
  double contained = std::nan("");  ///< share of samples whose box holds the truth; NaN: no box

  double settled = std::nan("");  ///< RMSE over the second half of the flight, all runs

  [[nodiscard]] std::size_t gone() const { return failed + lost; }
  [[nodiscard]] double nees_ratio(int states) const { return figures.nees().value / states; }
};

struct Judgement {
  std::string error;  ///< not empty: why there is none
  std::int64_t runs = 0;
  std::vector<Judged> all;
  std::size_t ekf = 0,
              best = 0;  ///< best: least mean paired difference of those that lose no more runs than the EKF
  /// What the best gains on the EKF in the second half of the flight.
  [[nodiscard]] double gain_later() const { return 1 - all[best].settled / all[ekf].settled; }
  [[nodiscard]] bool ekf_enough_later() const { return gain_later() < worth_it; }
  [[nodiscard]] bool ekf_enough() const {
    return !all[best].to_ekf.better() || -all[best].to_ekf.relative() < worth_it;
  }
};

inline Judgement judge(const Study& one, const jml::CampaignResult& result, const RunErrors& runs) {
  Judgement out;
  if (!result.ok()) out.error = result.message();
  if (!runs.error.empty()) out.error = runs.error;
  const auto found = std::find(one.estimators.begin(), one.estimators.end(), "EKF");
  if (found == one.estimators.end()) out.error = "there is no EKF to compare with";
  if (!out.error.empty()) return out;
  out.runs = static_cast<std::int64_t>(runs.rmse.front().size());
  out.ekf = static_cast<std::size_t>(found - one.estimators.begin());
  out.best = out.ekf;
  for (std::size_t j = 0; j < one.estimators.size(); ++j) {
    Judged e{one.estimators[j], result.estimator(static_cast<int>(j))};
    e.rmse = mean_of(runs.rmse[j]);
    std::vector<double> squares;
    for (const double x : runs.rmse[j]) squares.push_back(x * x);
    e.mse = mean_of(squares);
    // NaN are below everything here.
    const auto largest = std::max_element(squares.begin(), squares.end(), [](double a, double b) {
      return a < b || (std::isnan(a) && !std::isnan(b));
    });
    *largest = std::nan("");
    e.mse_but_one = mean_of(squares);
    e.to_ekf = compare(runs.rmse[j], runs.rmse[out.ekf]);
    e.covariance = consistency(e.figures, one.states, one.steps);
    e.no_nees = runs.has_nees(j) ? runs.no_nees[j] : 0;
    double squared = 0;
    for (int k = one.steps / 2 + 1; k <= one.steps; ++k) {
      const double error = e.figures.at(k).rmse().value;
      squared += error * error;
    }
    e.settled = std::sqrt(squared / (one.steps - one.steps / 2));
    e.failed = e.figures.failed().size();
    e.lost = e.figures.lost().size();
    if (e.figures.at(one.steps).contained() >= 0) {
      double sum = 0;
      for (int k = 1; k <= one.steps; ++k) sum += e.figures.at(k).contained();
      e.contained = sum / one.steps;
    }
    // The campaign and its flights one by one must agree: both have seen the same runs.
    const double of_campaign = e.figures.run_rmse().value;
    if (e.rmse.count > 0 && !(std::abs(e.rmse.value - of_campaign) <= 1e-9 * of_campaign))
      out.error = e.name + ": the campaign and its flights one by one do not agree";
    out.all.push_back(std::move(e));
  }
  for (std::size_t j = 0; j < out.all.size(); ++j) {
    const Judged& e = out.all[j];
    if (e.gone() <= out.all[out.ekf].gone() && e.name != one.baseline && !e.to_ekf.same &&
        e.to_ekf.difference.value < out.all[out.best].to_ekf.difference.value)
      out.best = j;
  }
  return out;
}

}  // namespace study
