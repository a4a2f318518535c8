// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a TwoPoint asks beside the minimisation's passes: the way down from a saddle, and covariances.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/two_point_sweep.hpp>

namespace jml::detail {

/// As way_down() of an interval of samples.
template <typename D, typename S, typename Scalar>
[[nodiscard]] JML_RARE bool way_down(const Sweep<TwoPointRecord<D, S, Scalar>>& sweep,
                                     TwoPointRecord<D, S, Scalar>& store) {
  using Store = TwoPointRecord<D, S, Scalar>;
  auto& prior = store.prior();
  kernel::set_zero(prior.law);
  const auto& stop = sweep.stop();
  for (int j = store.last(); j > stop.node; --j) kernel::set_zero(store.node(j).law.offset);
  if (stop.node == 0) return is_negative(prior.L, stop.information, prior.weight, prior.law);
  for (int j = stop.node; j > 0; --j) store.node(j).law = {};
  auto rounding = stop.rounding;
  for (int c = 0; c < Store::m; ++c)
    rounding(c) = Scalar(64 * Store::n) * std::numeric_limits<Scalar>::epsilon() * (Scalar(1) + rounding(c));
  return all_finite(stop.C) && negative_direction(stop.C, rounding, store.node(stop.node).law.offset);
}

/// P of every node given all measurements, forward by the laws: a trajectory of least J is a Markov chain,
/// P⁺ = (A + B K) P (A + B K)ᵀ + B C⁻¹ Bᵀ. False where one is lost.
template <typename D, typename S, typename Scalar>
[[nodiscard]] bool interval_covariances(TwoPointRecord<D, S, Scalar>& store) {
  constexpr int n = DynamicsTraits<D>::states;
  Sweep<TwoPointRecord<D, S, Scalar>> sweep(store, Loss{});
  sweep.keeps_covariances = true;
  PassSums<Scalar> unused;
  if (!sweep.backward(false, Scalar(0), unused)) return false;
  for (int j = 1; j <= store.last(); ++j) {
    auto& node = store.node(j);
    const Matrix<Scalar, n, n> moved = node.closed * store.node(j - 1).P * kernel::transposed(node.closed);
    node.P = kernel::symmetric_part(Matrix<Scalar, n, n>(moved + node.spread));
  }
  return all_finite(store.node(store.last()).P);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
