// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether the heap would give what a capacity asks for: a status, where an allocation would throw.
#include <jml/warnings_begin.hpp>
#pragma once

#include <new>

namespace jml::detail {

/// Nodes of an interval are counted by an int.
inline constexpr int most_nodes = 1 << 30;

/// So many bytes may be had; a terabyte is none.
[[nodiscard]] inline bool has_room(double bytes) {
  if (!(bytes < 1e12)) return false;
  void* const some = ::operator new(static_cast<std::size_t>(bytes), std::nothrow);
  ::operator delete(some);
  return some != nullptr;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
