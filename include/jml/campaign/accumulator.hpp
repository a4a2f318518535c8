// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a campaign adds up (component jml::campaign): sums over runs in one flat array of doubles, so that
/// blocks of runs can be added, stored and sent.
///
/// Sums of e, e², e⁴ give the mean error, its mean square and the standard error of both.
#include <jml/warnings_begin.hpp>
#pragma once

#include <boost/align/aligned_allocator.hpp>
#include <cstdint>
#include <cstring>
#include <jml/bounded/box.hpp>
#include <jml/status.hpp>
#include <string>
#include <vector>

namespace jml {

/// One sample of one estimator in one run.
template <int n>
struct CampaignRow {
  Vector<double, n> x = kernel::zeros<Vector<double, n>>();  ///< the estimate
  Vector<double, n> truth = kernel::zeros<Vector<double, n>>(),
                    error = kernel::zeros<Vector<double, n>>();  ///< x - truth
  double scalar_error = 0;     ///< scenario.error(), or the 2-norm of `error`
  double nees = 0;             ///< NaN where there is none
  double nis = 0;              ///< likewise
  double cost = 0;             ///< likewise
  Box<double, n> box;          ///< of an estimator that has one
  Status status = Status::ok;  ///< of the step (or the first update)
  bool refused = false;        ///< the step was refused and a prediction made in its place
  bool rejected = false;       ///< the measurement was not used: the gate, or a violated bound
};

/// Why a run does not count for an estimator.
struct RunFault {
  /// What went wrong.
  enum class Kind : std::int32_t {
    prediction_refused,  ///< a step was refused, and the prediction in its place too
    not_finite,          ///< the estimate or its error is not a number
    lost,                ///< the scalar error passed the scenario's `lost`
  };
  std::int64_t run = 0;        ///< its number, from 0
  std::int32_t estimator = 0;  ///< its number, from 0
  std::int32_t step = 0;       ///< 0: the update before the first step
  Kind kind = Kind::lost;      ///< why
  Status status = Status::ok;  ///< of the prediction that was refused
  double scalar_error = 0;     ///< at that step
};

/// A few words for a log.
[[nodiscard]] constexpr const char* describe(RunFault::Kind kind) {
  switch (kind) {
    case RunFault::Kind::prediction_refused:
      return "step and prediction refused";
    case RunFault::Kind::not_finite:
      return "estimate or error not finite";
    case RunFault::Kind::lost:
      return "lost";
  }
  return "unknown";
}

namespace detail {

/// Count, sum and sum of squares of a number, as three doubles at `at`.
struct Moments {
  const double* at;
  [[nodiscard]] double count() const { return at[0]; }
  [[nodiscard]] double sum() const { return at[1]; }
  [[nodiscard]] double squares() const { return at[2]; }
};
inline void add_moment(double* at, double number) {
  at[0] += 1;
  at[1] += number;
  at[2] += number * number;
}

/// Which double is which. For each estimator a head, then a group for each sample; then the moments of the
/// paired differences of the run errors.
struct TallyLayout {
  int estimators = 0, states = 0, steps = 0;

  enum Head {
    kept = 0,
    failed = 1,
    lost = 2,
    run_error = 3,
    run_nees = 6,
    run_nis = 9,
    run_cost = 12,
    head = 15
  };
  enum Sample {
    scalar2 = 0,
    scalar4 = 1,
    refused = 2,
    rejected = 3,
    nees = 4,
    nis = 7,
    cost = 10,
    boxes = 13,
    all_inside = 14,
    components = 15
  };
  enum Component { e = 0, e2 = 1, e4 = 2, inside = 3, width = 4, component = 5 };
  enum Time { inside_ns = 0, covariance_ns = 1, flown_steps = 2, times = 3 };

