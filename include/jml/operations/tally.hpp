// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How a sensor is used, and what became of its measurements.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstdint>

namespace jml {

/// What is done with the measurements of a channel.
enum class Use : std::uint8_t {
  accept,   ///< as the gate says
  inhibit,  ///< nothing: a step predicts, an update leaves the estimate
  force,    ///< used whatever the gate says; what is not finite, and an S that is not positive definite, is
            ///< refused all the same
};
constexpr Use last_value(Use) { return Use::force; }  ///< for saving, image/parts.hpp

/// What became of the measurements of a channel.
struct Tally {
  std::uint64_t accepted = 0;   ///< all rows were used
  std::uint64_t partial = 0;    ///< some blocks were used
  std::uint64_t rejected = 0;   ///< by the gate, or as they contradicted stated bounds
  std::uint64_t refused = 0;    ///< by the filter, with a status
  std::uint64_t inhibited = 0;  ///< the channel was shut
  std::uint64_t recovered = 0;  ///< times that a Lockout acted
};

}  // namespace jml
#include <jml/warnings_end.hpp>
