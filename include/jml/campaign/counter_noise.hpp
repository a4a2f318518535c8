// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random numbers of a campaign (component jml::campaign): a stream of its own for every run.
///
/// Philox4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011; the
/// implementation is Random123's) enciphers a counter under a key. Key: the seed. Counter: the run and the
/// number of the draw. So a run's numbers depend on nothing that another run did, and any run can be replayed
/// alone.
#include <jml/warnings_begin.hpp>
#pragma once

#include <Random123/philox.h>

#include <cmath>
#include <cstdint>
#include <jml/campaign/distributions.hpp>

namespace jml {

/// Standard uniform and normal numbers of one run: jml::Noise's distributions, from Philox4x32-10.
/// Draw one number a statement, as with jml::Noise.
class CounterNoise : public Distributions<CounterNoise> {
 public:
  /// Different (seed, run) give independent streams. `draw`: the counter value to start from; a draw is two
  /// uniform numbers.
  CounterNoise(std::uint64_t seed, std::uint64_t run, std::uint64_t draw = 0)
      : key_{{low_half(seed), high_half(seed)}}, run_(run), draw_(draw) {}

  /// Uniform in (0, 1).
  double uniform() { return (static_cast<double>(next() >> 12) + 0.5) * 0x1p-52; }
  using Distributions<CounterNoise>::uniform;

  /// Normal, mean 0, variance 1; Box and Muller's pair, one after the other.
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2 * std::log(uniform()));
    const double angle = 6.283185307179586 * uniform();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

 private:
  static std::uint32_t low_half(std::uint64_t word) { return static_cast<std::uint32_t>(word); }
  static std::uint32_t high_half(std::uint64_t word) { return static_cast<std::uint32_t>(word >> 32); }

  std::uint64_t next() {
    if (has_second_) {
      has_second_ = false;
      return second_;
    }
    const r123::Philox4x32::ctr_type counter{
        {low_half(draw_), high_half(draw_), low_half(run_), high_half(run_)}};
    const auto words = r123::Philox4x32()(counter, key_);
    ++draw_;
    second_ = words[2] | std::uint64_t(words[3]) << 32;
    has_second_ = true;
    return words[0] | std::uint64_t(words[1]) << 32;
  }

  r123::Philox4x32::key_type key_;
  std::uint64_t run_, draw_, second_ = 0;
  double spare_ = 0;
  bool has_second_ = false, has_spare_ = false;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