  [[nodiscard]] std::size_t sample_size() const {
    return components + component * static_cast<std::size_t>(states);
  }
  [[nodiscard]] std::size_t estimator_size() const {
    return head + sample_size() * (static_cast<std::size_t>(steps) + 1);
  }
  [[nodiscard]] std::size_t head_of(int estimator) const {
    return estimator_size() * static_cast<std::size_t>(estimator);
  }
  [[nodiscard]] std::size_t sample_of(int estimator, int k) const {
    return head_of(estimator) + head + sample_size() * static_cast<std::size_t>(k);
  }
  /// Count, sum and sum of squares of run error (first) - run error (second), first < second.
  [[nodiscard]] std::size_t pair_of(int first, int second) const {
    const int before = first * (2 * estimators - first - 1) / 2 + second - first - 1;
    return head_of(estimators) + 3 * static_cast<std::size_t>(before);
  }
  [[nodiscard]] std::size_t size() const {
    return head_of(estimators) + 3 * static_cast<std::size_t>(estimators * (estimators - 1) / 2);
  }
  /// Beside the sums: three numbers for each estimator, and the whole time of the block, ns.
  [[nodiscard]] std::size_t time_size() const { return times * static_cast<std::size_t>(estimators) + 1; }
};

/// The sums of one block of runs. On cache lines of its own: each thread writes only its own.
struct BlockRecord {
  int block = -1;
  std::vector<double, boost::alignment::aligned_allocator<double, 64>> sums;
  std::vector<double> times;
  std::vector<RunFault> faults;
  std::string failure;  ///< not empty: an exception, and the sums are not complete

  void start(const TallyLayout& layout, int number) {
    block = number;
    sums.assign((layout.size() + 7) / 8 * 8, 0.0);
    sums.resize(layout.size());
    times.assign(layout.time_size(), 0.0);
    faults.clear();
    failure.clear();
  }
};

/// Adds one kept run's rows first … steps to the sums of its estimator. Returns the run's root mean square
/// scalar error.
template <int n, bool boxed>
double add_run(const TallyLayout& layout, int estimator, int first, const std::vector<CampaignRow<n>>& rows,
               double* sums) {
  using L = TallyLayout;
  double* head = sums + layout.head_of(estimator);
  double* group = sums + layout.sample_of(estimator, first);
  double squares = 0, run_sum[3] = {}, run_count[3] = {};
  for (int k = first; k <= layout.steps; ++k, group += layout.sample_size()) {
    const CampaignRow<n>& row = rows[static_cast<std::size_t>(k)];
    const double square = row.scalar_error * row.scalar_error;
    squares += square;
    group[L::scalar2] += square;
    group[L::scalar4] += square * square;
    group[L::refused] += row.refused;
    group[L::rejected] += row.rejected;
    const double numbers[3] = {row.nees, row.nis, row.cost};
    for (int j = 0; j < 3; ++j) {
      if (!(std::abs(numbers[j]) <= std::numeric_limits<double>::max())) continue;
      add_moment(group + L::nees + 3 * j, numbers[j]);
      run_sum[j] += numbers[j];
      run_count[j] += 1;
    }
    for (int i = 0; i < n; ++i) {
      double* own = group + L::components + L::component * i;
      const double e2 = row.error(i) * row.error(i);
      own[L::e] += row.error(i);
      own[L::e2] += e2;
      own[L::e4] += e2 * e2;
    }
    if constexpr (boxed) {
      bool all = true;
      group[L::boxes] += 1;
      for (int i = 0; i < n; ++i) {
        double* own = group + L::components + L::component * i;
        const bool inside = row.box.lower(i) <= row.truth(i) && row.truth(i) <= row.box.upper(i);
        all &= inside;
        own[L::inside] += inside;
        own[L::width] += row.box.upper(i) - row.box.lower(i);
      }
      group[L::all_inside] += all;
    }
  }
  head[L::kept] += 1;
  const double run_error = std::sqrt(squares / (layout.steps - first + 1));
  add_moment(head + L::run_error, run_error);
  for (int j = 0; j < 3; ++j) {
    if (run_count[j] > 0) add_moment(head + L::run_nees + 3 * j, run_sum[j] / run_count[j]);
  }
  return run_error;
}

/// Adds one run's paired differences. `errors`: of each estimator; NaN where the run does not count for it.
inline void add_differences(const TallyLayout& layout, const double* errors, double* sums) {
  for (int i = 0; i < layout.estimators; ++i) {
    for (int j = i + 1; j < layout.estimators; ++j) {
      const double difference = errors[i] - errors[j];
      if (difference == difference) add_moment(sums + layout.pair_of(i, j), difference);
    }
  }
}

/// Of a run that does not count: only what was refused and rejected before the end.
template <int n>
void add_refusals(const TallyLayout& layout, int estimator, int first, int last,
                  const std::vector<CampaignRow<n>>& rows, double* sums) {
  for (int k = first; k <= last; ++k) {
    double* group = sums + layout.sample_of(estimator, k);
    group[TallyLayout::refused] += rows[static_cast<std::size_t>(k)].refused;
    group[TallyLayout::rejected] += rows[static_cast<std::size_t>(k)].rejected;
  }
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
