// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How a campaign is run (component jml::campaign).
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace jml {

/// How a campaign is run.
struct CampaignOptions {
  std::int64_t runs = 1000;  ///< flights; at least 1
  std::uint64_t seed = 1;    ///< of CounterNoise: another one, other noise
  int threads = 0;           ///< of this process; 0: as many as the machine has
  std::string journal{};     ///< path of a file that keeps finished blocks; empty: none
  std::string
      version{};         ///< anything that names the state of the user's code; part of the journal's identity
  int blocks = 128;      ///< runs are added in this many blocks, whatever the threads; at most `runs`
  bool progress = true;  ///< on stderr, where that is a terminal
  /// A part of the campaign, for one machine of many, begins at this block (from 0). The figures are then
  /// those of its runs alone; the whole is merged from the parts' journals.
  int first = 0;
  int count = 0;  ///< blocks of the part; 0: all that follow
  /// Journals of such parts, read and left as they are: their blocks are taken over, and what none of them
  /// has is flown. The result is that of the whole campaign on one machine, to the bit.
  std::vector<std::string> parts{};
};

}  // namespace jml
#include <jml/warnings_end.hpp>
