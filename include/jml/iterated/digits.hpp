// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether the digits of Scalar suffice for an exact step: what rounding makes of its P and of its S.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/watched.hpp>
#include <jml/iterated/joint_step.hpp>

namespace jml::detail {

/// What the rounding of N may have grown by in P⁺ = L D Lᵀ (lower triangle read), in its worst direction, and
/// in `spread` that of P⁺ itself. Infinite where a pivot is not positive.
///
/// An entry of P⁺ is right to some ε √(N_ii N_jj). What that makes of a pivot D_i is not ε N_ii alone: it is
/// vᵀ P⁺ v with row i of L⁻¹ as v, and takes ε Σ v_j² N_jj from all states before, s_i = N_ii + Σ_k L_ik²
/// s_k. A pivot that is lost is made of that, and would look large enough beside its own N_ii.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Scalar growth_of(const Matrix<Scalar, n, n>& P, const Matrix<Scalar, n, n>& N,
                                                 Scalar& spread) {
  Matrix<Scalar, n, n> L;
  Scalar sums[n], own[n], grown = 0, lowest = std::numeric_limits<Scalar>::max();
  spread = 0;
  const auto column = [&](int j, Scalar pivot) JML_INLINE {  // of pivot j, once row j of L is there
    const Scalar inverse = Scalar(1) / pivot;
    lowest = pivot < lowest ? pivot : lowest;
    Scalar sum = N(j, j), size = P(j, j);
    kernel::repeat<n, 8>([&](int k) JML_INLINE {
      if (k >= j) return;
      const Scalar square = L(j, k) * L(j, k);
      sum += square * sums[k];
      size += square * own[k];
    });
    sums[j] = sum;
    own[j] = size;
    grown += sum * inverse;  // the sum, which no NaN escapes, for the largest
    spread += size * inverse;
    return inverse;
  };
  if constexpr (n <= 8) {  // written out, in packets of the whole column
    kernel::Column<Scalar, n> entries[n], one;
    Scalar pivots[n];
    kernel::repeat<n, 8>([&](int j) JML_INLINE {
      one.load(&P(0, j));
      kernel::repeat<n, 8>([&](int k) JML_INLINE {
        if (k < j) one.subtract(entries[k], L(j, k));
      });
      one.store(pivots);
      entries[j] = one;
      one.scale(column(j, pivots[j]));
      one.store(&L(0, j));
    });
  } else {
    Matrix<Scalar, n, n> entries;
    for (int j = 0; j < n; ++j) {
      for (int i = j; i < n; ++i) entries(i, j) = P(i, j);
      for (int k = 0; k < j; ++k) {
        for (int i = j; i < n; ++i) entries(i, j) -= entries(i, k) * L(j, k);
      }
      const Scalar inverse = column(j, entries(j, j));
      for (int i = j; i < n; ++i) L(i, j) = entries(i, j) * inverse;
    }
  }
  return lowest >= least_variance<Scalar> ? grown : std::numeric_limits<Scalar>::infinity();
}

/// The same where a state is known exactly, its variance zero in N too: then it counts for nothing.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE Scalar growth_with_zeros(const Matrix<Scalar, n, n>& P,
                                                    const Matrix<Scalar, n, n>& N, Scalar& spread) {
  Matrix<Scalar, n, n> kept = P, from = N;
  for (int i = 0; i < n; ++i) {
    bool zero = N(i, i) == Scalar(0);
    for (int j = 0; j < n; ++j) zero = zero && (i > j ? P(i, j) : P(j, i)) == Scalar(0);
    if (zero) kept(i, i) = from(i, i) = Scalar(1);
  }
  return growth_of(kept, from, spread);
}

/// The most of it that a dense P can bear.
template <typename Scalar>
inline constexpr Scalar worst_growth = iterated_error<Scalar> / std::numeric_limits<Scalar>::epsilon();

/// What the rounding of the prior may be in N = A P Aᵀ + G Q Gᵀ. A correction alone has no such product.
template <typename D, typename Prior>
[[nodiscard]] JML_INLINE inline auto growth_before(const Prior& prior) {
  if constexpr (std::is_same_v<D, Stay<Prior::states>>)
    return typename Prior::Scalar(1);
  else
    return spread_of(prior);
}

/// The digits of S suffice for the gate's question: neither its sums nor its inverse cancel all but a few.
template <typename Visit, typename Scalar, int n, int p>
[[nodiscard]] JML_NOINLINE bool gate_has_digits(const Visit& at, const Matrix<Scalar, n, n>& P,
                                                const Matrix<Scalar, n, n>& noise,
                                                const Matrix<Scalar, p, p>& S, Scalar growth) {
  kernel::SymmetricFactor<Scalar, p> factor;
  if (!factor.factor(S)) return false;
  Matrix<Scalar, n, n> fP, N;
  kernel::product(at.f_x, P, fP);
  kernel::add_symmetric_product<1>(noise, fP, at.f_x, N);  // N = f_x P f_xᵀ + C
  for (int i = 0; i < p; ++i) {
    Scalar terms = 0;  // S_ii, had nothing cancelled
    for (int j = 0; j < n; ++j) terms += std::abs(at.m_x(i, j)) * std::sqrt(std::abs(N(j, j)));
    terms = S(i, i) > terms * terms ? S(i, i) : terms * terms;
    if (!(growth * terms * factor.inverse_diagonal(i) <= worst_growth<Scalar>)) return false;
  }
  return true;
}

/// Where no root was found: the prediction's P or S have lost their digits.
template <typename Step, typename Scalar>
[[nodiscard]] JML_NOINLINE bool short_of_digits(const Step& step, const typename Step::Visit& at,
                                                Scalar growth) {
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime), p = Step::p;
  Matrix<Scalar, n, n> fP, N, P;
  Matrix<Scalar, p, p> S;
  Matrix<Scalar, n, p> gain;
  Scalar condition = 0;
  kernel::product(at.f_x, step.prior.P, fP);
  kernel::add_symmetric_product<1>(step.noise, fP, at.f_x, N);  // N = f_x P f_xᵀ + C
  if (!all_finite(N) || !all_finite(at.m_x)) return false;
  if (!correct_riccati<true>(N, at.m_x, at.m_x, step.R, S, gain, P, condition)) return true;
  Scalar spread = 0;
  kernel::mirror(P);
  return !((growth + condition) * growth_with_zeros(P, N, spread) <= worst_growth<Scalar>);
}

/// S_ii over R_ii from which on a step asks first whether its digits suffice.
template <typename Scalar>
inline constexpr Scalar fine_sensor = Scalar(1e-6) / std::numeric_limits<Scalar>::epsilon();

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
