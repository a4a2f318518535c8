// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a node of a FixedLag's window is saved by, see filter/save.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstdint>
#include <jml/image/parts.hpp>
#include <tuple>

namespace jml::detail {

/// Of the copies of its state and disturbance the nominal, and of its slots those with a measurement.
template <int measurements, typename Node>
struct WindowNodeParts {
  Node& node;
  int now;      // the nominal copy
  bool led_to;  // by a step

  auto each_part(auto&& f) {
    return each_type(f, std::make_index_sequence<std::tuple_size_v<decltype(node.slots)>>{});
  }

 private:
  template <std::size_t... type>
  auto each_type(auto&& f, std::index_sequence<type...>) {
    return f(node.x[now], part_if(led_to, node.b[now]), node.noise, node.context,
             in_range(node.count[type], 0, std::uint8_t(measurements))...,
             part_series<measurements>([this](int i) {
               return part_if([this, i] { return i < node.count[type]; }, std::get<type>(node.slots)[i]);
             })...);
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
