// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filter that is linearised about the nominal of an interval: what its arrival cost and its covariances
/// are.
///
/// Forward by Kalman steps, backward by the information of the later data, and where both meet (P⁻¹ + Λ)⁻¹.
#pragma once

#include <jml/interval/loss.hpp>
#include <jml/interval/nodes.hpp>

namespace jml::detail {

/// f_x of the step that leads to node j.
template <typename Store>
[[nodiscard]] auto step_jacobian(const Store& store, int j) {
  return dynamics_jacobian(store.dynamics(), store.node(j - 1).x[store.now()], store.node(j).at());
}

/// The step that leads to node j.
template <typename Store, typename Scalar, int n>
void linearised_step(const Store& store, int j, Estimate<Scalar, n>& estimate) {
  const auto& x = store.node(j - 1).x[store.now()];
  const Matrix<Scalar, n, n> A = step_jacobian(store, j);
  Matrix<Scalar, n, n> AP, P = kernel::zeros<Matrix<Scalar, n, n>>();
  kernel::product(A, estimate.P, AP);                                        // A P
  kernel::add_symmetric_product<1>(P, store.root(j).B, store.root(j).B, P);  // B Bᵀ
  kernel::add_symmetric_product<1>(P, AP, A, estimate.P);                    // A P Aᵀ + B Bᵀ
  const Vector<Scalar, n> off = estimate.x - x;
  estimate.x = dynamics(store.dynamics(), x, store.node(j).at()) + store.root(j).mean_effect + A * off;
}

/// What the measurements of node j say.
template <typename Store, typename Scalar, int n>
void add_measurements_of(const Store& store, int j, const Loss& loss, CostToGo<Scalar, n>& v) {
  const auto& x = store.node(j).x[store.now()];
  const auto at = end_of(store.node(j).at());
  store.visit(j, [&](const auto& record) {
    const auto residual = measurement_residual(record.sensor, record.y, measurement(record.sensor, x, at));
    const auto m_x = measurement_jacobian(record.sensor, x, at);
    const auto value = loss(record.R.squared_norm(residual));
    add_robust_measurement(m_x, record.R, residual, value.slope, value.bend, v);
  });
}

/// Corrects `estimate` with the measurements of node j; false where its covariance is lost.
template <typename Store, typename Scalar, int n>
[[nodiscard]] bool linearised_correction(const Store& store, int j, const Loss& loss,
                                         Estimate<Scalar, n>& estimate) {
  if (!store.measured(j)) return all_finite(estimate.P);
  CostToGo<Scalar, n> data;
  add_measurements_of(store, j, loss, data);
  const Matrix<Scalar, n, n> P = estimate.P;
  if (!condition(P, data.information, estimate.P)) return false;
  const Vector<Scalar, n> off = estimate.x - store.node(j).x[store.now()];
  const Vector<Scalar, n> slope = data.slope + data.information * off;
  estimate.x -= estimate.P * slope;
  return all_finite(estimate.x);
}

/// The covariance of node j given all measurements of the interval, to first order about the nominal; NaN
/// where it is lost. `prior`: of node 0.
template <typename Store, typename Scalar, int n>
[[nodiscard]] Matrix<Scalar, n, n> linearised_covariance(const Store& store, const Estimate<Scalar, n>& prior,
                                                         int j, const Loss& loss) {
  using Root = NoiseRoot<Scalar, typename Store::Dynamics>;
  Estimate<Scalar, n> forward = prior;
  bool valid = linearised_correction(store, 0, loss, forward);
  for (int i = 1; i <= j && valid; ++i) {
    linearised_step(store, i, forward);
    valid = linearised_correction(store, i, loss, forward);
  }
  if (j < store.last() && valid) {
    CostToGo<Scalar, n> later;
    PassSums<Scalar> sums;
    Feedback<Scalar, n, Root::q> law;
    for (int i = store.last(); i > j && valid; --i) {
      add_measurements_of(store, i, loss, later);
      valid = pass_dynamics(step_jacobian(store, i), store.root(i).B, store.node(i).b[store.now()], Scalar(0),
                            static_cast<Matrix<Scalar, Root::q, Root::q>*>(nullptr), later, law, sums);
    }
    const Matrix<Scalar, n, n> P = forward.P;
    valid = valid && condition(P, later.information, forward.P);
  }
  return valid ? forward.P : kernel::filled<Matrix<Scalar, n, n>>(std::numeric_limits<Scalar>::quiet_NaN());
}

}  // namespace jml::detail
