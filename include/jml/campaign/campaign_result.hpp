// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a campaign found (component jml::campaign): figures with their standard errors, read from its sums.
#include <jml/warnings_begin.hpp>
#pragma once

#include <boost/math/distributions/students_t.hpp>
#include <jml/campaign/accumulator.hpp>
#include <jml/campaign/options.hpp>
#include <memory>

namespace jml {

/// A number from the runs. NaN where there are too few of them.
struct Figure {
  double value = std::numeric_limits<double>::quiet_NaN();  ///< NaN: none
  /// Of the value; NaN with fewer than two runs.
  double standard_error = std::numeric_limits<double>::quiet_NaN();
  double low = std::numeric_limits<double>::quiet_NaN();   ///< 95 % confidence interval
  double high = std::numeric_limits<double>::quiet_NaN();  ///< of the 95 % confidence interval
};

namespace detail {

/// The value that Student's t with count - 1 degrees of freedom passes on either side with probability 5 %.
inline double student_95(double count) {
  thread_local double last_count = 0, last_value = 0;
  if (count != last_count) {
    last_value = boost::math::quantile(boost::math::students_t(count - 1), 0.975);
    last_count = count;
  }
  return last_value;
}

/// Mean, from the sum and the sum of squares of `count` independent numbers.
inline Figure mean_figure(double count, double sum, double squares) {
  Figure out;
  if (!(count > 0)) return out;
  out.value = sum / count;
  if (!(count > 1)) return out;
  out.standard_error = std::sqrt(std::max(0.0, squares / count - out.value * out.value) / (count - 1));
  const double half = student_95(count) * out.standard_error;
  out.low = out.value - half;
  out.high = out.value + half;
  return out;
}
inline Figure mean_figure(const Moments& m) { return mean_figure(m.count(), m.sum(), m.squares()); }

/// Mean of a number that is never negative: the interval is that of its logarithm, to first order.
inline Figure positive_figure(double count, double sum, double squares) {
  Figure out = mean_figure(count, sum, squares);
  if (count > 1 && out.value > 0) {
    const double half = student_95(count) * out.standard_error / out.value;
    out.low = out.value * std::exp(-half);
    out.high = out.value * std::exp(half);
  }
  return out;
}

/// The root of such a mean.
inline Figure root_figure(const Figure& square) {
  Figure out;
  out.value = std::sqrt(square.value);
  out.standard_error = square.value > 0 ? square.standard_error / (2 * out.value) : square.standard_error;
  out.low = std::sqrt(square.low);
  out.high = std::sqrt(square.high);
  return out;
}

/// All that a result is read from.
struct CampaignData {
  CampaignOptions options;
  std::string scenario;
  std::vector<std::string> estimators;
  TallyLayout layout;
  double dt = 0;
  bool measured_at_start = false;
  std::vector<double> sums, times;
  std::vector<RunFault> faults;  // in the order of the runs
  // Of this session:
  double wall_seconds = 0;
  int threads = 0, ranks = 1;
  std::int64_t blocks_taken_over = 0;
};

}  // namespace detail

/// One estimator at one sample, over the runs that count. Components i from 0.
class SampleFigures {
 public:
  SampleFigures() = default;
  /// By EstimatorFigures::at().
  SampleFigures(const double* group, double kept, int states) : group_(group), kept_(kept), states_(states) {}

  [[nodiscard]] std::int64_t kept() const { return static_cast<std::int64_t>(kept_); }  ///< runs
  /// Mean of x̂_i - x_i.
  [[nodiscard]] Figure mean_error(int i) const {
    return detail::mean_figure(kept_, component(i, L::e), component(i, L::e2));
  }
  /// Mean of its square; 95 % interval on the scale of logarithms.
  [[nodiscard]] Figure mse(int i) const {
    return detail::positive_figure(kept_, component(i, L::e2), component(i, L::e4));
  }
  [[nodiscard]] Figure rmse(int i) const { return detail::root_figure(mse(i)); }  ///< root of mse(i)
  /// Root mean square of the scalar error.
  [[nodiscard]] Figure rmse() const {
    return detail::root_figure(detail::positive_figure(kept_, get(L::scalar2), get(L::scalar4)));
  }
  /// Over the runs; NaN of an estimator without P.
  [[nodiscard]] Figure nees() const { return moments(L::nees); }
  [[nodiscard]] Figure nis() const { return moments(L::nis); }    ///< over the runs; NaN of one without nis()
  [[nodiscard]] Figure cost() const { return moments(L::cost); }  ///< as the Estimator says; NaN without one
  /// Steps refused, and measurements not used (gate, violated bound), over all runs that got here.
  [[nodiscard]] std::int64_t refused() const { return count(L::refused); }
  [[nodiscard]] std::int64_t rejected() const { return count(L::rejected); }  ///< see refused()
  /// Share of the runs whose box holds the true component i, and mean width of the box there.
  [[nodiscard]] double contained(int i) const { return component(i, L::inside) / get(L::boxes); }
  /// See contained().
  [[nodiscard]] double width(int i) const { return component(i, L::width) / get(L::boxes); }
  /// Share of the runs whose box holds the whole true state.
  [[nodiscard]] double contained() const { return get(L::all_inside) / get(L::boxes); }

