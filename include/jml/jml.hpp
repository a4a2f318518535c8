// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Everything of jml that needs Eigen alone: no heap, no exceptions, no RTTI.
///
/// Beside it, on request: model/discretize.hpp (Van Loan's matrix exponential), sim/noise.hpp (for tests and
/// simulations); with component jml::ceres solve/ceres.hpp; with component jml::cvode filter/cvode.hpp and
/// analysis/stability_region.hpp; with component jml::campaign sim/campaign.hpp and analysis/consistency.hpp,
/// with jml::mpi sim/campaign_mpi.hpp.
#pragma once

#include <jml/analysis/lyapunov.hpp>
#include <jml/analysis/observability.hpp>
#include <jml/batch/batch.hpp>
#include <jml/batch/criterion.hpp>
#include <jml/batch/excess_cost.hpp>
#include <jml/filter/algebraic.hpp>
#include <jml/filter/bounded_noise.hpp>
#include <jml/filter/continuous.hpp>
#include <jml/filter/filter.hpp>
#include <jml/filter/fixed_lag.hpp>
#include <jml/filter/iterated.hpp>
#include <jml/filter/one_step_cost.hpp>
#include <jml/filter/smoother.hpp>
#include <jml/model/check.hpp>
#include <jml/model/coloured_input.hpp>
#include <jml/riccati/davison_maki.hpp>
