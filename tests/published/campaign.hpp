// SPDX-License-Identifier: BSD-3-Clause
// A mean over independent runs with its standard error, and how a published figure is compared with it.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <jml/jml.hpp>
#include <jml/campaign/noise.hpp>
#include <vector>

#include "figure.hpp"

namespace campaign {

struct Figure {
  double value, standard_error;
};

/// Collects one number a run (Welford's recursion).
class Mean {
 public:
  void add(double number) {
    ++count_;
    const double off = number - mean_;
    mean_ += off / count_;
    squares_ += off * (number - mean_);
  }
  int runs() const { return count_; }
  Figure figure() const { return {mean_, std::sqrt(squares_ / (count_ - 1) / count_)}; }

 private:
  int count_ = 0;
  double mean_ = 0, squares_ = 0;
};

/// One rule's share of a campaign: its filter is made anew for each run.
struct Score {
  const char* name;
  Mean error{};
  int refused = 0, lost = 0;  // steps refused; runs whose error is above the bound of `finish`

  /// A step was refused, so its measurement is dropped: the prediction in its place must be possible.
  void refuse(jml::Status predicted) {
    ++refused;
    EXPECT_EQ(predicted, jml::Status::ok) << name;
  }
  /// With a key: as figures, too.
  void print(const char* unit, const char* key = nullptr) const {
    const Figure f = error.figure();
    std::printf("  %-28s %.5f +- %.5f %s  (%d runs; %d refused steps, %d lost runs)\n", name, f.value,
                f.standard_error, unit, error.runs(), refused, lost);
    if (key == nullptr) return;
    figure::print(key, f.value, *unit != '\0' ? unit : "-");
    figure::print(std::string(key) + "_error", f.standard_error, *unit != '\0' ? unit : "-");
    figure::print(std::string(key) + "_runs", error.runs());
  }
  /// A run ended with this error; a run above `bound` has lost the target and is counted, not averaged.
  void finish(double run_error, double bound) {
    if (run_error < bound)
      error.add(run_error);
    else
      ++lost;
  }
};

/// Within 3 combined standard errors.
inline void expect_agreement(const Score& ours, const Figure& theirs) {
  const Figure f = ours.error.figure();
  EXPECT_LT(std::abs(f.value - theirs.value), 3 * std::hypot(f.standard_error, theirs.standard_error))
      << ours.name << ": " << f.value << " +- " << f.standard_error << ", published " << theirs.value
      << " +- " << theirs.standard_error;
}

}  // namespace campaign