 private:
  using L = detail::TallyLayout;
  [[nodiscard]] double get(int slot) const {
    return group_ ? group_[slot] : std::numeric_limits<double>::quiet_NaN();
  }
  [[nodiscard]] double component(int i, int slot) const {
    return i >= 0 && i < states_ ? get(L::components + L::component * i + slot)
                                 : std::numeric_limits<double>::quiet_NaN();
  }
  [[nodiscard]] std::int64_t count(int slot) const {
    return group_ ? static_cast<std::int64_t>(group_[slot]) : 0;
  }
  [[nodiscard]] Figure moments(int slot) const {
    return group_ ? detail::mean_figure(detail::Moments{group_ + slot}) : Figure{};
  }

  const double* group_ = nullptr;
  double kept_ = 0;
  int states_ = 0;
};

/// One estimator over the whole campaign.
class EstimatorFigures {
 public:
  EstimatorFigures() = default;
  /// By CampaignResult::estimator().
  EstimatorFigures(std::shared_ptr<const detail::CampaignData> data, int index)
      : data_(std::move(data)), index_(index) {}

  /// Empty where there is no such estimator.
  [[nodiscard]] std::string name() const {
    return data_ ? data_->estimators[static_cast<std::size_t>(index_)] : std::string();
  }
  /// Sample k: 0 … steps; without figures at 0 unless the scenario is measured at the start.
  [[nodiscard]] SampleFigures at(int k) const {
    if (!data_ || k < (data_->measured_at_start ? 0 : 1) || k > data_->layout.steps) return {};
    return {data_->sums.data() + data_->layout.sample_of(index_, k), head(L::kept), data_->layout.states};
  }
  /// Mean over the runs of each run's root mean square scalar error: what published tables give.
  [[nodiscard]] Figure run_rmse() const { return moments(L::run_error); }
  /// Means over the runs of each run's mean.
  [[nodiscard]] Figure nees() const { return moments(L::run_nees); }
  [[nodiscard]] Figure nis() const { return moments(L::run_nis); }    ///< see nees()
  [[nodiscard]] Figure cost() const { return moments(L::run_cost); }  ///< see nees()
  /// Runs that count.
  [[nodiscard]] std::int64_t kept() const { return static_cast<std::int64_t>(head(L::kept)); }
  /// Runs that do not count, in order, with the step and the reason; replay them with campaign.replay(run).
  [[nodiscard]] std::vector<RunFault> failed() const { return faults(false); }
  [[nodiscard]] std::vector<RunFault> lost() const { return faults(true); }  ///< see failed()
  /// Over all runs and samples.
  [[nodiscard]] std::int64_t refused() const { return total(L::refused); }
  [[nodiscard]] std::int64_t rejected() const { return total(L::rejected); }  ///< see refused()
  /// Time in the filter for each step, ns; not part of what is reproducible.
  [[nodiscard]] double ns_per_step() const {
    if (!data_) return std::numeric_limits<double>::quiet_NaN();
    const double* times = data_->times.data() + L::times * index_;
    return times[L::inside_ns] / times[L::flown_steps];
  }

 private:
  using L = detail::TallyLayout;
  [[nodiscard]] double head(int slot) const {
    return data_ ? data_->sums[data_->layout.head_of(index_) + static_cast<std::size_t>(slot)] : 0;
  }
  [[nodiscard]] Figure moments(int slot) const {
    if (!data_) return {};
    return detail::mean_figure(detail::Moments{data_->sums.data() + data_->layout.head_of(index_) + slot});
  }
  [[nodiscard]] std::int64_t total(int slot) const {
    double sum = 0;
    for (int k = 0; data_ && k <= data_->layout.steps; ++k)
      sum += data_->sums[data_->layout.sample_of(index_, k) + static_cast<std::size_t>(slot)];
    return static_cast<std::int64_t>(sum);
  }
  [[nodiscard]] std::vector<RunFault> faults(bool lost) const {
    std::vector<RunFault> out;
    if (!data_) return out;
    for (const RunFault& fault : data_->faults) {
      if (fault.estimator == index_ && (fault.kind == RunFault::Kind::lost) == lost) out.push_back(fault);
    }
    return out;
  }

