// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Levenberg-Marquardt for a small least-squares problem of compile-time size, without heap.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/factors.hpp>
#include <jml/solve/newton.hpp>
#include <jml/status.hpp>

namespace jml {

/// Minimises ½|r(u)|². `problem.evaluate(u, r, J)` returns false where r is undefined (J may be null);
/// Problem::parameters and Problem::residuals are its sizes. Damping after Nielsen (1999): the gain ratio
/// decides. It is of each parameter by its own column of J, or, where Problem::whitened says that all of them
/// have one unit, the same of all: a valley across the axes is then gone along in long steps.
///
/// A step that leads up, as r bends, is bent after it: with the same J to where r is what J had promised.
/// Where Problem::curved says that there is one, `problem.add_curvature(u, H)` adds to JᵀJ what it lacks of
/// the Hessian of ½|r|², and the damping grows until the sum is positive definite. Where the problem has
/// `still`, a gradient no longer than that is the end.
struct LevenbergMarquardt {
  static constexpr Solver solver = Solver::levenberg_marquardt;  ///< its name in reports
  int max_iterations = 100;  ///< of steps, those that are taken back included

  /// u: the start, then the best point found.
  template <typename Problem, typename Scalar, int size>
  JML_RARE SolverReport minimize(const Problem& problem, Vector<Scalar, size>& u) const {
    constexpr int rows = Problem::residuals;
    SolverReport report;
    Vector<Scalar, rows> r;
    Matrix<Scalar, rows, size> J, *const no_jacobian = nullptr;
    kernel::SymmetricFactor<Scalar, size> factor;
    if (!problem.evaluate(u, r, &J)) return report;
    constexpr bool whitened = requires { requires Problem::whitened; };
    constexpr bool curved = requires { requires Problem::curved; };
    Scalar cost = kernel::squared_norm(r), damping = Scalar(1e-4), growth = 2;
    for (; report.iterations < max_iterations; ++report.iterations) {
      const Matrix<Scalar, size, rows> JT = kernel::transposed(J);
      Vector<Scalar, size> gradient;
      Matrix<Scalar, size, size> normal;
      kernel::multiply(JT, r, gradient);  // Jᵀ r
      kernel::multiply(JT, J, normal);    // Jᵀ J
      Scalar trace = 0;
      for (int i = 0; i < size; ++i) trace += normal(i, i);
      Scalar floor =
          std::numeric_limits<Scalar>::epsilon() * (Scalar(1) + std::sqrt(cost)) * std::sqrt(trace);
      if constexpr (requires { problem.still; }) floor = std::max(floor, problem.still);
      if (kernel::norm(gradient) <= floor) {
        report.converged = true;
        break;
      }
      const Scalar unit = whitened ? trace : Scalar(1);
      const Vector<Scalar, size> diagonal =
          whitened ? kernel::filled<Vector<Scalar, size>>(Scalar(1)) : kernel::diagonal(normal);
      if constexpr (curved) problem.add_curvature(u, normal);
      bool regular = false;
      for (int k = 0; k < (curved ? 60 : 1) && !regular; ++k) {
        if (k > 0) damping *= Scalar(4);
        Matrix<Scalar, size, size> damped = normal;
        for (int i = 0; i < size; ++i) damped(i, i) += damping * diagonal(i);
        regular = factor.factor(damped);
      }
      if (!regular) break;
      const Vector<Scalar, size> step = -factor.solve(gradient);
      Vector<Scalar, rows> trial;
      Vector<Scalar, size> there = u + step;
      bool defined = all_finite(step) && problem.evaluate(there, trial, no_jacobian);
      const Vector<Scalar, rows> promised = r + J * step;
      Scalar length = std::numeric_limits<Scalar>::infinity();
      for (int bends = 0; bends < 4 && report.iterations >= 3 && defined; ++bends) {
        if (kernel::squared_norm(trial) < cost) break;
        Vector<Scalar, size> pull;
        kernel::multiply(JT, Vector<Scalar, rows>(trial - promised), pull);
        const Vector<Scalar, size> turn = factor.solve(pull);
        if (!(kernel::norm(turn) < length / Scalar(2))) break;
        length = kernel::norm(turn);
        there = there - turn;
        defined = problem.evaluate(there, trial, no_jacobian);
      }
      const Scalar predicted =
          kernel::dot(step, Vector<Scalar, size>(damping * kernel::by_entry(diagonal, step) - gradient));
      const Scalar ratio = defined ? (cost - kernel::squared_norm(trial)) / predicted : Scalar(-1);
      if (ratio > Scalar(0)) {
        u = there;
        if (!problem.evaluate(u, r, &J)) return report;
        cost = kernel::squared_norm(r);
        const Scalar t = Scalar(2) * ratio - Scalar(1);
        damping *= std::max(Scalar(1) / Scalar(3), Scalar(1) - t * t * t);
        growth = 2;
      } else {
        damping *= growth;
        growth *= 2;
        if (!(damping < Scalar(1e12) * unit)) {  // no step helps any more: at the rounding of the cost
          report.converged = true;
          break;
        }
      }
    }
    return report;
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
