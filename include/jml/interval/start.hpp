// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the minimisation of J over an interval begins.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/linearised.hpp>
#include <jml/interval/local_record.hpp>

namespace jml {

/// Where the iteration starts.
enum class Start : std::uint8_t {
  filter,      ///< at the states of an EKF that runs over the recorded measurements
  prediction,  ///< at x̂_0 propagated without disturbances
  given,       ///< at the states given with guess(), at every node
  /// At all of these in turn, for the least J: filter, prediction, and an EKF that begins 1.5 deviations
  /// beside x̂_0 along each column of a root of P_0, on both sides. 2 + 2n solutions and the best once more.
  several,
};

namespace detail {

/// Sets the nominal states of `store` by an EKF in factors that begins at x̂_0 + off; a step or measurement
/// that it refuses is left out. clip(x): after each correction.
template <typename Store, typename Clip = Nothing>
void start_at_filter(Store& store,
                     const Vector<typename Store::Number, states_of<typename Store::Dynamics>>& off,
                     [[maybe_unused]] const Clip& clip = {}) {
  using D = typename Store::Dynamics;
  using Scalar = typename Store::Number;
  constexpr int n = states_of<D>;
  const int now = store.now();
  FactoredBelief<Scalar, n> belief;
  commit(belief, store.start());
  belief.x += off;
  for (int j = 0; j <= store.last(); ++j) {
    auto& node = store.node(j);
    if (j > 0) {
      bool valid = true;
      place_chart(store, j);
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
    if constexpr (!std::is_same_v<Clip, Nothing>) clip(belief.x);
    kernel::assign(node.x[now], belief.x);
  }
  static_cast<void>(place_charts(store));
}

/// Sets the nominal states to the prediction from the prior.
template <typename Store>
void start_at_prediction(Store& store) {
  auto x = store.start().x;
  for (int j = 0; j <= store.last(); ++j) {
    auto& node = store.node(j);
    place_chart(store, j);
    if (j > 0) x = predicted_state(store.dynamics(), x, node.at());
    node.x[store.now()] = x;
  }
}

/// Start number `which` of Start::several: 0 … 2n + 1.
template <typename Store, typename Clip = Nothing>
void start_at(Store& store, int which, const Clip& clip = {}) {
  using Scalar = typename Store::Number;
  constexpr int n = states_of<typename Store::Dynamics>;
  if (which == 1) return start_at_prediction(store);
  Vector<Scalar, n> off = kernel::zeros<Vector<Scalar, n>>();
  if (which > 1)
    off = kernel::column_of(store.prior().L, which / 2 - 1) * Scalar(which % 2 == 0 ? 1.5 : -1.5);
  start_at_filter(store, off, clip);
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
