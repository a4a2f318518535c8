// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One step of the dynamics in the backward pass of an interval, where J has a term of its disturbance beside
/// ½|b|².
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/costate.hpp>

namespace jml::detail {

/// φ(b) of one step: its value, slope and curvature at b.
template <typename Scalar, int q>
struct DisturbanceTerm {
  Scalar cost = 0;
  bool acts = false;  // slope or curvature is not zero
  Vector<Scalar, q> slope = kernel::zeros<Vector<Scalar, q>>();
  Matrix<Scalar, q, q> curvature = kernel::zeros<Matrix<Scalar, q, q>>();
};

/// A store of interval/sweep.hpp with disturbance_term(j, b): φ of the step to node j.
template <typename Store>
concept WeighsDisturbances = requires { requires Store::weighs_disturbances; };

/// N with N⁻ᵀ N⁻¹ = I + W. False where that is not finite.
template <typename Scalar, int q>
[[nodiscard]] bool unit_of(const Matrix<Scalar, q, q>& W, Matrix<Scalar, q, q>& N) {
  Matrix<Scalar, q, q> C = kernel::symmetric_part(W);
  kernel::add_to_diagonal(C, Scalar(1));
  kernel::SymmetricFactor<Scalar, q> factor;
  if (!factor.factor(C)) return false;  // L D Lᵀ, and N = L⁻ᵀ D^-½
  for (int c = 0; c < q; ++c) {
    for (int i = q - 1; i >= 0; --i) {
      Scalar sum = i == c ? Scalar(1) : Scalar(0);
      for (int k = i + 1; k < q; ++k) sum -= factor.lower(k, i) * N(k, c);
      N(i, c) = sum;
    }
    const Scalar unit = std::sqrt(factor.inverse_diagonal(c));
    for (int i = 0; i < q; ++i) N(i, c) *= unit;
  }
  return all_finite(N);
}

/// pass(B, b̃) is a step of the backward recursion for whitened disturbances. With φ it goes in the
/// coordinates c, b = N c, in which ½|b|² + φ is ½|c + Nᵀ(b̃ + φ')|² to second order about b̃, and the law
/// comes back as that of b.
template <typename Store, typename Scalar, int n, int q, typename Pass>
JML_INLINE inline bool through_step(Store& store, int j, const Vector<Scalar, q>& b,
                                    [[maybe_unused]] Feedback<Scalar, n, q>& law,
                                    [[maybe_unused]] PassSums<Scalar>& sums, const Pass& pass) {
  const auto& B = store.root(j).B;
  if constexpr (WeighsDisturbances<Store>) {
    const DisturbanceTerm<Scalar, q> term = store.disturbance_term(j, b);
    if (!term.acts) {
      sums.cost += term.cost;
      return pass(B, b);
    }
    Matrix<Scalar, q, q> N = kernel::zeros<Matrix<Scalar, q, q>>();
    if (!unit_of(term.curvature, N)) return false;
    const Matrix<Scalar, n, q> turned = B * N;
    const Vector<Scalar, q> nominal = kernel::transposed(N) * Vector<Scalar, q>(b + term.slope);
    sums.cost += term.cost + (kernel::squared_norm(b) - kernel::squared_norm(nominal)) / Scalar(2);
    const bool valid = pass(turned, nominal);
    law.offset = N * law.offset;
    law.gain = N * law.gain;
    return valid;
  } else {
    return pass(B, b);
  }
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
