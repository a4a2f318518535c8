// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How the root of an exact JML step is found: a bounded iteration first, the fallback solver below it.
#pragma once

#include <jml/iterated/minimum.hpp>
#include <jml/solve/anderson.hpp>
#include <jml/solve/newton.hpp>

namespace jml {

/// The first attempt at the root. Measured on generated hard steps: tests/ceres/hard_steps_test.cpp.
enum class Iteration : std::uint8_t {
  anderson,  ///< Anderson depth 2 on the Gauss-Newton sweep; first derivatives only
  newton,    ///< damped Newton on the two lines; second derivatives by nested dual numbers
  picard,    ///< (9) swept as printed: the reference, a contraction only where a step is weakly nonlinear
  none,      ///< the fallback solver alone
};

/// Bounds of the iteration.
struct IterationOptions {
  Iteration method = Iteration::anderson;
  int max_iterations = 40;  ///< of the first attempt; ≥ 1
  double tolerance = 0;  ///< largest residual of the two lines over the state scale; 0: 1e-12 (float: 1e-5)
  bool accept_at_limit = false;  ///< take the last sweep as it is: a fixed number of sweeps, no fallback
  bool use_fallback = true;      ///< call the fallback solver where the first attempt failed
  int max_newton = 30;           ///< Newton steps of the fallback solver's second half
};

namespace detail {

template <typename Scalar>
constexpr Scalar default_tolerance() {
  return std::is_same_v<Scalar, float> ? Scalar(1e-5) : Scalar(1e-12);
}

inline bool valid(const IterationOptions& o) {
  const bool can_answer = o.method == Iteration::none ? o.use_fallback && !o.accept_at_limit
                                                      : !(o.method == Iteration::newton && o.accept_at_limit);
  return can_answer && o.max_iterations >= 1 && o.max_newton >= 0 && o.tolerance >= 0 && o.tolerance < 1;
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
  Scalar residual = 0, cost = 0;
};

/// The models at root.z, on the rare way back.
template <typename Step>
JML_NOINLINE Root<Step> revisit(const Step& step, Root<Step> root) {
  (void)step.visit(root.z, root.visit);
  return root;
}

/// Iterates from `start` until the residual is below the tolerance. Everything goes by value, to live in
/// registers.
template <bool picard, typename Rule, typename Step, typename Scalar>
JML_INLINE inline Root<Step> iterate(const Rule& rule, const Step& step, const typename Step::X& prediction,
                                     Scalar tolerance, const Root<Step>& start) {
  using Z = typename Step::Z;
  const IterationOptions& options = rule.options;
  Anderson<Scalar, Z::RowsAtCompileTime> anderson;
  Z weights, plain;
  Step::join(step.inverse_scale, step.inverse_scale, weights);
  kernel::assign(plain, start.z);
  Root<Step> root = start;
  root.solver = picard ? Solver::picard : Solver::anderson;
  root.residual = step.scaled(root.visit.residual);
  bool settled = false;
  while (true) {
    if ((root.residual <= tolerance || settled) && !options.accept_at_limit) {
      root.status = step.verdict(root.z, root.visit, root.residual, tolerance);
      if (root.status == Status::ok || (settled && usable(root.status))) break;
    }
    root.status = Status::not_converged;
    if (root.iterations == options.max_iterations) break;
    bool regular;
    if constexpr (picard) {
      const typename Step::X x_s = Step::smoothed(root.z), x_1 = Step::next(root.z);
      regular = step.template sweep<true>(
          root.z, root.visit,
          dynamics_slot<Rule::Inner::A>(rule.inner, step.dynamics_model, x_s, step.prior.x, step.at),
          sensor_slot<Rule::Inner::E>(rule.inner, step.sensor, x_1, prediction, step.at_y), plain);
    } else {
      regular = step.template sweep<false>(root.z, root.visit, root.visit.f_x, root.visit.m_x, plain);
    }
    if (!regular) break;
    ++root.iterations;
    if (options.accept_at_limit && root.iterations == options.max_iterations) {
      if (all_finite(plain)) root.status = Status::accepted_at_limit;
      break;
    }
    settled = step.moved(plain, root.z) <= tolerance;  // no sweep will move it any more
    if constexpr (picard)
      kernel::assign(root.z, plain);
    else
      kernel::assign(root.z, anderson.propose(root.z, plain, weights));
    if (!step.visit(root.z, root.visit)) {  // undefined there: once more from the unaccelerated point
      kernel::assign(root.z, plain);
      root = revisit(step, root);
      anderson.restart();
      if (!all_finite(root.visit.residual)) break;
    }
    root.residual = step.scaled(root.visit.residual);
  }
  kernel::assign(root.at, root.z);
  if (root.status == Status::accepted_at_limit) kernel::assign(root.z, plain);
  return root;
}

/// (9) as printed, out of the way of the default.
template <typename Rule, typename Step, typename Scalar>
JML_NOINLINE Root<Step> iterate_as_printed(const Rule& rule, const Step& step,
                                           const typename Step::X& prediction, Scalar tolerance,
                                           const Root<Step>& start) {
  return iterate<true>(rule, step, prediction, tolerance, start);
}

/// Newton on the two lines from root.z; judges what it reached.
template <typename Step, typename Scalar>
JML_NOINLINE Root<Step> polish(const Step& step, Scalar tolerance, int max_newton, Root<Step> root) {
  root.status = Status::not_converged;
  const SolverReport newton = damped_newton(step, root.z, tolerance, max_newton);
  root.iterations += newton.iterations;
  root.at = root.z;
  if (!step.visit(root.z, root.visit)) return root;
  root.residual = step.scaled(root.visit.residual);
  root.status = step.verdict(root.z, root.visit, root.residual, tolerance);
  return root;
}

/// The fallback solver: the whitened problem (11) from a = b = 0, then Newton with the true P.
template <typename Rule, typename Step, typename Scalar>
JML_NOINLINE Root<Step> use_fallback_solver(const Rule& rule, const Step& step,
                                            const typename Step::X& prediction, Scalar tolerance,
                                            Root<Step> root) {
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime);
  const WhitenedStep<Step, Scalar, n> whitened(step);
  static_assert(LeastSquaresSolver<typename Rule::Fallback, WhitenedStep<Step, Scalar, n>, Scalar>,
                "jml: the fallback solver of an iterated rule has minimize(problem, u) and a name, see "
                "jml::LeastSquaresSolver");
  Vector<Scalar, 2 * n> u = kernel::zeros<Vector<Scalar, 2 * n>>();
  const SolverReport least_squares = rule.fallback.minimize(whitened, u);
  root.solver = Rule::Fallback::solver;
  root.iterations += least_squares.iterations;
  root.z = whitened.point(u);
  if (!all_finite(root.z)) Step::join(step.prior.x, prediction, root.z);
  return polish(step, tolerance, rule.options.max_newton, root);
}

/// Down from a root that is no minimum of (11), if it is none: by the fallback solver from both sides of it,
/// along a direction in which (11) falls; the lower of the minima reached. no_minimum: none is.
template <typename Rule, typename Step, typename Scalar>
JML_NOINLINE Root<Step> leave_saddle(const Rule& rule, const Step& step, Scalar tolerance, Root<Step> root,
                                     bool may_descend) {
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime);
  using U = Vector<Scalar, 2 * n>;
  using Whitened = WhitenedStep<Step, Scalar, n>;
  const Whitened whitened(step);
  const auto cost_at = [&](const U& u) {
    Vector<Scalar, Whitened::residuals> r;
    return whitened.evaluate(u, r, nullptr) ? kernel::dot(r, r) / Scalar(2)
                                            : std::numeric_limits<Scalar>::infinity();
  };
  for (int round = 0; round < 4; ++round) {
    const Bend<Step> bend(step, root.z, root.visit);
    U down;
    if (!bend.finite || bend.is_slight(step, root.visit) ||
        !leads_down<Step, Whitened, Scalar, n>(step, whitened, bend, root.visit, down))
      return root;
    if (!may_descend) break;
    const U from = whitened.coordinates(root.visit);
    const Scalar cost = cost_at(from);
    Root<Step> best = root;
    best.status = Status::no_minimum;
    best.cost = std::numeric_limits<Scalar>::infinity();
    bool any = false;
    for (const Scalar side : {Scalar(1), Scalar(-1)}) {
      U u;
      bool falls = false;
      for (Scalar length = side; !falls && std::abs(length) > Scalar(1e-6); length /= Scalar(2)) {
        for (int i = 0; i < 2 * n; ++i) u(i) = from(i) + length * down(i);
        falls = cost_at(u) < cost;
      }
      any = any || falls;
      if (!falls) continue;
      Root<Step> there = root;
      there.iterations += rule.fallback.minimize(whitened, u).iterations;
      there.solver = Rule::Fallback::solver;
      there.z = whitened.point(u);
      if (!all_finite(there.z)) continue;
      there = polish(step, tolerance, rule.options.max_newton, there);
      if (!usable(there.status)) continue;
      there.cost = step.cost_at_root(there.visit);
      if (there.cost < best.cost && there.cost < cost) best = there;
      root.iterations = best.iterations = there.iterations;
    }
    if (!any) return root;  // by less than (11) is right to
    if (!usable(best.status)) return best;
    root = best;
  }
  root.status = Status::no_minimum;
  return root;
}

