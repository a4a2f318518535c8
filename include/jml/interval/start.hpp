// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the minimisation of J over an interval begins.
#pragma once

#include <jml/interval/linearised.hpp>

namespace jml {

/// Where the iteration starts.
enum class Start : std::uint8_t {
  filter,      ///< at the states of an EKF that runs over the recorded measurements
  prediction,  ///< at x̂_0 propagated without disturbances
  given,       ///< at the states given with guess(), at every node
};

namespace detail {

/// Sets the nominal states of `store` by an EKF in factors; a step or measurement that it refuses is left
/// out.
template <typename Store>
void start_at_filter(Store& store) {
  using D = typename Store::Dynamics;
  using Scalar = typename Store::Number;
  constexpr int n = states_of<D>;
  const int now = store.now();
  FactoredBelief<Scalar, n> belief;
  commit(belief, store.start());
  for (int j = 0; j <= store.last(); ++j) {
    auto& node = store.node(j);
    if (j > 0) {
      bool valid = true;
      if constexpr (!NoiseRoot<Scalar, D>::constant)
        valid = node.noise.form(store.dynamics(), store.node(j - 1).x[now], node.at());
      if (valid) static_cast<void>(linearised_step(store, j, belief));
    }
    kernel::assign(node.x[now], belief.x);
    bool valid = true;
    store.visit(j, [&](auto& record) {
      if constexpr (std::remove_reference_t<decltype(record)>::varies)
        valid = record.freeze(node.x[now], end_of(node.at())) && valid;
    });
    if (valid) static_cast<void>(linearised_correction(store, j, Loss{}, belief));
    kernel::assign(node.x[now], belief.x);
  }
}

/// Sets the nominal states to the prediction from the prior.
template <typename Store>
void start_at_prediction(Store& store) {
  auto x = store.start().x;
  for (int j = 0; j <= store.last(); ++j) {
    auto& node = store.node(j);
    if (j > 0) x = predicted_state(store.dynamics(), x, node.at());
    node.x[store.now()] = x;
  }
}

}  // namespace detail

}  // namespace jml
