// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From a stationary trajectory of an interval that is no minimum of J to a lower one beside it.
///
/// The backward pass with the second derivatives of f and m eliminates the unknowns of one step after the
/// other; J has a minimum where the matrix of each, C = I + Bᵀ Λ B, and that of the prior is positive
/// definite. Where one is not, its negative direction, answered by the feedback of the later steps, leads
/// down.
#pragma once

#include <jml/interval/sweep.hpp>
#include <jml/solve/negative_direction.hpp>

namespace jml::detail {

/// A unit d with dᵀ (diag(weight) + Fᵀ Λ F) d < 0, beyond rounding.
template <typename Scalar, int n, int m>
[[nodiscard]] bool is_negative(const Matrix<Scalar, n, m>& F, const Matrix<Scalar, n, n>& information,
                               const Vector<Scalar, m>& weight, Vector<Scalar, m>& d) {
  Matrix<Scalar, m, m> C = kernel::zeros<Matrix<Scalar, m, m>>();
  Vector<Scalar, m> rounding;
  for (int i = 0; i < m; ++i) {
    C(i, i) = rounding(i) = weight(i);
    for (int k = 0; k < n; ++k) {
      for (int l = 0; l < n; ++l) {
        const Scalar part = F(k, i) * information(k, l);
        for (int c = 0; c < m; ++c) C(i, c) += part * F(l, c);
        rounding(i) += std::abs(part * F(l, i));
      }
    }
    rounding(i) *= Scalar(64 * n) * std::numeric_limits<Scalar>::epsilon();
  }
  C = kernel::symmetric_part(C);
  return all_finite(C) && negative_direction(C, rounding, d);
}

/// Where the Hessian of J at the nominal is not positive definite: true, and the laws are those of a
/// direction along which J falls, of unit length where it begins. Second derivatives of f and m included.
template <typename Store>
[[nodiscard]] JML_NOINLINE bool way_down(Store& store, const Loss& loss) {
  using Scalar = typename Store::Number;
  using D = typename Store::Dynamics;
  constexpr int n = states_of<D>, q = DynamicsTraits<D>::disturbances;
  using X = Vector<Scalar, n>;
  const int now = store.now();
  PassSums<Scalar> unused;
  CostToGo<Scalar, n> v;
  if (const Terminal<Scalar, n>* end = store.terminal()) {
    v.information = end->weight;
    v.slope = end->weight * (store.node(store.last()).x[now] - end->target);
  }
  int j = store.last();
  bool found = false;
  for (;; --j) {
    auto& node = store.node(j);
    const X x = node.x[now];
    store.visit(j, [&](const auto& record) {
      add_record<Curvature::full, true>(record, loss, x, end_of(node.at()), unused, v);
    });
    if (j == 0) break;
    if constexpr (q > 0) {
      Vector<Scalar, q> d = kernel::zeros<Vector<Scalar, q>>();
      found = is_negative(store.root(j).B, v.information, kernel::filled<Vector<Scalar, q>>(Scalar(1)), d);
      node.law = {};
      kernel::assign(node.law.offset, d);
    }
    if (found) break;
    Matrix<Scalar, n, n> A, bend;
    dynamics_jacobian_and_hessian(store.dynamics(), X(store.node(j - 1).x[now]), v.slope, node.at(), A, bend);
    if (!pass_dynamics(A, store.root(j).B, node.b[now], Scalar(0), v, node.law, unused)) return false;
    kernel::set_zero(node.law.offset);
    add_symmetric(v.information, bend);
  }
  auto& prior = store.prior();
  kernel::set_zero(prior.law);
  if (!found) return is_negative(prior.L, v.information, prior.weight, prior.law);
  for (--j; j > 0; --j) store.node(j).law = {};
  return true;
}
/// The step of way_down() times `factor`.
template <typename Store, typename Scalar>
void scale_way(Store& store, Scalar factor) {
  constexpr int q = DynamicsTraits<typename Store::Dynamics>::disturbances;
  kernel::scale(store.prior().law, factor, store.prior().law);
  for (int j = 1; j <= store.last(); ++j) {
    auto& offset = store.node(j).law.offset;
    for (int i = 0; i < q; ++i) offset(i) *= factor;
  }
}

/// Where the nominal, stationary, is no minimum of J: to a lower trajectory beside it, on the side on which J
/// falls more. False where it is one, or J falls by less than it is right to.
template <typename Sweep, typename Store, typename Scalar>
[[nodiscard]] JML_NOINLINE bool leave_saddle(Sweep& sweep, Store& store, const Loss& loss, Scalar& cost) {
  if (!way_down(store, loss)) return false;
  const Scalar rounding = Scalar(64) * std::numeric_limits<Scalar>::epsilon() * (std::abs(cost) + Scalar(1));
  for (int halvings = 0; halvings < 20; ++halvings) {
    Scalar unused, ahead = sweep.template forward<false>(unused);
    scale_way(store, Scalar(-1));
    const Scalar back = sweep.template forward<false>(unused);
    if (ahead < back || !std::isfinite(back)) {
      scale_way(store, Scalar(-1));
      ahead = sweep.template forward<false>(unused);
    } else {
      ahead = back;
    }
    if (ahead < cost - rounding) {
      store.flip();
      cost = ahead;
      return true;
    }
    scale_way(store, Scalar(0.5));
  }
  return false;
}

}  // namespace jml::detail
