// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Everything of jml that needs Eigen alone: no heap, no exceptions, no RTTI.
///
/// Beside it, on request: model/discretize.hpp (Van Loan's matrix exponential), sim/noise.hpp (for tests and
/// simulations) and solve/ceres.hpp (component jml::ceres).
#pragma once

#include <jml/batch/criterion.hpp>
#include <jml/filter/filter.hpp>
#include <jml/filter/iterated.hpp>
#include <jml/filter/one_step_cost.hpp>
#include <jml/model/check.hpp>
