// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The one difference recursion behind Kalman, EKF, SDDRE and JML (Rusnak 2015, Table 1), in gain form.
///
/// N = A P Bᵀ + G Q Gᵀ; S = R + E N Dᵀ; K = N Dᵀ S⁻¹; P⁺ = N - K E N, which is [N⁻¹ + Dᵀ R⁻¹ E]⁻¹ without
/// inverting N: P_0 = 0 and a rank-deficient G Q Gᵀ are ordinary, and P⁺ Dᵀ R⁻¹ = K. (The print of (7) has
/// P_i in the update; it is P_{i+1}.) A symmetric rule factors S = L D Lᵀ and mirrors one triangle, so P
/// stays exactly symmetric; a nonsymmetric one uses LU with column exchanges.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/estimate.hpp>
#include <jml/factors.hpp>
#include <jml/riccati/gain_rule.hpp>
#include <jml/riccati/process_noise.hpp>
#include <jml/strips.hpp>

namespace jml {

/// Nobody asks what a step used. An observer is handed A by a prediction, and by a correction that is used
/// the prediction, the slot D, R and the innovation (the smoother's is).
struct Unobserved {
  /// Nothing is done.
  /// @{
  template <typename A>
  constexpr void transition(const A&) const {}
  template <typename X, typename D, typename R, typename Innovation>
  constexpr void correction(const X&, const D&, const R&, const Innovation&) const {}
  /// @}
};

namespace detail {

/// √R_ii, the unit of each component for a pivot test; with p = 1 no unit is needed but R's own, and no root.
template <typename Scalar, int p>
Vector<Scalar, p> noise_units(const Matrix<Scalar, p, p>& R) {
  if constexpr (p == 1)
    return R;
  else {
    Vector<Scalar, p> units;
    for (int i = 0; i < p; ++i) units(i) = std::sqrt(R(i, i));
    return units;
  }
}

/// The most that a pivot of S = L D Lᵀ is less than what it came from, through L all that those before it
/// did.
template <typename Scalar, int p>
[[nodiscard]] JML_NOINLINE Scalar grown_by_pivots(const Matrix<Scalar, p, p> S,
                                                  const kernel::SymmetricFactor<Scalar, p> factor,
                                                  Scalar condition) {
  Vector<Scalar, p> from;
  for (int i = 0; i < p; ++i) {
    from(i) = S(i, i);
    for (int k = 0; k < i; ++k) from(i) += factor.lower(i, k) * factor.lower(i, k) * from(k);
    const Scalar share = from(i) * factor.inverse_diagonal(i);
    condition = share > condition ? share : condition;
  }
  return condition;
}

/// K and P⁺ from N: the algebra of one correction, for slots D and E (p×n). `condition`: of S, by its pivots.
/// Of a symmetric rule the lower triangle of P⁺ alone, which its pivots are asked of before it is mirrored.
/// False where S is singular (or, in a symmetric rule, not positive definite).
template <bool symmetric, typename Scalar, int n, int p>
JML_INLINE inline bool correct_riccati(const Matrix<Scalar, n, n>& N, const Matrix<Scalar, p, n>& slot_d,
                                       const Matrix<Scalar, p, n>& slot_e, const Matrix<Scalar, p, p>& R,
                                       Matrix<Scalar, p, p>& S, Matrix<Scalar, n, p>& gain,
                                       Matrix<Scalar, n, n>& P, Scalar& condition) {
  Matrix<Scalar, n, p> ND;
  kernel::product_transposed(N, slot_d, ND);  // N Dᵀ
  if constexpr (symmetric) {
    kernel::add_product<1>(R, slot_d, ND, S);  // S = R + D N Dᵀ
    kernel::SymmetricFactor<Scalar, p> factor;
    if (!factor.factor(S)) return false;
    condition = Scalar(1);
    if constexpr (p > 1) {
      kernel::repeat<p>([&](int i) JML_INLINE {
        const Scalar share = S(i, i) * factor.inverse_diagonal(i);
        condition = share > condition ? share : condition;
      });
      if (p > 2 && condition > Scalar(2)) condition = grown_by_pivots(S, factor, condition);
    }
    Matrix<Scalar, n, p> v, scaled;
    factor.right_solve(ND, v, scaled, gain);         // K = N Dᵀ S⁻¹
    kernel::add_lower_product<-1>(N, scaled, v, P);  // P⁺ = N - (N Dᵀ) S⁻¹ (N Dᵀ)ᵀ
  } else {
    kernel::add_product<1>(R, slot_e, ND, S);  // S = R + E N Dᵀ
    kernel::GeneralFactor<Scalar, p> factor;
    if (!factor.factor(S, noise_units(R))) return false;
    condition = Scalar(1);
    if constexpr (p > 1) {
      for (int i = 0; i < p; ++i) {
        const Scalar share = std::abs(S(i, factor.order[i]) * factor.inverse_diagonal(i));
        condition = share > condition ? share : condition;
      }
    }
    factor.right_solve(ND, gain);  // K = N Dᵀ S⁻¹
    Matrix<Scalar, p, n> EN;
    kernel::product(slot_e, N, EN);           // E N
    kernel::add_product<-1>(N, gain, EN, P);  // P⁺ = N - K E N
  }
  return true;
}

/// A prediction's P is finite and, in a symmetric rule, has no negative variance. (A zero is right where the
/// dynamics forget a state.)
template <bool symmetric, typename Scalar, int n>
JML_INLINE inline bool is_valid(const Matrix<Scalar, n, n>& P) {
  if constexpr (symmetric) {
    bool positive = true;
    kernel::repeat<n>([&](int i) JML_INLINE { positive &= P(i, i) >= Scalar(0); });
    if (!positive) return false;
  }
  return all_finite(P);
}

template <typename Rule, typename Traits>
consteval bool require_linear_if_kalman() {
  if constexpr (requires { Rule::linear_only; }) {
    static_assert(
        Traits::linear,
        "jml: Kalman is for linear models: say `static constexpr bool linear = true;` in it, or use Ekf");
  }
  return true;
}

/// Nobody asks for the sizes of what N came from.
struct NoSizes {};

/// predict() into the caller's x̄ and N, which are touched on refusal too and not asked to be finite: a NaN
/// goes through every later line, so the hot path looks for it once, at its end, and only then asks where it
/// came from. `sizes`: Σ A² P_jj + (G Q Gᵀ)_ii, which is more than N_ii where that cancels.
template <typename Rule, typename D, typename Scalar, int n, typename At, typename Sizes,
          typename Observer = Unobserved>
JML_INLINE inline Status predict_into(const Rule& rule, const D& d,
                                      const ProcessNoise<Scalar, D>& process_noise,
                                      const Estimate<Scalar, n>& prior, const At& at, Vector<Scalar, n>& x,
                                      Matrix<Scalar, n, n>& N, Sizes& sizes, const Observer& observer = {}) {
  kernel::assign(x, predicted_state(d, prior.x, at));
  const Vector<Scalar, n>& point = Rule::evaluated_at == EvaluatedAt::estimate ? prior.x : x;
  const Matrix<Scalar, n, n> A = dynamics_slot<Rule::A>(rule, d, point, prior.x, at);
  observer.transition(A);
  Matrix<Scalar, n, n> AP;
  kernel::product(A, prior.P, AP);  // A P
  const bool valid = process_noise.with(d, prior.x, at, [&](const Matrix<Scalar, n, n>& noise) JML_INLINE {
    if constexpr (!std::is_same_v<Sizes, NoSizes>) {
      kernel::assign(sizes, kernel::diagonal(noise));
      kernel::add_weighted_squares(A, kernel::diagonal(prior.P), sizes);
    }
    if constexpr (Rule::symmetric) {
      kernel::add_symmetric_product<1>(noise, AP, A, N);  // N = A P Aᵀ + G Q Gᵀ
    } else {
      // N = A P Bᵀ + G Q Gᵀ
      kernel::add_product_transposed<1>(noise, AP, dynamics_slot<Rule::B>(rule, d, point, prior.x, at), N);
    }
  });
  return valid ? Status::ok : Status::invalid_disturbance_covariance;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
