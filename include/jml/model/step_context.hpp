// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// When, and under which control: the optional second argument of every model function.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/argument.hpp>
#include <jml/status.hpp>

namespace jml {

/// Passed to the functions of a model that take a second argument.
///
/// time: s; the start of the step for dynamics, the time of the sample for a sensor. dt: s, length of the
/// step. control: input held over the step, `controls` entries in the units of the model.
template <typename Scalar, int controls = 0>
struct StepContext {
  /// s, at the beginning of the step; double for every Scalar, as a float clock loses 8 ms after a day.
  double time = 0;  // always double: a float clock loses 8 ms after a day
  Scalar dt = 0;    ///< s, ≥ 0
  Argument<Scalar, controls> control = kernel::zeros<Vector<Scalar, controls>>();  ///< u, held over the step
};

/// The context of the measurement at the end of a step.
template <typename Scalar, int controls>
[[nodiscard]] JML_INLINE inline StepContext<Scalar, controls> end_of(StepContext<Scalar, controls> at) {
  at.time += static_cast<double>(at.dt);
  return at;
}

/// invalid_time_step where dt is negative or not finite, or the time of the step's end is not;
/// invalid_control.
template <typename Scalar, int controls>
[[nodiscard]] JML_INLINE inline Status check_context(const StepContext<Scalar, controls>& at) {
  if (!(at.dt >= Scalar(0)) || !std::isfinite(at.time + static_cast<double>(at.dt)))
    return Status::invalid_time_step;
  if constexpr (controls > 0) {
    if (!all_finite(at.control)) return Status::invalid_control;
  }
  return Status::ok;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
