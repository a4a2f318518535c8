// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the minimisation of J over an interval begins.
#pragma once

#include <jml/filter/one_pass.hpp>
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
  const NoisyDynamics<Scalar, D> model(store.dynamics());
  const OnePass<Ekf<>> ekf;
  Estimate<Scalar, n> estimate = prior, next;
  for (int j = 0; j <= store.last(); ++j) {
    auto& node = store.node(j);
    if (j > 0) {
      if (ekf.predict(model, estimate, node.at(), next) == Status::ok) estimate = next;
    }
    store.visit(j, [&](const auto& record) {
      using Record = std::remove_cvref_t<decltype(record)>;
      StepReport<Scalar, n, Record::p> report;
      const auto at = end_of(node.at());
      ekf.correct(model, estimate, Sample{record.sensor, record.y, at, Gate{}}, next, report);
      if (report.status == Status::ok) estimate = next;
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
