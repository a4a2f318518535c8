// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The states of a window anew, after a node was put into one of its steps.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/nodes.hpp>

namespace jml::detail {

/// The trajectory anew, in another copy: f from node j on, with the disturbances as they are. False where it
/// is not finite.
template <typename Window>
bool roll_out(Window& window, int j) {
  using Root = std::remove_cvref_t<decltype(window.root(1))>;
  const int from = window.now(), last = window.last();
  window.flip();
  const int now = window.now();
  window.prior().a[now] = window.prior().a[from];
  for (int k = 0; k <= last; ++k) {
    auto& node = window.node(k);
    node.b[now] = node.b[from];
    if (k <= j) node.x[now] = node.x[from];
  }
  // Of a disturbance that is held over the step, its mean in both parts: b √(dt_1/dt) and b √(dt_2/dt).
  using Scalar = typename Window::Number;
  auto &first = window.node(j + 1), &second = window.node(j + 2);
  const Scalar share = first.at().dt / (first.at().dt + second.at().dt);
  first.b[now] = second.b[from] * std::sqrt(share);
  second.b[now] = second.b[from] * std::sqrt(Scalar(1) - share);
  for (int k = j + 1; k <= last; ++k) {
    const auto& before = window.node(k - 1).x[now];
    auto& node = window.node(k);
    if constexpr (!Root::constant) {
      if (k <= j + 2 && !node.noise.form(window.dynamics(), before, node.at())) return false;
    }
    node.x[now] = jml::dynamics(window.dynamics(), before, node.at()) + window.root(k).mean_effect +
                  window.root(k).B * node.b[now];
    if (!all_finite(node.x[now])) return false;
  }
  return true;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
