// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From a stationary trajectory of an interval that is no minimum of J to a lower one beside it.
///
/// The backward pass with the second derivatives of f and m eliminates the unknowns of one step after the
/// other; J has a minimum where the matrix of each, C = I + Bᵀ Λ B, and that of the prior is positive
/// definite. Where one is not, its negative direction, answered by the feedback of the later steps, leads
/// down.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/sweep.hpp>
#include <jml/solve/negative_direction.hpp>

namespace jml::detail {

/// A unit d with dᵀ (diag(weight) + Fᵀ Λ F) d < 0, beyond rounding.
template <typename Scalar, int n, int m>
[[nodiscard]] JML_RARE bool is_negative(const Matrix<Scalar, n, m>& F,
                                        const Matrix<Scalar, n, n>& information,
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

/// After a backward pass with second derivatives that found no minimum: true where the Hessian of J at the
/// nominal is indefinite beyond rounding, and the laws are then those of a direction along which J falls, of
/// unit length where it begins.
template <typename Sweep, typename Store>
[[nodiscard]] JML_RARE bool way_down(const Sweep& sweep, Store& store) {
  using Scalar = typename Store::Number;
  constexpr int q = DynamicsTraits<typename Store::Dynamics>::disturbances;
  auto& prior = store.prior();
  kernel::set_zero(prior.law);
  const auto& stop = sweep.stop();
  for (int j = store.last(); j > stop.node; --j) kernel::set_zero(store.node(j).law.offset);
  if (stop.node == 0) return is_negative(prior.L, stop.information, prior.weight, prior.law);
  for (int j = stop.node; j > 0; --j) store.node(j).law = {};
  Vector<Scalar, q> d = kernel::zeros<Vector<Scalar, q>>();
  if constexpr (q > 0) {
    const auto unit = kernel::filled<Vector<Scalar, q>>(Scalar(1));
    if (!is_negative(store.root(stop.node).B, stop.information, unit, d)) return false;
  }
  kernel::assign(store.node(stop.node).law.offset, d);
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
[[nodiscard]] JML_RARE bool leave_saddle(Sweep& sweep, Store& store, Scalar& cost) {
  PassSums<Scalar> unused;
  if (sweep.template backward<Curvature::full>(false, Scalar(0), unused) || !way_down(sweep, store))
    return false;
  const Scalar rounding = Scalar(64) * std::numeric_limits<Scalar>::epsilon() * (std::abs(cost) + Scalar(1));
  for (int halvings = 0; halvings < 20; ++halvings) {
    Scalar ahead = sweep.forward(false);
    scale_way(store, Scalar(-1));
    const Scalar back = sweep.forward(false);
    if (ahead < back || !std::isfinite(back)) {
      scale_way(store, Scalar(-1));
      ahead = sweep.forward(false);
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
#include <jml/warnings_end.hpp>
