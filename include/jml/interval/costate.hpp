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
/// all steps, λ is the costate of the two-point problem, eq. (12) of Rusnak 2018, at the nodes: w = Q Gᵀ λ up
/// to sign. μ is Levenberg-Marquardt damping in the whitened disturbances, free of units.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>
#include <jml/model/dual.hpp>

namespace jml::detail {

/// V about the nominal state of one node.
template <typename Scalar, int n>
struct CostToGo {
  Matrix<Scalar, n, n> information = kernel::zeros<Matrix<Scalar, n, n>>();  // Λ
  Vector<Scalar, n> slope = kernel::zeros<Vector<Scalar, n>>();              // λ
  /// Every vᵀ (error of Λ) v is at most ε (Σ noise |v|)²: rounding of Λ is some ε of the terms that it came
  /// from, whatever is left of it. Counted where it was asked for.
  Vector<Scalar, n> noise = kernel::zeros<Vector<Scalar, n>>();
  Vector<Scalar, n> peak = kernel::zeros<Vector<Scalar, n>>();  // the largest of it so far
  /// The same as a matrix: the error is at most ε N, to first order.
  Matrix<Scalar, n, n> rounding = kernel::zeros<Matrix<Scalar, n, n>>();
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
  Scalar cost = 0;      // J of the nominal, where rounding is not ignored
  Scalar decrease = 0;  // of J, by the damped quadratic model
  Scalar noise = 0;     // ε times this: rounding in the curvature of J, relative, in its worst direction
};

/// Above this share of rounding in its curvature J is gone through in twice the digits.
template <typename Scalar>
inline constexpr Scalar most_noise = std::is_same_v<Scalar, float> ? Scalar(1e-2) : Scalar(1e-7);

/// One measurement of the node: mᵀR⁻¹m and -mᵀR⁻¹r, with R = L D Lᵀ.
template <typename Scalar, int n, int p>
JML_INLINE inline void add_measurement(const Matrix<Scalar, p, n>& m_x,
                                       const kernel::SymmetricFactor<Scalar, p>& R,
                                       const Vector<Scalar, p>& residual, CostToGo<Scalar, n>& v) {
  if constexpr (n <= 3 && p <= 3) {  // without the entries of m that the compiler knows to be zero
    Matrix<Scalar, n, p> half, scaled;
    Vector<Scalar, p> e;
    kernel::repeat<p>([&](int j) JML_INLINE {
      e(j) = residual(j);
      kernel::repeat<p>([&](int k) JML_INLINE {
        if (k < j) e(j) -= R.lower(j, k) * e(k);  // L⁻¹ r
      });
      kernel::repeat<n>([&](int i) JML_INLINE {
        Scalar sum = m_x(j, i);
        kernel::repeat<p>([&](int k) JML_INLINE {
          if (k < j && !surely_zero(half(i, k))) sum -= half(i, k) * R.lower(j, k);
        });
        half(i, j) = sum;                                                           // mᵀ L⁻ᵀ
        scaled(i, j) = surely_zero(sum) ? Scalar(0) : sum * R.inverse_diagonal(j);  // mᵀ L⁻ᵀ D⁻¹
        if (!surely_zero(sum)) v.slope(i) -= scaled(i, j) * e(j);                   // λ - mᵀ R⁻¹ r
      });
    });
    kernel::repeat<n>([&](int j) JML_INLINE {
      kernel::repeat<n>([&](int i) JML_INLINE {
        if (i < j) return;
        kernel::repeat<p>([&](int k) JML_INLINE {  // Λ + mᵀ R⁻¹ m
          if (!surely_zero(half(i, k)) && !surely_zero(half(j, k)))
            v.information(i, j) += scaled(i, k) * half(j, k);
        });
        v.information(j, i) = v.information(i, j);
      });
    });
  } else {
    Matrix<Scalar, n, p> mT, half, scaled, mR;
    kernel::repeat<p>([&](int j)
                          JML_INLINE { kernel::repeat<n>([&](int i) JML_INLINE { mT(i, j) = m_x(j, i); }); });
    R.right_solve(mT, half, scaled, mR);                                           // mᵀ R⁻¹
    kernel::add_symmetric_product<1>(v.information, scaled, half, v.information);  // Λ + mᵀ R⁻¹ m
    kernel::add_product<-1>(v.slope, mR, residual, v.slope);                       // λ - mᵀ R⁻¹ r
  }
}

/// What it adds under a robust loss of slope ρ' and bend β: ρ' mᵀR⁻¹m - β (mᵀR⁻¹r)(mᵀR⁻¹r)ᵀ and -ρ' mᵀR⁻¹r.
/// (Matrices by value: what the usual pass works on stays in registers.)
template <typename Scalar, int n, int p>
[[nodiscard]] JML_NOINLINE CostToGo<Scalar, n> robust_measurement(const Matrix<Scalar, p, n> m_x,
                                                                  const kernel::SymmetricFactor<Scalar, p>& R,
                                                                  const Vector<Scalar, p> residual,
                                                                  Scalar slope, Scalar bend) {
  CostToGo<Scalar, n> plain;
  add_measurement(m_x, R, residual, plain);
  plain.information = slope * plain.information - bend * (plain.slope * kernel::transposed(plain.slope));
  plain.slope = slope * plain.slope;
  return plain;
}

/// What a backward pass says of its rounding.
///   ignored  nothing: C may be indefinite, and J of the nominal is known, too
///   bounded  a bound that takes C ≥ I for C, and A for the closed loop: an error of Λ goes through the step
///            as Λ does
///   counted  to first order
enum class Rounding { ignored, bounded, counted };

/// What of ε N reaches the unknowns b is Bᵀ N B against C = I + Bᵀ Λ B; and through the step an error goes as
/// Λ does, N ← (A + B K)ᵀ N (A + B K), to which the rounding of what is left adds the diagonal of
/// Aᵀ diag(Λ) A. Over all steps the sum is Σ tr(ε diag(Λ) P) with the covariances P given all data, and that
/// of what was left. `minus_C`: -C, factored. Returns what is added to sums.noise.
template <typename Scalar, int n, int q>
[[nodiscard]] JML_INLINE inline Scalar count_rounding(const Matrix<Scalar, n, n>& A,
                                                      const Matrix<Scalar, n, q>& B,
                                                      const kernel::SymmetricFactor<Scalar, q>& minus_C,
                                                      const Matrix<Scalar, q, n>& gain,
                                                      const Matrix<Scalar, n, n>& information,
                                                      Matrix<Scalar, n, n>& rounding) {
  Scalar noise = 0;
  Matrix<Scalar, n, n> closed, moved, fresh = kernel::zeros<Matrix<Scalar, n, n>>();
  kernel::assign(closed, A);
  kernel::repeat<n>([&](int i) JML_INLINE {
    rounding(i, i) += information(i, i);
    kernel::repeat<n>([&](int k) JML_INLINE { fresh(i, i) += A(k, i) * A(k, i) * information(k, k); });
  });
  if constexpr (q > 0) {
    Matrix<Scalar, n, q> half, scaled, right, reached;
    minus_C.right_solve(B, half, scaled, right);
    kernel::product(rounding, half, reached);
    kernel::repeat<q>([&](int c) JML_INLINE {  // tr(C⁻¹ Bᵀ N B)
      kernel::repeat<n>([&](int i) JML_INLINE { noise -= scaled(i, c) * reached(i, c); });
    });
    kernel::add_product<1>(A, B, gain, closed);
  }
  kernel::product(rounding, closed, moved);
  kernel::add_symmetric_transposed_product<1>(fresh, closed, moved, rounding);
  return noise;
}
/// The same apart, where the matrices are large.
template <typename Scalar, int n, int q>
[[nodiscard]] JML_RARE Scalar count_rounding_apart(const Matrix<Scalar, n, n>& A,
                                                   const Matrix<Scalar, n, q>& B,
                                                   const kernel::SymmetricFactor<Scalar, q>& minus_C,
                                                   const Matrix<Scalar, q, n>& gain,
                                                   const Matrix<Scalar, n, n>& information,
                                                   Matrix<Scalar, n, n>& rounding) {
  return count_rounding(A, B, minus_C, gain, information, rounding);
}

/// Through one step of the dynamics. `b`: the nominal b̃. On return `v` belongs to the earlier node. False
/// where C is not positive definite or not finite, and `v` is then as it was where rounding is ignored.
template <Rounding rounding = Rounding::ignored, typename Scalar, int n, int q>
JML_INLINE inline bool pass_dynamics(const Matrix<Scalar, n, n>& A, const Matrix<Scalar, n, q>& B,
                                     const Vector<Scalar, q>& b, Scalar damping, CostToGo<Scalar, n>& v,
                                     Feedback<Scalar, n, q>& law, PassSums<Scalar>& sums) {
  Vector<Scalar, n> slope;
  kernel::assign(slope, v.slope);
  Matrix<Scalar, n, n> rest, half_way;
  bool regular = true;
  kernel::SymmetricFactor<Scalar, q> factor;
  if constexpr (q > 0) {
    Matrix<Scalar, n, q> U, half, scaled, right;
    kernel::product(v.information, B, U);  // U = Λ B
    Matrix<Scalar, q, q> C = kernel::zeros<Matrix<Scalar, q, q>>();
    kernel::repeat<q>([&](int i) JML_INLINE { C(i, i) = Scalar(1) + damping; });
    kernel::add_symmetric_transposed_product<1>(C, B, U, C);  // C = (1 + μ) I + Bᵀ U
    regular = factor.factor(C);
    if constexpr (rounding == Rounding::ignored) {
      if (!regular) return false;
    }
    kernel::scale(factor.inverse_diagonal, Scalar(-1), factor.inverse_diagonal);  // now of -C
    Vector<Scalar, q> g;
    kernel::add_transposed_product<1>(b, B, slope, g);  // g = b̃ + Bᵀ λ
    const Vector<Scalar, q> k = factor.solve(g);        // -C⁻¹ g
    kernel::assign(law.offset, k);
    sums.decrease -= kernel::dot(g, k) / Scalar(2);
    if constexpr (rounding != Rounding::ignored) sums.cost += kernel::squared_norm(b) / Scalar(2);
    if constexpr (rounding == Rounding::ignored && n <= 3 && q <= 3) {
      // By W = Aᵀ U, where that is cheap: Aᵀ Λ A does not wait for C, and a step waits for the one before it.
      Matrix<Scalar, n, q> W;
      kernel::transposed_product(A, U, W);
      kernel::product(v.information, A, half_way);
      kernel::symmetric_transposed_product(A, half_way, rest);
      factor.right_solve(W, half, scaled, right);  // -W C⁻¹ = Kᵀ
      kernel::assign(law.gain, kernel::transposed(right));
      kernel::add_symmetric_product<1>(rest, scaled, half, v.information);  // Aᵀ Λ A - W C⁻¹ Wᵀ
      kernel::transposed_product(A, slope, v.slope);
      kernel::add_product<1>(v.slope, W, k, v.slope);  // Aᵀ λ + W k
      return true;
    }
    factor.right_solve(U, half, scaled, right);                           // -U C⁻¹
    kernel::add_symmetric_product<1>(v.information, scaled, half, rest);  // Λ - U C⁻¹ Uᵀ
    kernel::add_product<1>(slope, U, k, slope);                           // λ + U k
    kernel::transposed_product(right, A, law.gain);                       // K = -C⁻¹ Uᵀ A
  } else {
    kernel::assign(rest, v.information);
  }
  if constexpr (rounding == Rounding::counted) {
    if constexpr (n <= 3 && q <= 3)
      sums.noise += count_rounding(A, B, factor, law.gain, v.information, v.rounding);
    else
      sums.noise += count_rounding_apart(A, B, factor, law.gain, v.information, v.rounding);
  }
  if constexpr (rounding == Rounding::bounded) {
    Vector<Scalar, n> size, before = kernel::zeros<Vector<Scalar, n>>();
    kernel::repeat<n>([&](int i) JML_INLINE {
      size(i) = v.noise(i) + std::sqrt(v.information(i, i));
      v.peak(i) = size(i) > v.peak(i) ? size(i) : v.peak(i);
    });
    kernel::repeat<n>([&](int i) JML_INLINE {  // |A|ᵀ size
      kernel::repeat<n>([&](int k) JML_INLINE { before(i) += std::abs(A(k, i)) * size(k); });
    });
    kernel::assign(v.noise, before);
  }
  kernel::product(rest, A, half_way);                                // (Λ - U C⁻¹ Uᵀ) A
  kernel::symmetric_transposed_product(A, half_way, v.information);  // Λ ← Aᵀ (Λ - U C⁻¹ Uᵀ) A
  kernel::transposed_product(A, slope, v.slope);                     // λ ← Aᵀ (λ + U k)
  return regular;
}

/// (P⁻¹ + information)⁻¹ for a positive semidefinite P: L (I + Lᵀ Λ L)⁻¹ Lᵀ with P = L Lᵀ. False where that
/// is not finite, and where P is singular but for states that are known exactly: L is not right to rounding.
template <typename Scalar, int n>
bool condition(const Matrix<Scalar, n, n>& P, const Matrix<Scalar, n, n>& information,
               Matrix<Scalar, n, n>& out) {
  const kernel::SemidefiniteFactor<Scalar, n> root(P);
  int unknown = 0;
  for (int i = 0; i < n; ++i) unknown += P(i, i) > Scalar(0);
  if (root.rank < unknown) return false;
  const Matrix<Scalar, n, n>& L = root.L;
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
#include <jml/warnings_end.hpp>
