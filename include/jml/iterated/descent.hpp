// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a step does that its iteration did not solve, or not for good: the fallback solver, the way down from
/// a saddle, and another way to a strongly bent step's root, which may be lower.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/iterated/minimum.hpp>
#include <jml/iterated/root.hpp>
#include <jml/solve/newton.hpp>

namespace jml::detail {

/// Newton on the two lines from root.z, until their residual is at the tolerance or `enough`; judges what it
/// reached.
template <typename Step, typename Scalar>
JML_RARE Root<Step> polish(const Step& step, Scalar tolerance, int max_newton, Root<Step> root,
                           Scalar enough = 0) {
  root.status = Status::not_converged;
  const SolverReport newton = damped_newton(step, root.z, std::max(tolerance, enough), max_newton);
  root.iterations += newton.iterations;
  root.at = root.z;
  if (!step.visit_apart(root.z, root.visit)) return root;
  root.residual = step.scaled(root.visit.residual);
  root.status = step.verdict(root.z, root.visit, root.residual, tolerance);
  return root;
}

/// By the fallback solver down from u, then Newton with the true P.
template <typename Rule, typename Step, typename Whitened, typename Scalar, int size>
JML_RARE Root<Step> descend(const Rule& rule, const Step& step, const Whitened& whitened, Scalar tolerance,
                            Vector<Scalar, size> u, Root<Step> root) {
  for (int again = 0; again < 2; ++again) {
    const SolverReport found = rule.fallback.minimize(whitened, u);
    root.iterations += found.iterations;
    if (found.converged) break;
  }
  root.solver = Rule::Fallback::solver;
  root.z = whitened.point(u);
  root.status = Status::not_converged;
  return all_finite(root.z) ? polish(step, tolerance, rule.options.max_newton, root) : root;
}

/// The fallback solver: the whitened problem (11) from a = b = 0, then Newton with the true P.
template <typename Rule, typename Step, typename Scalar>
JML_RARE Root<Step> use_fallback_solver(const Rule& rule, const Step& step,
                                        const typename Step::X& prediction, Scalar tolerance,
                                        Root<Step> root) {
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime);
  const WhitenedStep<Step, Scalar, n> whitened(step, rule.options);
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
JML_RARE Root<Step> leave_saddle(const Rule& rule, const Step& step, Scalar tolerance, Root<Step> root,
                                 bool may_descend) {
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime);
  using U = Vector<Scalar, 2 * n>;
  using Whitened = WhitenedStep<Step, Scalar, n>;
  const Whitened whitened(step, rule.options);
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

/// A root of a symmetric P made sure of: a minimum, and where the step bends much and the first attempt took
/// long or failed, the lowest of those that the fallback solver goes down to from the start and from
/// options.starts points strewn about x̂. No lower root is farther from x̂ than √(2 J) deviations, J that of
/// the lowest known: the points are of a cube with 0.7 of that on
/// each side.
template <typename Rule, typename Step, typename Scalar>
JML_RARE Root<Step> seek_minimum(const Rule& rule, const Step& step, const typename Step::X& prediction,
                                 Scalar tolerance, const Root<Step>& start, Root<Step> root, bool took_long) {
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime);
  const bool may_descend = rule.options.use_fallback, failed = !usable(root.status);
  const auto make_sure = [&](const Root<Step>& of) {
    const Bend<Step> bend(step, of.z, of.visit);
    return bend.is_slight(step, of.visit) ? of : leave_saddle(rule, step, tolerance, of, may_descend);
  };
  const bool by_fallback = root.solver == Rule::Fallback::solver;
  if (!failed) root = make_sure(root);
  if (!may_descend || !(took_long || failed) ||
      Bend<Step>(step, start.z, start.visit).is_slight(step, start.visit))
    return root;
  const auto compare = [&](Root<Step> other) {
    const int iterations = other.iterations;
    if (usable(other.status)) {
      other.cost = step.cost_at_root(other.visit);
      other = make_sure(other);
    }
    if (usable(other.status) && !(usable(root.status) && root.cost <= other.cost)) root = other;
    root.iterations = iterations;
  };
  if (!by_fallback) compare(use_fallback_solver(rule, step, prediction, tolerance, root));
  const WhitenedStep<Step, Scalar, n> whitened(step, rule.options);
  Scalar ratio = 1;  // r^(2n+1) = r + 1: the points k (1/r, 1/r², …) modulo 1 are even (Roberts 2018)
  for (int k = 0; k < 60; ++k) ratio = std::pow(Scalar(1) + ratio, Scalar(1) / Scalar(2 * n + 1));
  for (int k = 1; k <= std::min(rule.options.starts, most_starts); ++k) {
    const Scalar side =
        Scalar(1.4) * (usable(root.status) ? std::sqrt(Scalar(2) * std::abs(root.cost)) : Scalar(2));
    Vector<Scalar, 2 * n> u;
    Scalar share = Scalar(k);
    for (int i = 0; i < 2 * n; ++i) {
      share /= ratio;
      u(i) = side * (share - std::round(share));
    }
    compare(descend(rule, step, whitened, tolerance, u, root));
  }
  return root;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
