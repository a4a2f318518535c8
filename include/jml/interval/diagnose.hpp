// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Why an interval cannot be linearised about its nominal.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/nodes.hpp>
#include <jml/status.hpp>

namespace jml::detail {

/// The first function of a model that is not finite there, in the order of time; not_converged where all are.
template <typename Store>
[[nodiscard]] JML_RARE Status why_not_linear(Store& store) {
  const int now = store.now();
  Status status = Status::ok;
  for (int j = 0; j <= store.last() && status == Status::ok; ++j) {
    auto& node = store.node(j);
    const Vector<typename Store::Number, states_of<typename Store::Dynamics>> x = node.x[now];
    if (!all_finite(x)) return Status::dynamics_not_finite;
    store.visit(j, [&](const auto& record) {
      if constexpr (requires { record.sensor; }) {
        const auto at = end_of(node.at());
        const bool finite = all_finite(measurement(record.sensor, x, at)) &&
                            all_finite(measurement_jacobian(record.sensor, x, at));
        if (!finite) status = Status::sensor_not_finite;
      }
    });
    if (status != Status::ok || j == store.last()) break;
    const auto at = store.node(j + 1).at();
    const bool finite = all_finite(dynamics(store.dynamics(), x, at)) &&
                        all_finite(dynamics_jacobian(store.dynamics(), x, at));
    if (!finite) status = Status::dynamics_not_finite;
  }
  return status == Status::ok ? Status::not_converged : status;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
