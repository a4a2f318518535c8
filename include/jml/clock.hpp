// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Time that does not drift: a sum of steps, with what rounding took from it kept beside it.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/attributes.hpp>

namespace jml {

/// Seconds since an epoch of the user's choice.
///
/// A million steps of 1 ms from 1e9 s end at 1e9 + 1000 s: a plain sum of doubles is 47 ms late there, and
/// steps of 0.1 µs at 1.7e9 s would not move it at all. Compensated summation (Kahan 1965).
class Clock {
 public:
  Clock() = default;
  explicit Clock(double time) : time_(time) {}  ///< s

  /// s; the double next to the sum.
  [[nodiscard]] double time() const { return time_; }

  /// dt: s, zero or positive, finite.
  JML_INLINE void advance(double dt) {
    const double step = dt - excess_;
    const double sum = time_ + step;
    excess_ = (sum - time_) - step;
    time_ = sum;
  }

  /// The step that leads from here to `time`, s; negative where that has passed.
  [[nodiscard]] double until(double time) const { return (time - time_) + excess_; }

  auto each_part(auto&& f) { return f(time_, excess_); }  ///< for saving, image/parts.hpp

 private:
  double time_ = 0, excess_ = 0;  // the sum is time_ - excess_
};

}  // namespace jml
#include <jml/warnings_end.hpp>
