// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// When, and under which control: the optional second argument of every model function.
#pragma once

#include <jml/argument.hpp>

namespace jml {

/// Passed to the functions of a model that take a second argument.
///
/// time: s; the start of the step for dynamics, the time of the sample for a sensor. dt: s, length of the
/// step. control: input held over the step, `controls` entries in the units of the model.
template <typename Scalar, int controls = 0>
struct StepContext {
  double time = 0;  // always double: a float clock loses 8 ms after a day
  Scalar dt = 0;
  Argument<Scalar, controls> control = kernel::zeros<Vector<Scalar, controls>>();
};

}  // namespace jml
