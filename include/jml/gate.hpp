// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Chi-square tails for whole degrees of freedom, and the innovation gate built on them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <limits>

namespace jml {

/// P(χ² > value) for `degrees` ≥ 1, closed form; the degrees of a gate are the sensor's
/// measurements. For gates: e^-(value/2) underflows where averages over thousands of samples would need it.
template <typename Scalar>
[[nodiscard]] Scalar chi_square_upper_tail(Scalar value, int degrees) {
  if (value <= Scalar(0)) return Scalar(1);
  if (value > std::numeric_limits<Scalar>::max()) return Scalar(0);
  const Scalar half = value / Scalar(2);
  // Q(a+1, h) = Q(a, h) + h^a e^-h / Γ(a+1), from Q(1/2, h) = erfc √h or Q(1, h) = e^-h.
  Scalar a = degrees % 2 == 1 ? Scalar(0.5) : Scalar(1);
  Scalar tail = degrees % 2 == 1 ? std::erfc(std::sqrt(half)) : std::exp(-half);
  Scalar term = degrees % 2 == 1 ? Scalar(1.1283791670955126) * std::sqrt(half) * std::exp(-half)
                                 : half * std::exp(-half);
  for (; a + Scalar(0.25) < Scalar(degrees) / Scalar(2); a += Scalar(1)) {
    tail += term;
    term *= half / (a + Scalar(1));
  }
  return tail;
}

/// The value that χ² exceeds with probability 1 - `probability`; NaN where that is not in (0, 1).
/// Bisection: a bounded 80 halvings, for set-up rather than for every step.
template <typename Scalar>
[[nodiscard]] Scalar chi_square_quantile(Scalar probability, int degrees) {
  if (!(probability > Scalar(0) && probability < Scalar(1)) || degrees < 1) {
    return std::numeric_limits<Scalar>::quiet_NaN();
  }
  Scalar low = 0, high = Scalar(degrees) + Scalar(1);
  for (int i = 0; i < 60 && chi_square_upper_tail(high, degrees) > Scalar(1) - probability; ++i)
    high *= Scalar(2);
  for (int i = 0; i < 80; ++i) {
    const Scalar middle = (low + high) / Scalar(2);
    (chi_square_upper_tail(middle, degrees) > Scalar(1) - probability ? low : high) = middle;
  }
  return (low + high) / Scalar(2);
}

/// Innovation gate: a measurement whose normalised innovation squared (NIS) is less probable than
/// 1 - probability is not used. Off by default. One gate serves sensors of any size.
struct Gate {
  double probability = 1;  ///< (0, 1): the share of good measurements let through, e.g. 0.999. 1: off.

  /// Lets through whatever has a NIS at all, so that a method which asks for S only on behalf of a gate forms
  /// it, and an indefinite S is refused.
  [[nodiscard]] static constexpr Gate open() { return {all}; }
  /// Lets nothing through: an update that reports innovation and S, and leaves the estimate.
  [[nodiscard]] static constexpr Gate closed() { return {-all}; }

  static constexpr double all = 1024;  ///< no probability: stands for open(), and its negative for closed()

  /// Every measurement passes, unjudged.
  [[nodiscard]] constexpr bool off() const { return probability == 1; }
  /// A probability in (0, 1], open() or closed().
  [[nodiscard]] constexpr bool valid() const {
    return (probability > 0 && probability <= 1) || probability == all || probability == -all;
  }
  /// True if the gate lets it pass. A NaN does not pass.
  template <typename Scalar>
  [[nodiscard]] bool passes(Scalar nis, int degrees) const {
    return off() || (nis >= Scalar(0) && chi_square_upper_tail(nis, degrees) >= Scalar(1 - probability));
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
