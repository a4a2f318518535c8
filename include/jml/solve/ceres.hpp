// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The fallback solver of an iterated rule, solved by Ceres (component jml::ceres). Not heap-free: not for
/// the control loop.
///
///     jml::Filter filter{jml::IteratedJml<jml::AboutOrigin, jml::Ceres>{}, dynamics, estimate};
#include <jml/warnings_begin.hpp>
#pragma once

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <jml/linear_algebra.hpp>
#include <jml/solve/newton.hpp>
#include <jml/status.hpp>

namespace jml {

/// Minimises ½|r(u)|² with Ceres' trust region; the same interface as LevenbergMarquardt.
struct Ceres {
  static constexpr Solver solver = Solver::ceres;  ///< its name in reports
  int max_iterations = 200;                        ///< of the trust region

  /// A failure inside Ceres leaves u as it was and is reported; nothing is thrown across the step or printed.
  template <typename Problem, typename Scalar, int size>
  SolverReport minimize(const Problem& problem, Vector<Scalar, size>& u) const {
    static_assert(std::is_same_v<Scalar, double>, "jml: Ceres solves in double");
    SolverReport report;
    Vector<double, size> best = u;
    try {
      ::ceres::Problem::Options problem_options;
      problem_options.cost_function_ownership = ::ceres::DO_NOT_TAKE_OWNERSHIP;
      Residuals<Problem, size> residuals(problem);
      ::ceres::Problem task(problem_options);
      task.AddResidualBlock(&residuals, nullptr, best.data());
      ::ceres::Solver::Options options;
      options.max_num_iterations = max_iterations;
      options.linear_solver_type = ::ceres::DENSE_QR;
      options.function_tolerance = 0;  // the cost may be small in itself: stop by gradient and step
      options.gradient_tolerance = 1e-14;
      options.parameter_tolerance = 1e-15;
      options.initial_trust_region_radius = 1e6;  // the default of 1e4 costs iterations on a smooth problem
      options.logging_type = ::ceres::SILENT;
      ::ceres::Solver::Summary summary;
      ::ceres::Solve(options, &task, &summary);
      report.iterations = summary.num_successful_steps + summary.num_unsuccessful_steps;
      report.converged = summary.IsSolutionUsable() && all_finite(best);
    } catch (...) {
      report.converged = false;
    }
    if (report.converged) u = best;
    return report;
  }

 private:
  template <typename Problem, int size>
  class Residuals final : public ::ceres::SizedCostFunction<Problem::residuals, size> {
   public:
    explicit Residuals(const Problem& problem) : problem_(problem) {}
    bool Evaluate(const double* const* parameters, double* out, double** jacobians) const override {
      const Vector<double, size> u = Eigen::Map<const Vector<double, size>>(parameters[0]);
      Vector<double, Problem::residuals> r;
      Matrix<double, Problem::residuals, size> J;
      const bool wanted = jacobians != nullptr && jacobians[0] != nullptr;
      if (!problem_.evaluate(u, r, wanted ? &J : nullptr)) return false;
      Eigen::Map<Vector<double, Problem::residuals>>(out, r.size()) = r;
      if (wanted) {
        Eigen::Map<Eigen::Matrix<double, Problem::residuals, size, Eigen::RowMajor>>(jacobians[0], r.size(),
                                                                                     size) = J;
      }
      return true;
    }

   private:
    const Problem& problem_;
  };
};

}  // namespace jml
#include <jml/warnings_end.hpp>