/// The first attempt took long.
template <typename Rule, typename Step>
[[nodiscard]] bool wandered(const Rule&, const Root<Step>& root) {
  return root.iterations > 7 && root.solver != Rule::Fallback::solver;
}

/// A root of a symmetric P made sure of: a minimum, and where the step bends much and the first attempt took
/// long, not a higher one than the fallback solver goes down to from the start.
template <typename Rule, typename Step, typename Scalar>
JML_NOINLINE Root<Step> seek_minimum(const Rule& rule, const Step& step, const typename Step::X& prediction,
                                     Scalar tolerance, const Root<Step>& start, Root<Step> root) {
  const bool may_descend = rule.options.use_fallback;
  const auto make_sure = [&](const Root<Step>& of) {
    const Bend<Step> bend(step, of.z, of.visit);
    return bend.is_slight(step, of.visit) ? of : leave_saddle(rule, step, tolerance, of, may_descend);
  };
  const bool took_long = wandered(rule, root);
  root = make_sure(root);
  if (!may_descend || !took_long || Bend<Step>(step, start.z, start.visit).is_slight(step, start.visit))
    return root;
  Root<Step> other = use_fallback_solver(rule, step, prediction, tolerance, root);
  if (usable(other.status)) {
    other.cost = step.cost_at_root(other.visit);
    other = make_sure(other);
    if (usable(other.status) && !(root.cost <= other.cost)) return other;
  }
  root.iterations = other.iterations;
  return root;
}

