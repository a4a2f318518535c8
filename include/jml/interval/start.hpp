// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the minimisation of J over an interval begins.
#pragma once

#include <jml/interval/nodes.hpp>

namespace jml {

/// Where the iteration starts.
enum class Start : std::uint8_t {
  filter,      ///< at the states of an EKF that runs over the recorded measurements
  prediction,  ///< at x̂_0 propagated without disturbances
  given,       ///< at the states given with guess(), at every node
};

namespace detail {

/// Sets the nominal states of `store` by an EKF; a step or measurement that it refuses is left out.
template <typename Store, typename Scalar, int n>
void start_at_filter(Store& store, const Estimate<Scalar, n>& prior) {
  using D = typename Store::Dynamics;
  const ProcessNoise<Scalar, D> noise(store.dynamics());
  Estimate<Scalar, n> estimate = prior;
  for (int j = 0; j <= store.last(); ++j) {
    auto& node = store.node(j);
    if (j > 0) {
      const auto predicted = predict(Ekf<>{}, store.dynamics(), noise, estimate, node.at());
      if (predicted.status == Status::ok) estimate = predicted.estimate;
    }
    store.visit(j, [&](const auto& record) {
      const auto updated = update(Ekf<>{}, record.sensor, estimate, record.y, at_sample(node.at()));
      if (updated.report.status == Status::ok) estimate = updated.estimate;
    });
    node.x[store.now()] = estimate.x;
  }
}

/// Sets the nominal states to the prediction from the prior.
template <typename Store, typename Scalar, int n>
void start_at_prediction(Store& store, const Estimate<Scalar, n>& prior) {
  Vector<Scalar, n> x = prior.x;
  for (int j = 0; j <= store.last(); ++j) {
    auto& node = store.node(j);
    if (j > 0) x = predicted_state(store.dynamics(), x, node.at());
    node.x[store.now()] = x;
  }
}

}  // namespace detail

}  // namespace jml
