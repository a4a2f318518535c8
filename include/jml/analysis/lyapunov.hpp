// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The Lyapunov function of the continuous filters, V = ½ xᵀ(P⁻¹ + P⁻ᵀ)x, eq. (30) of Rusnak 2018, and its
/// exact derivative along the filter without input.
///
/// Without input (y = 0), about the origin, f(x) = F x and m(x) = M x, a row A, B, D, E of Table 1 moves
///   ẋ = (F - K M) x,  K = P Dᵀ R⁻¹,   Ṗ = A P + P Bᵀ + G Q Gᵀ - P Dᵀ R⁻¹ E P.
/// V = xᵀ P⁻¹ x, (P⁻¹)˙ = -P⁻¹ Ṗ P⁻¹ and P⁻¹ K = Dᵀ R⁻¹ give
///   V̇ = -xᵀ[(B - F)ᵀ P⁻¹ + P⁻¹ (A - F) + P⁻¹ G Q Gᵀ P⁻¹ + Mᵀ R⁻¹ D Pᵀ P⁻¹ + Dᵀ R⁻¹ (M - E)] x.
/// For RNLS (F, f_x, m_x, M) that is -xᵀ[(f_x - F)ᵀ P⁻¹ + P⁻¹ G Q Gᵀ P⁻¹ + Mᵀ R⁻¹ m_x Pᵀ P⁻¹] x. The printed
/// (31) exchanges factors of the last term: it is equal where Mᵀ R⁻¹ m_x is symmetric (one measurement whose
/// M and m_x are parallel) and not in general. For the SDDRE row of a symmetric P it is (28) without the
/// factor ½ that (27) has. P⁻¹ is only ever applied to x.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>
#include <jml/riccati/gain_rule.hpp>
#include <jml/riccati/process_noise.hpp>
#include <jml/status.hpp>

namespace jml {

/// V of eq. (30) and its derivative along the filter without input, per second.
template <typename Scalar>
struct LyapunovReport {
  Status status = Status::ok;  ///< ok, or what lyapunov() refused
  Scalar value = 0;            ///< V
  Scalar rate = 0;             ///< V̇
};

/// The matrices of a filter at one point, for lyapunov().
template <typename Scalar, int n, int p>
struct LyapunovMatrices {
  Matrix<Scalar, n, n> A;      ///< slot of the rule
  Matrix<Scalar, n, n> B;      ///< slot of the rule
  Matrix<Scalar, p, n> D;      ///< slot of the rule
  Matrix<Scalar, p, n> E;      ///< slot of the rule
  Matrix<Scalar, n, n> F;      ///< f(x) = F x
  Matrix<Scalar, p, n> M;      ///< m(x) = M x
  Matrix<Scalar, n, n> noise;  ///< G Q Gᵀ
  Matrix<Scalar, p, p> R;      ///< of the sensor
};

/// V and V̇ at x for a Riccati matrix P that moves by the rule's own equation.
///
/// Refused: P singular to rounding or not finite (V is not defined), R not positive definite.
template <typename Scalar, int n, int p>
[[nodiscard]] LyapunovReport<Scalar> lyapunov(const Vector<Scalar, n>& x, const Matrix<Scalar, n, n>& P,
                                              const LyapunovMatrices<Scalar, n, p>& at) {
  if (!all_finite(x)) return {Status::invalid_state};
  if (!all_finite(P)) return {Status::invalid_covariance};
  if (!is_noise_covariance(at.R)) return {Status::invalid_noise_covariance};
  Vector<Scalar, n> unit = kernel::absolute(kernel::diagonal(P));
  if constexpr (n > 1) {  // the factors' own convention
    for (int i = 0; i < n; ++i) unit(i) = std::sqrt(unit(i));
  }
  kernel::GeneralFactor<Scalar, n> factor, transposed;
  if (!factor.factor(P, unit) || !transposed.factor(kernel::transposed(P), unit))
    return {Status::invalid_covariance};
  kernel::SymmetricFactor<Scalar, p> noise;
  if (!noise.factor(at.R)) return {Status::invalid_noise_covariance};

  const Vector<Scalar, n> z = factor.solve(x), z_t = transposed.solve(x);  // P⁻¹ x, P⁻ᵀ x
  const Vector<Scalar, p> seen = noise.solve(Vector<Scalar, p>(at.M * x));
  const Vector<Scalar, p> missed = noise.solve(Vector<Scalar, p>((at.M - at.E) * x));
  LyapunovReport<Scalar> out;
  using kernel::dot;
  out.value = dot(x, z);
  out.rate = -dot((at.B - at.F) * x, z) - dot(z_t, (at.A - at.F) * x) - dot(z_t, at.noise * z) -
             dot(seen, at.D * (kernel::transposed(P) * z)) - dot(at.D * x, missed);
  if (!std::isfinite(out.value) || !std::isfinite(out.rate)) out.status = Status::dynamics_not_finite;
  return out;
}

/// The same for a model and a row of Table 1 (Ekf, Sddre, Jml, or a GainRule of the user's). RNLS is the row
/// Jml of a continuous model. Needs f(0) = 0 and m(0) = 0; x is the estimate, `at` time and control.
template <OnePassRule Rule, ContinuousDynamics D, typename S, typename Scalar, int n,
          typename At = StepContext<Scalar, DynamicsTraits<D>::controls>>
[[nodiscard]] LyapunovReport<Scalar> lyapunov(const Rule& rule, const D& d, const S& s,
                                              const Vector<Scalar, n>& x, const Matrix<Scalar, n, n>& P,
                                              const At& at = no_context<Scalar, D>()) {
  static_assert(detail::require_continuous<D>() && detail::require_sensor<S>());
  static_assert(n == states_of<D>, "jml: x has another size than the state of these dynamics");
  if (!all_finite(x)) return {Status::invalid_state};
  const Vector<Scalar, n> origin = kernel::zeros<Vector<Scalar, n>>();
  LyapunovMatrices<Scalar, n, measurements_of<S>> m;
  m.A = dynamics_slot<Rule::A>(rule, d, x, x, at);
  m.B = dynamics_slot<Rule::B>(rule, d, x, x, at);
  m.F = dynamics_sdc<true>(d, x, origin, at);
  if (!all_finite(m.A) || !all_finite(m.B) || !all_finite(m.F)) return {Status::dynamics_not_finite};
  m.D = sensor_slot<Rule::D>(rule, s, x, x, at);
  m.E = sensor_slot<Rule::E>(rule, s, x, x, at);
  m.M = measurement_sdc<true>(s, x, origin, at);
  if (!all_finite(m.D) || !all_finite(m.E) || !all_finite(m.M)) return {Status::sensor_not_finite};
  m.R = noise_spectral_density(s, x, at);
  const ProcessNoise<Scalar, D> noise(d);
  if (!noise.with(d, x, at, [&m](const auto& GQG) { m.noise = GQG; }))
    return {Status::invalid_disturbance_covariance};
  return lyapunov(x, P, m);
}

}  // namespace jml
#include <jml/warnings_end.hpp>
