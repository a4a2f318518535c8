// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The states of a window anew, after a node was put into one of its steps.
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
  kernel::set_zero(window.node(j + 1).b[now]);
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
