// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Observability and controllability of a pair of matrices, and of a model at a point or along a trajectory
/// (Rusnak 2018, section 5: Conjectures 1 and 2, and the Remark).
///
/// The matrices of the Remark are here to be looked at, not to take a rank of: their blocks are powers of F,
/// so that their singular values spread with the unit of time and with n, however observable the pair is.
/// The rank is found by a staircase instead. Starting from the span of L, one block after another of an
/// orthonormal basis of the reachable subspace is made of F times the block before, orthogonalised twice,
/// with the largest remaining column first; no power is ever formed. What is left of a column after
/// that is its pivot: the coupling into a new direction. A pivot below `tolerance` times the norm of its
/// matrix (L in the first block, F after it) is rounding.
///
/// Units go out first. Component i is divided by what unit inputs make of it in one unit of time,
///   d = Σ_k (|F|/α)^k |L| 1, k < n,   with α = max_k (tr |F|^k / n)^{1/k}
/// (rank.hpp where F is nilpotent), which changes along with every choice of units of the states and of time:
/// the pair that is examined, and so ranks and margins, stay the same. An entry of F counts as zero
/// beforehand where every cycle through it is below rounding, beside α: that is so in all units or in none.
/// An entry on no cycle is never rounding: a coupling of 1e-17 is one of 1 in other units.
///
/// Observability of (F, M) is controllability of (Fᵀ, Mᵀ). Both are more than what Conjecture 1 asks
/// (detectable, stabilisable).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/rank.hpp>
#include <jml/factors.hpp>
#include <jml/model/concepts.hpp>
#include <jml/status.hpp>

namespace jml {

/// [M; M F; …; M Fⁿ⁻¹], np×n (Remark of section 5).
template <typename Scalar, int n, int p>
[[nodiscard]] Matrix<Scalar, n * p, n> observability_matrix(const Matrix<Scalar, n, n>& F,
                                                            const Matrix<Scalar, p, n>& M) {
  Matrix<Scalar, n * p, n> out;
  Matrix<Scalar, p, n> block = M;
  for (int k = 0; k < n; ++k) {
    out.template middleRows<p>(k * p) = block;
    block = block * F;
  }
  return out;
}

/// [L, F L, …, Fⁿ⁻¹ L], n×nq, with L = G Q^½ (Remark of section 5).
template <typename Scalar, int n, int q>
[[nodiscard]] Matrix<Scalar, n, n * q> controllability_matrix(const Matrix<Scalar, n, n>& F,
                                                              const Matrix<Scalar, n, q>& L) {
  Matrix<Scalar, n, n * q> out;
  Matrix<Scalar, n, q> block = L;
  for (int k = 0; k < n; ++k) {
    out.template middleCols<q>(k * q) = block;
    block = F * block;
  }
  return out;
}

/// Dimension of the subspace that L reaches through F, with its margin.
template <typename Scalar, int n, int q>
[[nodiscard]] PairRank<Scalar> controllability_rank(const Matrix<Scalar, n, n>& F,
                                                    const Matrix<Scalar, n, q>& L,
                                                    Scalar tolerance = default_rank_tolerance<Scalar, n>) {
  return detail::staircase(F, L, tolerance);
}

/// n less the dimension of what M never sees through F, with its margin.
template <typename Scalar, int n, int p>
[[nodiscard]] PairRank<Scalar> observability_rank(const Matrix<Scalar, n, n>& F,
                                                  const Matrix<Scalar, p, n>& M,
                                                  Scalar tolerance = default_rank_tolerance<Scalar, n>) {
  return detail::staircase(kernel::transposed(F), kernel::transposed(M), tolerance);
}

/// What section 5 of the chapter asks of a model at one point.
template <typename Scalar>
struct SdcExamination {
  Status status = Status::ok;              ///< ok, or what examine_sdc() refused
  PairRank<Scalar> observable_sdc;         ///< (F, M)
  PairRank<Scalar> observable_jacobian;    ///< (f_x, m_x)
  PairRank<Scalar> controllable_sdc;       ///< (F, G Q^½)
  PairRank<Scalar> controllable_jacobian;  ///< (f_x, G Q^½)
  Scalar dynamics_gap = 0;                 ///< ‖f_x - F‖, Frobenius, in the units of the model (Conjecture 2)
  Scalar sensor_gap = 0;                   ///< ‖m_x - M‖, likewise
};

/// Ranks and gaps at x, with F and M about the origin. Q may be singular. Rows of M and m_x are
/// taken in units of the noise (R^-½ M), which changes no rank. `at`: time and control, for a model that
/// reads them.
///
/// Refused: x, f_x, F, m_x or M not finite, Q no covariance, R not positive definite.
template <typename D, typename S, typename Scalar, int n,
          typename At = StepContext<Scalar, DynamicsTraits<D>::controls>>
[[nodiscard]] SdcExamination<Scalar> examine_sdc(const D& d, const S& s, const Vector<Scalar, n>& x,
                                                 const At& at = no_context<Scalar, D>()) {
  static_assert(detail::require_sensor<S>());
  constexpr int q = DynamicsTraits<D>::disturbances, p = measurements_of<S>;
  static_assert(n == states_of<D>, "jml: x has another size than the state of these dynamics");
  SdcExamination<Scalar> out;
  const auto refuse = [&out](Status status) {
    out.status = status;
    return out;
  };
  if (!all_finite(x)) return refuse(Status::invalid_state);
  const Vector<Scalar, n> origin = kernel::zeros<Vector<Scalar, n>>();
  const Matrix<Scalar, n, n> f_x = dynamics_jacobian(d, x, at);
  const Matrix<Scalar, n, n> F = dynamics_sdc<true>(d, x, origin, at);
  if (!all_finite(f_x) || !all_finite(F)) return refuse(Status::dynamics_not_finite);
  const Matrix<Scalar, p, n> m_x = measurement_jacobian(s, x, at);
  const Matrix<Scalar, p, n> M = measurement_sdc<true>(s, x, origin, at);
  if (!all_finite(m_x) || !all_finite(M)) return refuse(Status::sensor_not_finite);

  Matrix<Scalar, p, p> R;
  if constexpr (has_noise_spectral_density<S, Vector<Scalar, n>, At>())
    R = noise_spectral_density(s, x, at);
  else
    R = noise_covariance(s, x, at);
  if (!is_noise_covariance(R)) return refuse(Status::invalid_noise_covariance);
  const kernel::SemidefiniteFactor<Scalar, p> noise(R);
  if (noise.rank < p) return refuse(Status::invalid_noise_covariance);

  out.dynamics_gap = kernel::norm(f_x - F);
  out.sensor_gap = kernel::norm(m_x - M);
  out.observable_sdc = observability_rank(F, detail::in_units_of(noise, M));
  out.observable_jacobian = observability_rank(f_x, detail::in_units_of(noise, m_x));
  if constexpr (q > 0) {
    Matrix<Scalar, q, q> Q;
    if constexpr (ContinuousDynamics<D>)
      Q = disturbance_spectral_density(d, x, at);
    else
      Q = disturbance_covariance(d, x, at);
    const Matrix<Scalar, n, q> G = disturbance_input(d, x, at);
    if (!is_covariance(Q) || !all_finite(G)) return refuse(Status::invalid_disturbance_covariance);
    const kernel::SemidefiniteFactor<Scalar, q> root(Q);
    const Matrix<Scalar, n, q> L = G * root.L;
    out.controllable_sdc = controllability_rank(F, L);
    out.controllable_jacobian = controllability_rank(f_x, L);
  }
  return out;
}

/// The worst of a pair along a trajectory, and when.
template <typename Scalar>
struct WorstRank {
  int rank = -1;                                            ///< smallest rank; -1: no point yet
  Scalar margin = std::numeric_limits<Scalar>::infinity();  ///< smallest margin among the points of that rank
  double time = 0;                                          ///< s, when

