// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Damped Newton for a small square system r(z) = 0.
#include <jml/warnings_begin.hpp>
#pragma once

#include <concepts>
#include <jml/factors.hpp>
#include <jml/status.hpp>

namespace jml {

/// What a bounded solver did.
struct SolverReport {
  bool converged = false;  ///< to its tolerance
  int iterations = 0;      ///< steps made
};

/// Newton steps, halved until the largest scaled residual falls.
///
/// `system.residual(z, r)` and `system.jacobian(z, J)` return false where they are undefined;
/// `system.scaled(r)` is the largest component of r over its scale, `system.unit()` that scale. Ends at
/// `tolerance`, at a step that no longer helps, or after `max_iterations`; z is then the best point found.
template <typename System, typename Scalar, int size>
JML_RARE SolverReport damped_newton(const System& system, Vector<Scalar, size>& z, Scalar tolerance,
                                    int max_iterations) {
  SolverReport report;
  Vector<Scalar, size> r;
  if (!system.residual(z, r)) return report;
  const Vector<Scalar, size> unit = system.unit(), inverse_unit = kernel::inverse_of_entries(unit);
  Scalar best = system.scaled(r);
  Matrix<Scalar, size, size> J;
  kernel::GeneralFactor<Scalar, size> factor;
  for (; report.iterations < max_iterations; ++report.iterations) {
    if (best <= tolerance) break;
    if (!system.jacobian(z, J)) return report;
    J = kernel::scaled_by(inverse_unit, J, unit);  // free of units, as the pivot test asks
    if (!factor.factor(J, kernel::filled<Vector<Scalar, size>>(1))) return report;
    const Vector<Scalar, size> direction =
        kernel::by_entry(unit, factor.solve(kernel::by_entry(inverse_unit, r)));
    bool better = false;
    Scalar damping = 1;
    for (int halvings = 0; halvings < 24 && !better; ++halvings, damping /= Scalar(2)) {
      const Vector<Scalar, size> trial = z - damping * direction;
      Vector<Scalar, size> trial_residual;
      if (!system.residual(trial, trial_residual)) continue;
      const Scalar size_there = system.scaled(trial_residual);
      if (size_there < best) {
        z = trial;
        r = trial_residual;
        best = size_there;
        better = true;
      }
    }
    if (!better) break;
  }
  report.converged = best <= tolerance;
  return report;
}

/// F.minimize(problem, u): from u, a least-squares problem of compile-time size (LevenbergMarquardt's
/// docstring says what that is); F::solver names it in a report. The fallback solver of an iterated rule.
template <typename F, typename Problem, typename Scalar>
concept LeastSquaresSolver =
    requires(const F& f, const Problem& problem, Vector<Scalar, Problem::parameters>& u) {
      { f.minimize(problem, u) } -> std::same_as<SolverReport>;
      { F::solver } -> std::convertible_to<Solver>;
    };

}  // namespace jml
#include <jml/warnings_end.hpp>
