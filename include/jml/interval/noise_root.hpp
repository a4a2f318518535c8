// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// B with B Bᵀ = G Q Gᵀ: the input matrix of whitened disturbances, G w = B b, for a G Q Gᵀ of any rank.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>
#include <jml/riccati/process_noise.hpp>

namespace jml::detail {

/// B (n×q) and G w̄ (n) of one step; all that the criterion J asks of the noise of the dynamics.
template <typename Scalar, typename D>
struct NoiseRoot {
  using Traits = DynamicsTraits<D>;
  static constexpr int n = Traits::states, q = Traits::disturbances;
  using X = Vector<Scalar, n>;
  using At = Context<Scalar, D>;
  static constexpr bool has_mean = has_disturbance_mean<D, X, At>();
  /// The same at every state and time.
  static constexpr bool constant = ProcessNoise<Scalar, D>::constant && !has_mean;

  Matrix<Scalar, n, q> B = kernel::zeros<Matrix<Scalar, n, q>>();
  Vector<Scalar, n> mean_effect = kernel::zeros<Vector<Scalar, n>>();

  /// L with L Lᵀ = Q, q×q: w = L b. False where Q is no covariance.
  static bool root_of_covariance(const D& d, const X& x, const At& at, Matrix<Scalar, q, q>& L) {
    const Matrix<Scalar, q, q> Q = disturbance_covariance(d, x, at);
    if (!is_covariance(Q)) return false;
    L = kernel::SemidefiniteFactor<Scalar, q>(Q).L;
    return true;
  }

  /// Frozen at x. False where Q is no covariance or G is not finite.
  bool form(const D& d, const X& x, const At& at) {
    if constexpr (q > 0) {
      Matrix<Scalar, q, q> L;
      if (!root_of_covariance(d, x, at, L)) return false;
      kernel::product(disturbance_input(d, x, at), L, B);  // B = G L
    }
    if constexpr (has_mean) mean_effect = predicted_state(d, x, at) - dynamics(d, x, at);
    return all_finite(B) && all_finite(mean_effect);
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