  std::shared_ptr<const detail::CampaignData> data_;
  int index_ = 0;
};

/// What run() answers. Where it is not ok(), message() says why and there are no figures.
class CampaignResult {
 public:
  explicit CampaignResult(std::string message) : message_(std::move(message)) {}  ///< a refusal
  /// Figures.
  CampaignResult(std::shared_ptr<const detail::CampaignData> data, std::string warning, bool writes = true)
      : data_(std::move(data)), warning_(std::move(warning)), writes_(writes) {}

  [[nodiscard]] bool ok() const { return data_ != nullptr; }  ///< there are figures
  /// Why there are none.
  [[nodiscard]] const char* message() const { return ok() ? "ok" : message_.c_str(); }
  /// Not empty where the figures are right, but the journal could not be kept to the end.
  [[nodiscard]] const char* warning() const { return warning_.c_str(); }
  [[nodiscard]] int estimators() const { return ok() ? data_->layout.estimators : 0; }  ///< how many
  /// By number, from 0, or by name. Without figures where there is no such estimator.
  [[nodiscard]] EstimatorFigures estimator(int index) const {
    return index >= 0 && index < estimators() ? EstimatorFigures(data_, index) : EstimatorFigures();
  }
  /// The same, by name.
  [[nodiscard]] EstimatorFigures estimator(const std::string& name) const {
    return estimator(index_of(name));
  }
  /// Mean over the runs of the run error (see EstimatorFigures::run_rmse()) of one estimator minus that of
  /// another on the same flight, over the runs that count for both. Paired: its standard error has nothing of
  /// what the flights have in common. Without figures where there is no such estimator.
  [[nodiscard]] Figure difference(int estimator, int other) const {
    if (estimator == other || std::min(estimator, other) < 0 || std::max(estimator, other) >= estimators())
      return {};
    const auto at = data_->layout.pair_of(std::min(estimator, other), std::max(estimator, other));
    const detail::Moments m{data_->sums.data() + at};
    return detail::mean_figure(m.count(), estimator < other ? m.sum() : -m.sum(), m.squares());
  }
  /// The same by name.
  [[nodiscard]] Figure difference(const std::string& estimator, const std::string& other) const {
    return difference(index_of(estimator), index_of(other));
  }
  /// Runs that count for both.
  [[nodiscard]] std::int64_t pairs(int estimator, int other) const {
    if (estimator == other || std::min(estimator, other) < 0 || std::max(estimator, other) >= estimators())
      return 0;
    const auto at = data_->layout.pair_of(std::min(estimator, other), std::max(estimator, other));
    return static_cast<std::int64_t>(data_->sums[at]);
  }
  /// Blocks that a journal of an earlier session, or of a part, gave.
  [[nodiscard]] std::int64_t blocks_taken_over() const { return ok() ? data_->blocks_taken_over : 0; }
  /// Share of the working threads' time that was spent inside the estimators.
  [[nodiscard]] double share_inside() const;
  [[nodiscard]] double wall_seconds() const { return ok() ? data_->wall_seconds : 0; }  ///< s, of run()

  /// The table of all samples, one row for each estimator and sample. The same bytes for any number of
  /// threads and ranks. False where the file cannot be written. On ranks other than 0 nothing is written.
  bool write_csv(const std::string& path) const;
  /// The summary: identity, figures over the whole campaign, failed and lost runs. The same bytes, likewise.
  bool write_json(const std::string& path) const;
  /// What it cost: ns a step for each estimator, share inside the estimators, wall clock.
  bool write_timings(const std::string& path) const;

 private:
  [[nodiscard]] int index_of(const std::string& name) const {
    for (int i = 0; i < estimators(); ++i) {
      if (data_->estimators[static_cast<std::size_t>(i)] == name) return i;
    }
    return -1;
  }

  std::shared_ptr<const detail::CampaignData> data_;
  std::string message_, warning_;
  bool writes_ = true;
};

inline double CampaignResult::share_inside() const {
  if (!ok()) return std::numeric_limits<double>::quiet_NaN();
  using L = detail::TallyLayout;
  double inside = 0;
  for (int j = 0; j < data_->layout.estimators; ++j) {
    const double* times = data_->times.data() + L::times * j;
    inside += times[L::inside_ns] + times[L::covariance_ns];
  }
  return inside / data_->times.back();
}

}  // namespace jml
#include <jml/warnings_end.hpp>
