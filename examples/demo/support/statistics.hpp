// SPDX-License-Identifier: BSD-3-Clause
// What is counted along a run.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

namespace demo {

/// A mean, its root and its standard error, one value at a time. A NaN is counted apart: there was no value.
class Mean {
 public:
  void add(double value) {
    if (std::isnan(value)) {
      ++missing_;
      return;
    }
    sum_ += value;
    squares_ += value * value;
    ++count_;
  }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] int missing() const { return missing_; }
  [[nodiscard]] double sum() const { return count_ > 0 ? sum_ : std::numeric_limits<double>::quiet_NaN(); }
  [[nodiscard]] double value() const { return sum() / count_; }
  [[nodiscard]] double root() const { return std::sqrt(value()); }
  [[nodiscard]] double standard_error() const {
    return std::sqrt(std::max(0.0, squares_ / count_ - value() * value()) / (count_ - 1));
  }

 private:
  double sum_ = 0, squares_ = 0;
  int count_ = 0, missing_ = 0;
};

/// NaN of none. An even number has two in the middle: their mean.
inline double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

/// Median of times, ns. The clock's own 20 to 40 ns are in it.
class Stopwatch {
 public:
  void start() { begin_ = std::chrono::steady_clock::now(); }
  void stop() {
    const std::chrono::duration<double, std::nano> passed = std::chrono::steady_clock::now() - begin_;
    times_.push_back(passed.count());
  }
  [[nodiscard]] double median() {
    if (times_.empty()) return std::numeric_limits<double>::quiet_NaN();
    const auto middle = times_.begin() + static_cast<std::ptrdiff_t>(times_.size() / 2);
    std::nth_element(times_.begin(), middle, times_.end());
    return *middle;
  }

 private:
  std::chrono::steady_clock::time_point begin_;
  std::vector<double> times_;
};

}  // namespace demo
