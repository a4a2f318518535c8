// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Is a sensor what its model says? Its innovations over windows of a fixed number of samples.
///
/// Of a filter that is right, and its sensor too, innovations ν are white, normal, of covariance S. So over a
/// window of k measurements of p rows
///   Σ νᵀS⁻¹ν is χ² of k p degrees,
///   Σ ν_i/√S_ii over √k is a standard normal number, for each row i.
/// A bias that the states can explain as well is absorbed by them, as fast as their gain: it is seen while
/// that lasts, or never, where the noise of the dynamics hides it. Each statement is tested at the end of a
/// window (a sum of squares that is already too large, at once), and fails by chance with the probability
/// that was asked for: false alarms have a stated rate.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <cstdint>
#include <jml/filter/report.hpp>
#include <jml/image/parts.hpp>

namespace jml {

/// How a sensor is watched.
struct MonitorOptions {
  int window = 0;              ///< samples; 0: not watched. window·p at most 1000 (χ² underflows above)
  double false_alarms = 1e-3;  ///< probability of each alarm (nis_high, nis_low, biased) in a window, 0 … 1
  int repeats = 0;  ///< measurements in a row, equal to the last bit, that mean "stuck"; 0: not watched. A
                    ///< sensor that rounds to a grid of δ repeats itself with a probability below δ/√(2π)
                    ///< over the standard deviation of its change: choose repeats for its power.

  /// In their range, for a sensor of p rows.
  [[nodiscard]] bool valid(int p) const {
    return window >= 0 && window <= 1000 / p && false_alarms > 0 && false_alarms < 1 &&
           (repeats == 0 || repeats > 1);
  }
};

/// What the innovations of a sensor say.
struct Alarms {
  bool nis_high = false;  ///< larger than S says: outliers, a bias, R or Q too small, a filter that is lost
  bool nis_low = false;   ///< smaller than S says: R or Q too large, or measurements that were smoothed
  bool stuck = false;     ///< the same y again and again
  std::uint64_t biased = 0;  ///< bit i: the mean of row i is not zero

  /// One of them.
  [[nodiscard]] constexpr bool any() const { return nis_high || nis_low || stuck || biased != 0; }
};

/// The innovations of one sensor of p rows, as they come.
template <int p>
class InnovationMonitor {
  static_assert(p <= 64, "jml: a monitor has room for 64 rows");

 public:
  MonitorOptions options;  ///< off at first

  /// Of the last full window, and of the one that runs where it cannot become right again.
  [[nodiscard]] const Alarms& alarms() const { return alarms_; }
  /// Mean NIS per degree of freedom over the last full window: 1 of a filter that is right. NaN before.
  [[nodiscard]] double mean_nis() const { return mean_nis_; }
  void reset() { *this = InnovationMonitor{options}; }  ///< begins anew, with the same options

  InnovationMonitor() = default;
  explicit InnovationMonitor(const MonitorOptions& how) : options(how) {}  ///< how to watch

  /// A measurement and what became of it, accepted or rejected. One without NIS is passed over.
  template <typename Scalar>
  void take(const Vector<Scalar, p>& y, const Report<Scalar, p>& report) {
    look_for_repeats(y);
    if (options.window <= 0 || !options.valid(p)) return;
    const auto nis = static_cast<double>(report.nis());
    if (!std::isfinite(nis) || report.degrees <= 0) return;
    nis_ += nis;
    degrees_ += report.degrees;
    for (int i = 0; i < p; ++i) {
      const auto nu = static_cast<double>(report.innovation(i));
      if (nu == 0) continue;  // a row that was not measured
      sum_(i) += nu / std::sqrt(static_cast<double>(report.innovation_matrix(i, i)));
      rows_(i) += 1;
    }
    ++samples_;
    const int all = degrees_ + (options.window - samples_) * p;
    if (chi_square_upper_tail(nis_, all) < options.false_alarms) alarms_.nis_high = true;
    if (samples_ >= options.window) close_window();
  }

  /// What it has seen, not its options.
  auto each_part(auto&& f) {
    return f(alarms_, mean_nis_, nis_, in_range(degrees_, 0, 1000), in_range(samples_, 0, 1000),
             in_range(equal_, 0, most), any_, sum_, rows_, last_);
  }

 private:
  static constexpr int most = std::numeric_limits<int>::max();
  template <typename Scalar>
  void look_for_repeats(const Vector<Scalar, p>& y) {
    bool same = any_;
    for (int i = 0; i < p; ++i) {
      same = same && static_cast<double>(y(i)) == last_(i);
      last_(i) = static_cast<double>(y(i));
    }
    any_ = true;
    equal_ = same ? equal_ + (equal_ < options.repeats) : 1;
    alarms_.stuck = options.repeats > 1 && equal_ >= options.repeats;
  }
  void close_window() {
    alarms_.nis_high = chi_square_upper_tail(nis_, degrees_) < options.false_alarms;
    alarms_.nis_low = chi_square_upper_tail(nis_, degrees_) > 1 - options.false_alarms;
    mean_nis_ = nis_ / degrees_;
    alarms_.biased = 0;
    for (int i = 0; i < p; ++i) {
      if (rows_(i) == 0) continue;
      const double deviations = std::abs(sum_(i)) / std::sqrt(rows_(i));
      if (std::erfc(deviations / std::sqrt(2.0)) < options.false_alarms / p)
        alarms_.biased |= std::uint64_t(1) << i;
    }
    nis_ = 0;
    degrees_ = samples_ = 0;
    kernel::set_zero(sum_);
    kernel::set_zero(rows_);
  }

  Alarms alarms_{};
  double mean_nis_ = std::numeric_limits<double>::quiet_NaN(), nis_ = 0;
  int degrees_ = 0, samples_ = 0, equal_ = 0;
  bool any_ = false;
  Vector<double, p> sum_ = kernel::zeros<Vector<double, p>>(), rows_ = sum_, last_ = sum_;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
