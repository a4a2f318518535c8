// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How much rounding changes the curvature of J, where the bound of the backward pass is too large to tell.
#pragma once

#include <jml/interval/linearised.hpp>
#include <jml/interval/record_terms.hpp>

namespace jml::detail {

/// What Sweep::backward() bounds, to first order: see count_rounding(). Infinite where C is not positive
/// definite.
template <typename Store>
[[nodiscard]] JML_NOINLINE typename Store::Number curvature_noise(Store& store, const Loss& loss) {
  using D = typename Store::Dynamics;
  using Scalar = typename Store::Number;
  constexpr int n = states_of<D>, q = DynamicsTraits<D>::disturbances;
  constexpr Scalar infinite = std::numeric_limits<Scalar>::infinity();
  const int now = store.now();
  CostToGo<Scalar, n> v;
  PassSums<Scalar> sums;
  if (const Terminal<Scalar, n>* end = store.terminal()) v.information = end->weight;
  for (int j = store.last();; --j) {
    const auto& node = store.node(j);
    store.visit(j, [&](const auto& record) {
      add_record<Curvature::none, false>(record, loss, node.x[now], end_of(node.at()), sums, v);
    });
    if (j == 0) break;
    Feedback<Scalar, n, q> law;
    if (!pass_dynamics<Counted::closely>(step_jacobian(store, j), store.root(j).B,
                                         kernel::zeros<Vector<Scalar, q>>(), Scalar(0), v, law, sums))
      return infinite;
  }
  return prior_noise(store.prior(), v, sums.noise, infinite);
}

}  // namespace jml::detail