/// The root of one step from `start`, (x̂, f(x̂)) already visited: first attempt, then the fallback solver.
/// `symmetric_prior`: the cost (11) must not be larger than at the start.
template <typename Rule, typename Step>
JML_NOINLINE Root<Step> solve_joint_step(const Rule& rule, const Step& step,
                                         const typename Step::X& prediction, bool symmetric_prior,
                                         const Root<Step>& start) {
  using Scalar = typename Step::X::Scalar;
  const IterationOptions& options = rule.options;
  const Scalar tolerance = options.tolerance > 0 ? Scalar(options.tolerance) : default_tolerance<Scalar>();
  // (11) at x_s = x̂, w = 0
  const Scalar start_cost = kernel::dot(start.visit.innovation, start.visit.weighted_innovation) / Scalar(2);
  const auto judge_cost = [&](Root<Step>& root) JML_INLINE {
    root.cost = std::numeric_limits<Scalar>::quiet_NaN();
    if (!usable(root.status) || root.status == Status::accepted_at_limit)
      return;  // no root, no one-step cost
    root.cost = step.cost_at_root(root.visit);
    const Scalar slack = Scalar(1e3) * std::numeric_limits<Scalar>::epsilon();
    if (symmetric_prior && root.cost > start_cost * (Scalar(1) + slack) + slack)
      root.status = Status::not_converged;
  };

  Root<Step> root = start;
  switch (options.method) {
    case Iteration::anderson:
      root = iterate<false>(rule, step, prediction, tolerance, start);
      break;
    case Iteration::picard:
      root = iterate_as_printed(rule, step, prediction, tolerance, start);
      break;
    case Iteration::newton:
      root = polish(step, tolerance, options.max_iterations, start);
      root.solver = Solver::newton;
      break;
    case Iteration::none:
      break;
  }
  judge_cost(root);
  if (!usable(root.status) && options.use_fallback && !options.accept_at_limit) {
    root = use_fallback_solver(rule, step, prediction, tolerance, root);
    judge_cost(root);
  }
  if constexpr (Bend<Step>::of_m || Bend<Step>::of_f) {
    if (symmetric_prior && usable(root.status) && root.status != Status::accepted_at_limit &&
        (wandered(rule, root) || !bends_little(step, root.z, root.visit)))
      root = seek_minimum(rule, step, prediction, tolerance, start, root);
  }
  return root;
}

}  // namespace detail

}  // namespace jml
