// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One step of the backward recursion that minimises the criterion J (Rusnak 2015, eq. (5)): what the later
/// data say about a state, as a quadratic V(δ) = ½ δᵀ Λ δ + λᵀ δ about the nominal.
///
/// Whitened disturbances, G w = B b with B Bᵀ = G Q Gᵀ and a term ½|b|² in J. Through x⁺ = f(x) + G w̄ + B b,
/// linearised with A = f_x, minimising over b: with U = Λ B, C = (1 + μ) I + Bᵀ U and g = b̃ + Bᵀ λ,
///     δb = k + K δ,  k = -C⁻¹ g,  K = -C⁻¹ Uᵀ A,
///     λ ← Aᵀ (λ + U k),  Λ ← Aᵀ (Λ - U C⁻¹ Uᵀ) A,  and J can fall by ½ gᵀ C⁻¹ g.
/// Nothing but C is inverted, and C ≥ I: P_0 = 0 and a rank-deficient G Q Gᵀ are ordinary. Where k = 0 for
/// all steps, λ is the costate of the stationarity conditions (12), (13): w = Q Gᵀ λ up to sign. μ is
/// Levenberg-Marquardt damping in the whitened disturbances, free of units.
#pragma once

#include <jml/factors.hpp>

namespace jml::detail {

/// V about the nominal state of one node.
template <typename Scalar, int n>
struct CostToGo {
  Matrix<Scalar, n, n> information = kernel::zeros<Matrix<Scalar, n, n>>();  // Λ
  Vector<Scalar, n> slope = kernel::zeros<Vector<Scalar, n>>();              // λ
};

/// The feedback law δb = offset + gain δ of one step.
template <typename Scalar, int n, int q>
struct Feedback {
  Vector<Scalar, q> offset = kernel::zeros<Vector<Scalar, q>>();
  Matrix<Scalar, q, n> gain = kernel::zeros<Matrix<Scalar, q, n>>();
};

/// What a whole backward pass adds up.
template <typename Scalar>
struct PassSums {
  Scalar cost = 0;      // J of the nominal
  Scalar decrease = 0;  // of J, by the damped quadratic model
};

/// One measurement of the node: mᵀR⁻¹m and -mᵀR⁻¹r.
template <typename Scalar, int n, int p>
JML_INLINE inline void add_measurement(const Matrix<Scalar, p, n>& m_x,
                                       const kernel::SymmetricFactor<Scalar, p>& R,
                                       const Vector<Scalar, p>& residual, CostToGo<Scalar, n>& v) {
  Matrix<Scalar, n, p> mT, half, scaled, mR;
  kernel::repeat<p>([&](int j)
                        JML_INLINE { kernel::repeat<n>([&](int i) JML_INLINE { mT(i, j) = m_x(j, i); }); });
  R.right_solve(mT, half, scaled, mR);                                           // mᵀ R⁻¹
  kernel::add_symmetric_product<1>(v.information, scaled, half, v.information);  // Λ + mᵀ R⁻¹ m
  kernel::add_product<-1>(v.slope, mR, residual, v.slope);                       // λ - mᵀ R⁻¹ r
}

/// The same under a robust loss of slope ρ' and bend β: ρ' mᵀR⁻¹m - β (mᵀR⁻¹r)(mᵀR⁻¹r)ᵀ and -ρ' mᵀR⁻¹r.
template <typename Scalar, int n, int p>
void add_robust_measurement(const Matrix<Scalar, p, n>& m_x, const kernel::SymmetricFactor<Scalar, p>& R,
                            const Vector<Scalar, p>& residual, Scalar slope, Scalar bend,
                            CostToGo<Scalar, n>& v) {
  CostToGo<Scalar, n> plain;
  add_measurement(m_x, R, residual, plain);
  v.information += slope * plain.information - bend * (plain.slope * kernel::transposed(plain.slope));
  v.slope += slope * plain.slope;
}

/// Through one step of the dynamics. `b`: the nominal b̃; `conditional_covariance`: where C⁻¹, the covariance
/// of b given x, is wanted, or null. On return `v`
/// belongs to the earlier node. False where C is not positive definite or not finite.
template <typename Scalar, int n, int q>
JML_INLINE inline bool pass_dynamics(const Matrix<Scalar, n, n>& A, const Matrix<Scalar, n, q>& B,
                                     const Vector<Scalar, q>& b, Scalar damping,
                                     Matrix<Scalar, q, q>* conditional_covariance, CostToGo<Scalar, n>& v,
                                     Feedback<Scalar, n, q>& law, PassSums<Scalar>& sums) {
  Vector<Scalar, n> slope;
  kernel::assign(slope, v.slope);
  Matrix<Scalar, n, n> rest;
  bool regular = true;
  if constexpr (q > 0) {
    Matrix<Scalar, n, q> U, half, scaled, right;
    kernel::product(v.information, B, U);  // U = Λ B
    Matrix<Scalar, q, q> C = kernel::zeros<Matrix<Scalar, q, q>>();
    kernel::repeat<q>([&](int i) JML_INLINE { C(i, i) = Scalar(1) + damping; });
    kernel::add_symmetric_transposed_product<1>(C, B, U, C);  // C = (1 + μ) I + Bᵀ U
    kernel::SymmetricFactor<Scalar, q> factor;
    regular = factor.factor(C);
    factor.right_solve(U, half, scaled, right);  // U C⁻¹
    Vector<Scalar, q> g;
    kernel::add_transposed_product<1>(b, B, slope, g);  // g = b̃ + Bᵀ λ
    const Vector<Scalar, q> Cg = factor.solve(g);       // C⁻¹ g = -k
    kernel::repeat<q>([&](int i) JML_INLINE {
      law.offset(i) = -Cg(i);
      sums.decrease += g(i) * Cg(i) / Scalar(2);
      sums.cost += b(i) * b(i) / Scalar(2);
    });
    if (conditional_covariance != nullptr) {
      for (int j = 0; j < q; ++j)
        kernel::set_column(*conditional_covariance, j,
                           factor.solve(kernel::column_of(kernel::identity<Matrix<Scalar, q, q>>(), j)));
    }
    kernel::add_symmetric_product<-1>(v.information, scaled, half, rest);  // Λ - U C⁻¹ Uᵀ
    kernel::add_product<-1>(slope, U, Cg, slope);                          // λ + U k
    const Matrix<Scalar, q, n> none = kernel::zeros<Matrix<Scalar, q, n>>();
    kernel::add_transposed_product<-1>(none, right, A, law.gain);  // K = -C⁻¹ Uᵀ A
  } else {
    kernel::assign(rest, v.information);
  }
  Matrix<Scalar, n, n> restA;
  kernel::product(rest, A, restA);  // (Λ - U C⁻¹ Uᵀ) A
  const Matrix<Scalar, n, n> none = kernel::zeros<Matrix<Scalar, n, n>>();
  const Vector<Scalar, n> zero = kernel::zeros<Vector<Scalar, n>>();
  kernel::add_symmetric_transposed_product<1>(none, A, restA, v.information);  // Λ ← Aᵀ (Λ - U C⁻¹ Uᵀ) A
  kernel::add_transposed_product<1>(zero, A, slope, v.slope);                  // λ ← Aᵀ (λ + U k)
  return regular;
}

/// (P⁻¹ + information)⁻¹ for a positive semidefinite P of any rank: L (I + Lᵀ Λ L)⁻¹ Lᵀ with P = L Lᵀ.
/// False where that is not finite.
template <typename Scalar, int n>
bool condition(const Matrix<Scalar, n, n>& P, const Matrix<Scalar, n, n>& information,
               Matrix<Scalar, n, n>& out) {
  const Matrix<Scalar, n, n> L = kernel::SemidefiniteFactor<Scalar, n>(P).L;
  const Matrix<Scalar, n, n> LT = kernel::transposed(L);
  Matrix<Scalar, n, n> LTi, C = kernel::identity<Matrix<Scalar, n, n>>(), half, scaled, right;
  kernel::product(LT, information, LTi);            // Lᵀ Λ
  kernel::add_symmetric_product<1>(C, LTi, LT, C);  // C = I + Lᵀ Λ L
  kernel::SymmetricFactor<Scalar, n> factor;
  if (!factor.factor(C)) return false;
  factor.right_solve(L, half, scaled, right);  // L C⁻¹
  const Matrix<Scalar, n, n> none = kernel::zeros<Matrix<Scalar, n, n>>();
  kernel::add_symmetric_product<1>(none, scaled, half, out);  // L C⁻¹ Lᵀ
  return all_finite(out);
}

}  // namespace jml::detail
