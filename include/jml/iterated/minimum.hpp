// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether a root of an exact step is a minimum of its criterion (11), and which way leads down from one that
/// is a saddle or a maximum.
///
/// With x_s = x̂ + L a and G w = B b (iterated/whitened_step.hpp), ν = R⁻¹ (y - m), e = m_xᵀ ν,
///   W = m_xᵀ R⁻¹ m_x - Σ ν_k ∇²m_k at x_1,  Λ = Σ e_j ∇²f_j at x_s,
/// the Hessian of (11) in b is I + Bᵀ W B, and what is left of it in a, with b at its best,
///   I + Lᵀ (f_xᵀ (I + W C)⁻¹ W f_x - Λ) L.
/// The root is a minimum where both are positive definite: two n×n matrices, whatever the ranks of P and C.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/iterated/whitened_step.hpp>
#include <jml/solve/negative_direction.hpp>

namespace jml::detail {

/// The models bend too little at a root for anything but a minimum: Σ |m_ij| √(N_ii N_jj) + Σ |Λ_ij| √(P_ii
/// P_jj) < ½, by differences of the Jacobians over a thousandth of a deviation. For the usual step, as second
/// derivatives by dual numbers cost as much as it does.
template <typename Step>
[[nodiscard]] JML_NOINLINE bool bends_little(const Step& step, const typename Step::Z& z,
                                             const typename Step::Visit& at) {
  using X = typename Step::X;
  using Scalar = typename X::Scalar;
  constexpr int n = static_cast<int>(X::RowsAtCompileTime), p = Step::p;
  constexpr Scalar share = Scalar(1e-3), most = Scalar(0.5) * share;
  Scalar sum = 0;
  X size, e;
  kernel::product(kernel::transposed(at.m_x), at.weighted_innovation, e);  // e = m_xᵀ ν
  if constexpr (Bend<Step>::of_m) {
    Matrix<Scalar, n, n> fP;
    kernel::product(at.f_x, step.prior.P, fP);
    for (int i = 0; i < n; ++i) {  // √N_ii
      Scalar variance = step.noise(i, i);
      for (int k = 0; k < n; ++k) variance += fP(i, k) * at.f_x(i, k);
      size(i) = std::sqrt(std::abs(variance));
    }
    X x = Step::next(z);
    for (int j = 0; j < n; ++j) {
      if (size(j) == Scalar(0)) continue;
      const Scalar here = x(j);
      x(j) = here + share * size(j);
      const Matrix<Scalar, p, n> m_x = measurement_jacobian(step.sensor, x, step.at_y);
      x(j) = here;
      for (int i = 0; i < n; ++i) {
        Scalar change = -e(i);
        for (int k = 0; k < p; ++k) change += m_x(k, i) * at.weighted_innovation(k);
        sum += std::abs(change) * size(i);
      }
    }
  }
  if constexpr (Bend<Step>::of_f) {
    X fe, x = Step::smoothed(z);
    kernel::product(kernel::transposed(at.f_x), e, fe);
    for (int i = 0; i < n; ++i) size(i) = std::sqrt(std::abs(step.prior.P(i, i)));
    for (int j = 0; j < n; ++j) {
      if (size(j) == Scalar(0)) continue;
      const Scalar here = x(j);
      x(j) = here + share * size(j);
      const Matrix<Scalar, n, n> f_x = dynamics_jacobian(step.dynamics_model, x, step.at);
      x(j) = here;
      for (int i = 0; i < n; ++i) {
        Scalar change = -fe(i);
        for (int k = 0; k < n; ++k) change += f_x(k, i) * e(k);
        sum += std::abs(change) * size(i);
      }
    }
  }
  return sum < most;
}

/// A direction in (a, b) along which (11) falls from a root; false where that is a minimum, to rounding.
template <typename Step, typename Whitened, typename Scalar, int n>
[[nodiscard]] JML_RARE bool leads_down(const Step& step, const Whitened& whitened, const Bend<Step>& bend,
                                       const typename Step::Visit& at, Vector<Scalar, 2 * n>& down) {
  using Square = Matrix<Scalar, n, n>;
  constexpr Scalar epsilon = Scalar(64 * n) * std::numeric_limits<Scalar>::epsilon();
  const Square L = whitened.L, B = whitened.B;
  const auto sizes = [](const Square& a) {
    Square out;
    for (int i = 0; i < n * n; ++i) out.data()[i] = std::abs(a.data()[i]);
    return out;
  };
  // I + Fᵀ M F, and what rounding may have made of its diagonal if M is right to that of `terms`.
  const auto curvature = [&](const Square& F, const Square& M, const Square& terms,
                             Vector<Scalar, n>& rounding) {
    Square MF, out = kernel::identity<Square>();
    kernel::multiply(M, F, MF);
    kernel::add_symmetric_transposed_product<1>(out, F, MF, out);
    const Square size = sizes(F);
    kernel::multiply(terms, size, MF);
    for (int i = 0; i < n; ++i) {
      rounding(i) = Scalar(1);
      for (int j = 0; j < n; ++j) rounding(i) += size(j, i) * MF(j, i);
      rounding(i) *= epsilon;
    }
    return out;
  };
  kernel::set_zero(down);
  Square W, terms;
  Matrix<Scalar, Step::p, n> Rm;
  for (int j = 0; j < n; ++j) kernel::set_column(Rm, j, step.R_factor.solve(kernel::column_of(at.m_x, j)));
  kernel::multiply(Matrix<Scalar, n, Step::p>(kernel::transposed(at.m_x)), Rm, W);  // m_xᵀ R⁻¹ m_x
  terms = sizes(W) + sizes(bend.m);
  W = kernel::symmetric_part(W) - bend.m;

  Vector<Scalar, n> rounding, d;
  const Square in_b = curvature(B, W, terms, rounding);
  if (negative_direction(in_b, rounding, d)) {
    kernel::set_block(down, n, 0, d);
    return true;
  }
  // (I + W C)⁻¹ W = W - W B (I + Bᵀ W B)⁻¹ Bᵀ W
  kernel::SymmetricFactor<Scalar, n> factor;
  if (!factor.factor(in_b)) return false;  // singular to rounding
  Square WB, scaled, half, right, rest, Wf, X = kernel::zeros<Square>();
  kernel::multiply(W, B, WB);
  factor.right_solve(WB, half, scaled, right);
  kernel::add_symmetric_product<-1>(W, scaled, half, rest);
  kernel::multiply(rest, at.f_x, Wf);
  kernel::add_symmetric_transposed_product<1>(X, at.f_x, Wf, X);
  kernel::multiply(terms, sizes(at.f_x), Wf);
  kernel::multiply(sizes(kernel::transposed(at.f_x)), Wf, terms);
  const Square in_a = curvature(L, X - bend.f, terms + sizes(bend.f), rounding);
  if (!negative_direction(in_a, rounding, d)) return false;
  kernel::set_block(down, 0, 0, d);
  Vector<Scalar, n> delta, moved, Wmoved, b;
  kernel::multiply(L, d, delta);
  kernel::multiply(at.f_x, delta, moved);
  kernel::multiply(W, moved, Wmoved);
  kernel::product(kernel::transposed(B), Wmoved, b);
  kernel::set_block(down, n, 0, Vector<Scalar, n>(-factor.solve(b)));  // b = -(I + Bᵀ W B)⁻¹ Bᵀ W f_x L a
  return true;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
