// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The iterated rules by name, and what their steps report.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/report.hpp>
#include <jml/iterated/joint_solve.hpp>
#include <jml/riccati/gain_rule.hpp>
#include <jml/solve/levenberg_marquardt.hpp>

namespace jml {

/// A rule whose step is implicit. Inner: the one-pass rule that supplies the slots; Fallback: the
/// least-squares solver below.
template <typename Inner_, typename Fallback_ = LevenbergMarquardt>
struct Iterated {
  using Inner = Inner_;                                ///< one-pass rule
  using Fallback = Fallback_;                          ///< solver of hard steps
  static constexpr bool symmetric = Inner::symmetric;  ///< P is a covariance, to first order
  [[no_unique_address]] Inner inner{};                 ///< supplies the slots
  IterationOptions options{};                          ///< of the iteration
  [[no_unique_address]] Fallback fallback{};           ///< where the first attempt fails
};

/// The exact recursive-iterative JML estimator, eq. (9).
template <typename Reference = AboutOrigin, typename Fallback = LevenbergMarquardt>
struct IteratedJml : Iterated<Jml<Reference>, Fallback> {
  IteratedJml()
    requires(std::is_empty_v<Reference>)
  = default;
  /// About the origin.
  explicit IteratedJml(const IterationOptions& iteration)
    requires(std::is_empty_v<Reference>)
      : Iterated<Jml<Reference>, Fallback>{{}, iteration, {}} {}
  /// About `reference`, with bounds of the iteration and a fallback solver.
  explicit IteratedJml(const Reference& reference, const IterationOptions& iteration = {},
                       const Fallback& solver = {})
      : Iterated<Jml<Reference>, Fallback>{Jml<Reference>(reference), iteration, solver} {}
};
/// About the origin.
IteratedJml(const IterationOptions&) -> IteratedJml<>;

/// The measurement-iterated EKF: predict once, then iterate the correction alone. The paper's comparison.
struct Iekf : Iterated<Ekf<>> {
  Iekf() = default;
  /// Bounds of the iteration.
  explicit Iekf(const IterationOptions& iteration) : Iterated<Ekf<>>{{}, iteration, {}} {}
  static constexpr bool measurement_only = true;  ///< the state before the step is not revised
};

template <typename Reference, typename Fallback>
struct PartsOf<IteratedJml<Reference, Fallback>>
    : PartsOfBase<IteratedJml<Reference, Fallback>, Iterated<Jml<Reference>, Fallback>> {};
template <>
struct PartsOf<Iekf> : PartsOfBase<Iekf, Iterated<Ekf<>>> {};

template <typename Rule>
concept IteratedRule = requires {
  typename Rule::Inner;
  typename Rule::Fallback;
};

/// How the root of an exact step was found.
template <typename Scalar, int n>
struct RootReport {
  Solver solver = Solver::none;  ///< who found it
  int iterations = 0;            ///< sweeps or steps of all solvers together
  /// Of the two ground-truth lines over the state scale; accepted_at_limit: before the last sweep. Of a step
  /// that was redone: its last movement, in standard deviations.
  Scalar residual = 0;
  Scalar cost = 0;  ///< one-step criterion (11) at the root; may be negative where sym(P) is indefinite
  /// x_{i/i+1}: the previous state, seen from here; of a correction alone x itself. Of states in a space how
  /// far it is from x̂_i, x_{i/i+1} ⊟ x̂_i.
  Vector<Scalar, n> smoothed = kernel::zeros<Vector<Scalar, n>>();
};

/// What an exact step reports.
template <typename Scalar, int n, int p>
struct IteratedReport : StepReport<Scalar, n, p>, RootReport<Scalar, n> {};

}  // namespace jml
#include <jml/warnings_end.hpp>