  /// Of the time `when`, s.
  void add(const PairRank<Scalar>& pair, double when) {
    if (rank >= 0 && (pair.rank > rank || (pair.rank == rank && !(pair.margin < margin)))) return;
    rank = pair.rank;
    margin = pair.margin;
    time = when;
  }
};

/// The largest of a number along a trajectory, and when.
template <typename Scalar>
struct Largest {
  Scalar value = 0;  ///< 0 at first
  double time = 0;   ///< s

  /// Of the time `when`, s.
  void add(Scalar candidate, double when) {
    if (!(candidate > value)) return;
    value = candidate;
    time = when;
  }
};

/// Conjectures 1 and 2 along a trajectory: add an examination per sample.
template <typename Scalar>
struct SdcAlongTrajectory {
  long points = 0;              ///< that were added
  long refused = 0;             ///< points without an answer; they count nowhere else
  Status refusal = Status::ok;  ///< why the first of them was refused
  /// As in SdcExamination.
  /// @{
  WorstRank<Scalar> observable_sdc, observable_jacobian, controllable_sdc, controllable_jacobian;
  Largest<Scalar> dynamics_gap, sensor_gap;
  /// @}

  /// `time`: s.
  void add(const SdcExamination<Scalar>& at, double time) {
    ++points;
    if (!usable(at.status)) {
      if (refused++ == 0) refusal = at.status;
      return;
    }
    observable_sdc.add(at.observable_sdc, time);
    observable_jacobian.add(at.observable_jacobian, time);
    controllable_sdc.add(at.controllable_sdc, time);
    controllable_jacobian.add(at.controllable_jacobian, time);
    dynamics_gap.add(at.dynamics_gap, time);
    sensor_gap.add(at.sensor_gap, time);
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
