// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Another gate for one verb of a filter.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/gate.hpp>

namespace jml::detail {

/// A filter's gate, for the length of a scope.
template <typename F>
class WithGate {
 public:
  WithGate(F& filter, const Gate& gate) : filter_(filter), old_(filter.gate) { filter.gate = gate; }
  ~WithGate() { filter_.gate = old_; }
  WithGate(const WithGate&) = delete;
  WithGate& operator=(const WithGate&) = delete;

 private:
  F& filter_;
  Gate old_;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
