// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Algebraic Riccati equations, symmetric or not, square or not: 0 = A X + X B + Q - X S X, X is n1×n2.
///
/// With K = [-B S; Q A]: K [I; X] = [I; X](-B + S X), and the other n1 eigenvalues are those of A - X S.
/// Wanted is the X of the n2 rightmost eigenvalues of K, which leaves B - S X and A - X S stable. K is
/// scaled by powers of two first, so that nothing below depends on units.
///
/// Warm: with X = X0 + Z the rest Z solves an equation of the same form, 0 = A₀ Z + Z B₀ + Res(X0) - Z S Z
/// with A₀ = A - X0 S, B₀ = B - S X0, by doubling. Whatever X0 is, doubling ends at the stabilising solution
/// or does not converge: only there do both of its powers vanish. Cold (algebraic_solvers.hpp): ordered Schur
/// form.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/linear_algebra.hpp>
#include <jml/riccati/algebraic_solvers.hpp>
#include <jml/status.hpp>

namespace jml {

/// The X that leaves B - S X and A - X S (with the signs given) stable.
///
/// Refuses with Status::invalid_option: a coefficient that is not finite, a sign that is not ±1.
/// no_stabilizing_solution: an unstable mode is not detectable (or not stabilisable), or K has not n2
/// eigenvalues in the right and n1 in the left half plane. eigenvalues_on_axis: no gap, and not a case that a
/// shift cures. not_converged: bounds reached, or no digit of X is certain. accepted_critical: see
/// AlgebraicSolution::shifted. A symmetric equation (B = Aᵀ, Q, S symmetric) has an exactly symmetric answer.
template <typename Scalar, int n1, int n2>
[[nodiscard]] AlgebraicSolution<Scalar, n1, n2> solve_algebraic_riccati(
    const AlgebraicRiccati<Scalar, n1, n2>& equation) {
  AlgebraicSolution<Scalar, n1, n2> out;
  if (!detail::valid(equation)) {
    out.status = Status::invalid_option;
    return out;
  }
  const detail::BalancedRiccati<Scalar, n1, n2> balanced(equation);
  detail::solve_cold(balanced, out);
  detail::finish(equation, balanced, out);
  return out;
}

/// The same X from a neighbour's: `start` is the X of a moment ago. Where doubling from there does not reach
/// rounding, the cold solver answers. On refusal X is `start`.
template <typename Scalar, int n1, int n2>
[[nodiscard]] AlgebraicSolution<Scalar, n1, n2> solve_algebraic_riccati(
    const AlgebraicRiccati<Scalar, n1, n2>& equation, const Matrix<Scalar, n1, n2>& start) {
  AlgebraicSolution<Scalar, n1, n2> out;
  if (!detail::valid(equation)) {
    out.status = Status::invalid_option;
  } else {
    const detail::BalancedRiccati<Scalar, n1, n2> balanced(equation);
    out.warm = all_finite(start) && detail::solve_warm(balanced, start, out);
    if (!out.warm) detail::solve_cold(balanced, out);
    detail::finish(equation, balanced, out);
  }
  if (!usable(out.status)) out.X = start;
  return out;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
