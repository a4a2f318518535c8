// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Everything of jml that needs Eigen alone: no heap, no exceptions, no RTTI.
///
/// Beside it, on request: model/discretize.hpp (Van Loan's matrix exponential), campaign/noise.hpp (for tests
/// and simulations), continuous/two_point.hpp, continuous/swept.hpp, continuous/swept_lag.hpp; with component
/// jml::ceres solve/ceres.hpp; with component jml::cvode continuous/cvode.hpp and
/// analysis/stability_region.hpp; with component jml::campaign campaign/campaign.hpp and
/// analysis/consistency.hpp, with jml::mpi campaign/campaign_mpi.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/lyapunov.hpp>
#include <jml/analysis/observability.hpp>
#include <jml/bounded/bounded_noise.hpp>
#include <jml/bounded/coloured_input.hpp>
#include <jml/continuous/algebraic.hpp>
#include <jml/continuous/continuous.hpp>
#include <jml/continuous/factored_continuous.hpp>
#include <jml/filter/check_method.hpp>
#include <jml/filter/factored.hpp>
#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass.hpp>
#include <jml/filter/pure.hpp>
#include <jml/filter/save.hpp>
#include <jml/filter/way_out.hpp>
#include <jml/interval/batch.hpp>
#include <jml/interval/bounded.hpp>
#include <jml/interval/bounded_batch.hpp>
#include <jml/interval/criterion.hpp>
#include <jml/interval/excess_cost.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <jml/interval/smoother.hpp>
#include <jml/iterated/factored_iterated.hpp>
#include <jml/iterated/iterated.hpp>
#include <jml/iterated/one_step_cost.hpp>
#include <jml/model/check.hpp>
#include <jml/model/check_in_space.hpp>
#include <jml/model/rotation.hpp>
#include <jml/model/sphere.hpp>
#include <jml/operations/health.hpp>
#include <jml/riccati/davison_maki.hpp>
#include <jml/warnings_end.hpp>
