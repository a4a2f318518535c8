// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The root of an exact JML step, and the bounds within which it is sought.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/iterated/joint_step.hpp>

namespace jml {

/// The first attempt at the root. Measured on generated hard steps: tests/ceres/hard_steps_test.cpp.
enum class Iteration : std::uint8_t {
  anderson,  ///< Anderson depth 2 on the Gauss-Newton sweep; first derivatives only
  newton,    ///< damped Newton on the two lines; second derivatives by nested dual numbers
  picard,    ///< (9) swept as printed: the reference, a contraction only where a step is weakly nonlinear
  none,      ///< the fallback solver alone
};

constexpr Iteration last_value(Iteration) { return Iteration::none; }  ///< for saving, image/parts.hpp

/// Bounds of the iteration.
struct IterationOptions {
  Iteration method = Iteration::anderson;  ///< of the first attempt
  int max_iterations = 40;                 ///< of the first attempt; ≥ 1
  double tolerance = 0;  ///< largest residual of the two lines over the state scale; 0: 1e-12 (float: 1e-5)
  bool accept_at_limit = false;  ///< take the last sweep as it is: a fixed number of sweeps, no fallback
  bool use_fallback = true;      ///< call the fallback solver where the first attempt failed
  int max_newton = 30;           ///< Newton steps of the fallback solver's second half
  int starts = 20;  ///< further starts of a step that bends and took long, strewn about x̂; ≥ 0, of which at
                    ///< most 100 are made
};

namespace detail {

template <typename Scalar>
constexpr Scalar default_tolerance() {
  return std::is_same_v<Scalar, float> ? Scalar(1e-5) : Scalar(1e-12);
}

inline constexpr int most_starts = 100;

inline bool valid(const IterationOptions& o) {
  const bool can_answer = o.method == Iteration::none ? o.use_fallback && !o.accept_at_limit
                                                      : !(o.method == Iteration::newton && o.accept_at_limit);
  return can_answer && o.max_iterations >= 1 && o.max_newton >= 0 && o.starts >= 0 && o.tolerance >= 0 &&
         o.tolerance < 1;
}

/// A root, or the last sweep taken for one, and the models there.
template <typename Step>
struct Root {
  using Scalar = typename Step::X::Scalar;
  typename Step::Z z;   // the answer
  typename Step::Z at;  // where the slots are evaluated: z, or the start of the last sweep
  typename Step::Visit visit;
  Status status = Status::not_converged;
  Solver solver = Solver::none;
  int iterations = 0;
  bool stalled = false;  // the iteration is near the root, and rounding keeps it from the tolerance
  Scalar residual = 0, cost = 0;
};

/// The models at root.z, on the rare way back.
template <typename Step>
JML_RARE Root<Step> revisit(const Step& step, Root<Step> root) {
  (void)step.visit_apart(root.z, root.visit);
  return root;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
