// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The whole-interval problem of Batch solved by Ceres (component jml::ceres): for its loss functions and
/// options, and as an independent check. Not heap-free, and tens of times slower than Batch::solve().
///
/// Unknowns are the states of all nodes, one parameter block each; a disturbance is what a step leaves over.
/// Ceres has no constraints, and where G Q Gᵀ or P_0 is singular not every difference is a disturbance. So
/// singular terms are made a little soft, and multipliers take that back over a few rounds (Hold in
/// interval/ceres_terms.hpp): a softness ε leaves a defect of the order of ε after the first round, of ε²
/// after the second. A state-dependent G, Q or R is frozen in a round and taken anew before the next, until
/// it stays.
#include <jml/warnings_begin.hpp>
#pragma once

#include <ceres/solver.h>

#include <jml/interval/batch.hpp>
#include <jml/interval/ceres_interval.hpp>
#include <string>

namespace jml {

/// How Ceres is asked.
struct CeresOptions {
  /// Passed to Ceres in every round. Changed from its own defaults: the trust region begins wide open (1e16,
  /// not 1e4), the tolerances are tight, nothing is printed.
  ::ceres::Solver::Options solver = tight();
  /// A round ends where no entry of the gradient is larger than this part of the largest at the start (where
  /// the start is no trajectory, without what only that adds), or than its rounding. 0:
  /// solver.gradient_tolerance holds, as it is.
  double gradient_tolerance = 1e-12;
  /// Of the measurements, in place of Batch::options.loss; not owned. Batch::P() does not know it.
  ::ceres::LossFunction* loss = nullptr;
  int max_rounds = 50;  ///< of freezing singular terms anew; then not_converged
  /// Of singular terms: a part of the natural variance of each state. At 1e-8 two rounds do; larger takes
  /// more, smaller blurs the gradient.
  double softness = 1e-8;

  /// The defaults above.
  static ::ceres::Solver::Options tight() {
    ::ceres::Solver::Options options;
    options.linear_solver_type = ::ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 200;
    options.initial_trust_region_radius = 1e16;
    options.function_tolerance = 1e-15;
    options.parameter_tolerance = 1e-15;
    options.logging_type = ::ceres::SILENT;
    return options;
  }
  /// Everything is in its range, for Ceres too.
  [[nodiscard]] bool valid() const {
    std::string error;
    return gradient_tolerance >= 0 && max_rounds > 0 && softness > 0 && softness < 1 &&
           solver.IsValid(&error);
  }
};

/// status: ok, or a refusal; not_converged where Ceres says so, or a defect stays. iterations: linear systems
/// solved. cost: Ceres' own. gradient: as of Batch::solve(). step: not known to Ceres, NaN.
struct CeresReport : BatchReport<double> {
  int rounds = 0;  ///< made
  /// How far the answer is from a trajectory of the model: the largest |x⁺ - f(x) - G (w̄ + w)| of a component
  /// over the largest value of that component. At ok below 1e-12.
  double defect = std::numeric_limits<double>::quiet_NaN();
  ::ceres::Solver::Summary last;  ///< of the last round
};

namespace detail {

template <typename Interval>
CeresReport minimise_with_ceres(Interval& interval, const CeresOptions& options) {
  constexpr double trajectory = 1e-12, settled = 1e-10, softest = 1e-14;
  CeresReport report;
  double softness = options.softness, change = 0, before = std::numeric_limits<double>::infinity();
  if ((report.status = interval.freeze(softness, change)) != Status::ok) return report;
  if (!Interval::varies) change = 0;
  ::ceres::Solver::Options solver = options.solver;
  const double steepest = interval.gradient_at_start();
  if (!std::isfinite(steepest)) return report.status = Status::dynamics_not_finite, report;
  report.status = Status::not_converged;
  while (report.rounds < options.max_rounds) {
    ++report.rounds;
    if (options.gradient_tolerance > 0)
      solver.gradient_tolerance =
          std::max(options.gradient_tolerance * steepest, interval.rounding_of_gradient());
    ::ceres::Solve(solver, &interval.problem(), &report.last);
    report.iterations += report.last.num_linear_solves;
    const auto left = interval.take();
    report.cost = report.last.final_cost - left.cost;
    report.defect = left.defect;
    const auto ended = report.last.termination_type;
    if (ended != ::ceres::CONVERGENCE && ended != ::ceres::USER_SUCCESS) break;
    const bool there = left.defect <= trajectory;
    if (there && change <= settled) {
      report.status = Status::ok;
      break;
    }
    // Ceres does not move by less than the rounding of J: what is left has to count more.
    if (!there && change <= settled && left.defect > 1e-3 * before)
      softness = std::max(softness / 100, softest);
    before = left.defect;
    double moved = 0;
    if (const Status status = interval.freeze(softness, moved); status != Status::ok)
      return report.status = status, report;
    if (Interval::varies) change = moved;
  }
  report.gradient = interval.whitened_gradient();
  if (!std::isfinite(report.cost + report.gradient)) report.status = Status::not_converged;
  return report;
}

}  // namespace detail

/// Minimises J of `batch` from where batch.start says, and writes the answer into it: batch.x(k), batch.w(k),
/// batch.P(k). Nothing is thrown or printed. A model that is not finite along the start, where Ceres
/// cannot begin: dynamics_not_finite. A start with an infinite variance: invalid_covariance. Start::several:
/// invalid_option.
template <typename D, typename List>
[[nodiscard]] CeresReport solve_with_ceres(Batch<D, List, double>& batch, const CeresOptions& options = {}) {
  CeresReport report;
  report.status = batch.status();
  if (report.status == Status::ok && !(batch.options.valid() && options.valid()))
    report.status = Status::invalid_option;
  if (report.status != Status::ok) return report;
  auto& store = batch.recording();
  if (store.prior().diffuse) return report.status = Status::invalid_covariance, report;
  if (batch.start == Start::several) return report.status = Status::invalid_option, report;
  if (batch.start != Start::given) detail::start_at(store, batch.start == Start::filter ? 0 : 1);
  try {
    detail::CeresInterval<D, List> interval(store, batch.options.loss, options.loss);
    return detail::minimise_with_ceres(interval, options);
  } catch (...) {
    report.status = Status::not_converged;
    return report;
  }
}

}  // namespace jml
#include <jml/warnings_end.hpp>
