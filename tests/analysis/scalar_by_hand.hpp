// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filter of ẋ = a x + w, h = x - x³ by hand.
#pragma once

#include <cmath>

namespace by_hand {

/// V of 0 = 2 a V + q - V² H²/r with H = 1 - x², and λ = x/V: McCaffrey's (10) by hand for n = 1.
struct Scalar {
  double a, q, r;

  double inverse(double x) const {
    const double H = 1 - x * x;
    return (std::sqrt(a * a + q * H * H / r) - a) / q;
  }
  /// ∫₀ˣ x/V dx by Simpson's rule in t, x = b (1 - (1-t)²): smooth at b = 1, where √ may touch zero.
  double level(double b) const {
    const auto f = [&](double t) {
      const double x = b * t * (2 - t);
      return x * inverse(x) * b * 2 * (1 - t);
    };
    constexpr int steps = 20000;
    double sum = f(0) + f(1);
    for (int k = 1; k < steps; ++k) sum += (k % 2 == 1 ? 4 : 2) * f(k / double(steps));
    return sum / (3 * steps);
  }
};

}  // namespace by_hand
