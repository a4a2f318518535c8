// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What of the noise depends on the states, taken at the nominal of an interval and held while J is
/// minimised.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/local_record.hpp>
#include <jml/interval/nodes.hpp>

namespace jml::detail {

/// Freezes state-dependent G, Q, R and w̄ at the nominal; `change`: the largest relative change of any.
/// In charts the w and v that the models are linearised about, too; their change is in standard deviations.
template <IntervalStore Store>
[[nodiscard]] Status freeze(Store& store, typename Store::Number& change) {
  using D = typename Store::Dynamics;
  using Scalar = typename Store::Number;
  constexpr int q = DynamicsTraits<D>::disturbances;
  const int now = store.now();
  Status status = Status::ok;
  change = 0;
  const auto compare = [&change](const auto& before, const auto& after) {
    const Scalar size = kernel::largest(after), moved = kernel::largest(after - before);
    if (moved > change * size) change = size > Scalar(0) ? moved / size : Scalar(1);
  };
  for (int j = 0; j <= store.last(); ++j) {
    auto& node = store.node(j);
    store.visit(j, [&](auto& record) {
      if constexpr (std::remove_reference_t<decltype(record)>::varies) {
        const auto before = record.R;
        Scalar by = 0;
        if (!record.freeze(node.x[now], end_of(node.at()), &by)) status = Status::invalid_noise_covariance;
        change = by > change ? by : change;
        compare(before.inverse_diagonal, record.R.inverse_diagonal);
        compare(before.lower, record.R.lower);  // correlations
      }
    });
    if constexpr (!NoiseRoot<Scalar, D>::constant) {
      if (j == 0) continue;
      if constexpr (InCharts<Store>) {
        const Scalar by = move_noise_point(store, j);
        change = by > change ? by : change;
      }
      NoiseRoot<Scalar, D> root;
      if (!root.form(store.dynamics(), store.node(j - 1).x[now], node.at()))
        status = Status::invalid_disturbance_covariance;
      if constexpr (q > 0) compare(node.noise.B, root.B);
      if constexpr (NoiseRoot<Scalar, D>::has_mean && !InCharts<Store>)
        compare(node.noise.mean_effect, root.mean_effect);
      node.noise = root;
    }
  }
  return status;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
