// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random numbers that do not depend on the standard library (log and cos may differ in the last place), for
/// tests, demos and campaigns.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <cstdint>
#include <jml/campaign/distributions.hpp>
#include <random>

namespace jml {

/// Standard uniform and normal numbers from std::mt19937_64, whose output the C++ standard fixes; the
/// standard's distributions are not fixed, so these are Box and Muller's. Draw one number a statement: the
/// order in which function arguments are evaluated is not fixed either.
class Noise : public Distributions<Noise> {
 public:
  explicit Noise(std::uint64_t seed) : engine_(seed) {}  ///< the same seed gives the same numbers everywhere

  /// Uniform in (0, 1).
  double uniform() { return (static_cast<double>(engine_() >> 12) + 0.5) * 0x1p-52; }
  using Distributions<Noise>::uniform;

  /// Normal, mean 0, variance 1.
  double normal() {
    const double radius = std::sqrt(-2 * std::log(uniform()));
    const double angle = 6.283185307179586 * uniform();
    return radius * std::cos(angle);
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
