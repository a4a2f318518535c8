// SPDX-License-Identifier: BSD-3-Clause
// The studies of the campaign program and of the page "Which estimator, when": a scenario and all estimators
// that fit it, without their types.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <jml/campaign/campaign_result.hpp>
#include <string>
#include <vector>

namespace study {

/// One number of every run and estimator, so that estimators can be compared flight by flight.
struct RunErrors {
  std::string error;                      ///< not empty: why there is nothing
  std::vector<std::vector<double>> rmse;  ///< [estimator][run], of the scalar error; NaN: failed or lost
  std::vector<std::int64_t> no_nees;      ///< [estimator] samples of runs that count, without a NEES
  bool has_nees(std::size_t estimator) const { return samples > no_nees[estimator]; }
  std::int64_t samples = 0;  ///< runs times samples of a run
};

struct Study {
  std::string key;         ///< one word, for the command line and file names
  std::string sentence;    ///< what is flown
  std::string stresses;    ///< what it is hard on
  std::string error;       ///< the scalar error whose root mean square is compared
  std::string unit;        ///< of it; empty: none
  std::int64_t runs = 0;   ///< of the page, and the default of the program
  std::string baseline{};  ///< the estimator that does not look at the data, where there is one
  std::string note{};      ///< what a reader of the figures must know
  int states = 0, steps = 0;
  double dt = 0;  ///< s
  std::vector<std::string> estimators{};

  std::function<jml::CampaignResult(const jml::CampaignOptions&)> run{};
#ifdef JML_CAMPAIGN_MPI
  std::function<jml::CampaignResult(const jml::CampaignOptions&)> run_on_ranks{};  ///< on all ranks
#endif
  /// One run again, sample by sample, as CSV. Not empty: why there is no such run.
  std::function<std::string(const jml::CampaignOptions&, std::int64_t run, std::FILE*)> replay{};
  /// Every run alone.
  std::function<RunErrors(const jml::CampaignOptions&)> each_run{};
};

/// All of them, in the order of the page.
const std::vector<Study>& studies();

// One for each file of scenarios.
std::vector<Study> linear();
std::vector<Study> van_der_pol();
std::vector<Study> radar();
std::vector<Study> reentry();
std::vector<Study> bearings_only();
std::vector<Study> growth();
std::vector<Study> bounded();

}  // namespace study
