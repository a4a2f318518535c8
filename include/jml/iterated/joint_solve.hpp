// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How the root of an exact JML step is found: a bounded iteration first, the fallback solver below it.
#pragma once

#include <jml/iterated/descent.hpp>
#include <jml/model/local_context.hpp>
#include <jml/solve/anderson.hpp>

namespace jml {

namespace detail {

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
  Scalar shortest = std::numeric_limits<Scalar>::infinity();
  int no_shorter = 0;  // sweeps in a row that moved as far as those before
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
    const Scalar move = step.moved(plain, root.z);
    no_shorter = move < shortest / Scalar(2) ? 0 : no_shorter + 1;
    shortest = move < shortest ? move : shortest;
    settled = move <= tolerance;  // no sweep will move it any more
    // Nor any less far: rounding moves it. Or soon will, where that of z is a large residual.
    root.stalled = false;
    if (const Scalar near = std::sqrt(tolerance); move <= near)
      root.stalled = no_shorter > 1 || root.residual * std::numeric_limits<Scalar>::epsilon() > near * move;
    if (root.stalled && !options.accept_at_limit) break;
    if constexpr (picard)
      kernel::assign(root.z, plain);
    else
      kernel::assign(root.z, anderson.propose(root.z, plain, weights));
    const bool defined = picard ? step.visit_apart(root.z, root.visit) : step.visit(root.z, root.visit);
    if (!defined) {  // once more from the unaccelerated point
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
JML_RARE Root<Step> iterate_as_printed(const Rule& rule, const Step& step, const typename Step::X& prediction,
                                       Scalar tolerance, const Root<Step>& start) {
  return iterate<true>(rule, step, prediction, tolerance, start);
}

/// Other minima are not looked for: of a step in charts that is done again.
template <typename Step>
[[nodiscard]] bool looks_here_alone(const Step& step) {
  if constexpr (requires { step.at_y.search; })
    return step.at_y.search != Search::everywhere;
  else
    return false;
}
/// Where the iteration begins: at the start, or near a root that is known.
template <typename Step>
[[nodiscard]] decltype(auto) beginning_of(const Step& step, const Root<Step>& start) {
  if constexpr (requires { step.at_y.search; }) {
    Root<Step> begin = start;
    if (step.at_y.search == Search::slope) {
      const typename Step::X x_s = step.at_y.slope_at;
      Step::join(x_s, dynamics(step.dynamics_model, x_s, step.at), begin.z);
      if (!step.visit_apart(begin.z, begin.visit)) begin = start;
    }
    return begin;
  } else {
    return (start);
  }
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
  const Scalar start_cost =
      kernel::dot(start.visit.innovation, start.visit.weighted_innovation) / Scalar(2);  // x_s = x̂, w = 0
  const auto judge_cost = [&](Root<Step>& root) JML_INLINE {
    root.cost = std::numeric_limits<Scalar>::quiet_NaN();
    if (!usable(root.status) || root.status == Status::accepted_at_limit)
      return;  // no root, no one-step cost
    root.cost = step.cost_at_root(root.visit);
    const Scalar slack = Scalar(1e3) * std::numeric_limits<Scalar>::epsilon();
    if (symmetric_prior && root.cost > start_cost * (Scalar(1) + slack) + slack)
      root.status = Status::not_converged;
  };

  const Root<Step>& begin = beginning_of(step, start);
  Root<Step> root = begin;
  switch (options.method) {
    case Iteration::anderson:
      root = iterate<false>(rule, step, prediction, tolerance, begin);
      break;
    case Iteration::picard:
      root = iterate_as_printed(rule, step, prediction, tolerance, begin);
      break;
    case Iteration::newton:
      root = polish(step, tolerance, options.max_iterations, begin);
      root.solver = Solver::newton;
      break;
    case Iteration::none:
      break;
  }
  judge_cost(root);
  const bool alone = looks_here_alone(step);
  const bool took_long = root.stalled ? root.iterations > 12 : root.iterations > 7 || !usable(root.status);
  if (!usable(root.status) && options.use_fallback && !options.accept_at_limit) {
    if (root.stalled) {
      root = polish(step, tolerance, options.max_newton, root, step.rounding(root.z, root.visit));
      root.solver = Solver::newton;
      judge_cost(root);
    }
    if (!usable(root.status)) {
      root = use_fallback_solver(rule, step, prediction, tolerance, root);
      judge_cost(root);
    }
  }
  if constexpr (Bend<Step>::of_m || Bend<Step>::of_f) {
    const bool found = usable(root.status), searched = options.use_fallback && !options.accept_at_limit;
    if (symmetric_prior && root.status != Status::accepted_at_limit &&
        (found ? (took_long && !alone) || !bends_little(step, root.z, root.visit) : searched && !alone)) {
      root = seek_minimum(rule, step, prediction, tolerance, start, root, took_long && !alone);
      if (!found) judge_cost(root);
    }
  }
  return root;
}

}  // namespace detail

}  // namespace jml
