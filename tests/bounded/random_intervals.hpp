// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random intervals of every kind, numbers inside them, and how far an end is from where it should be.
#pragma once

#include <cmath>
#include <cstdint>
#include <jml/bounded/interval.hpp>
#include <jml/campaign/noise.hpp>
#include <limits>
#include <utility>

template <typename Base>
struct RandomIntervals {
  using Limits = std::numeric_limits<Base>;
  jml::Noise noise;

  /// ± 2^(from..to).
  Base number(double from, double to) {
    const double size = std::exp2(noise.uniform(from, to));
    return static_cast<Base>(noise.uniform() < 0.5 ? -size : size);
  }
  /// Ordinary, tiny, subnormal, huge, zero; a few of each.
  Base any() {
    const double kind = noise.uniform();
    if (kind < 0.55) return number(-8, 8);
    if (kind < 0.65) return static_cast<Base>(static_cast<int>(noise.uniform(-9, 9)));
    if (kind < 0.75) return number(Limits::min_exponent, Limits::max_exponent - 1);
    if (kind < 0.83) return number(Limits::min_exponent / 2.0 - 30, Limits::min_exponent / 2.0 + 30);
    if (kind < 0.91) return number(Limits::min_exponent - Limits::digits, Limits::min_exponent + 3);
    if (kind < 0.97) return number(Limits::max_exponent - 4, Limits::max_exponent - 0.01);
    return 0;
  }
  /// [x, x], narrow, or between two independent numbers; moderate: of ends(), below 2^±8.
  template <typename Ends>
  jml::Interval<Base> between(const Ends& ends) {
    const Base x = ends();
    const double kind = noise.uniform();
    if (kind < 0.3) return x;
    Base y = ends();
    if (kind < 0.6) y = x * static_cast<Base>(1 + std::exp2(noise.uniform(-Limits::digits, -4)));
    if (!(std::abs(y) <= Limits::max())) y = x;
    return {std::min(x, y), std::max(x, y)};
  }
  jml::Interval<Base> of_any() {
    return between([&] { return any(); });
  }
  jml::Interval<Base> within(Base low, Base high) {
    return between([&] { return static_cast<Base>(noise.uniform(low, high)); });
  }
  /// An end, or a number between them: in the middle of their values or of their exponents.
  Base inside(const jml::Interval<Base>& a) {
    const double kind = noise.uniform();
    if (kind < 0.25) return a.low;
    if (kind < 0.5) return a.high;
    const Base part = static_cast<Base>(noise.uniform());
    Base x = (1 - part) * a.low + part * a.high;
    if (kind > 0.75) x *= static_cast<Base>(std::exp2(-noise.uniform(0, 40)));
    return std::min(std::max(x, a.low), a.high);
  }
};

/// True where the exact value lies in the interval. `exact` in long double: what it hides of a violation is
/// below 1/2000 ulp of a double.
template <typename Base>
bool encloses(const jml::Interval<Base>& a, long double exact) {
  return static_cast<long double>(a.low) <= exact && exact <= static_cast<long double>(a.high);
}

/// How far the ends lie outside of [low, high], in ε |end| (half to one ulp) or the smallest number.
template <typename Base>
double excess(const jml::Interval<Base>& a, long double low, long double high) {
  const auto units = [](long double distance, long double at) {
    const long double unit =
        std::numeric_limits<Base>::epsilon() * std::abs(at) + std::numeric_limits<Base>::denorm_min();
    return static_cast<double>(distance / unit);
  };
  return std::max(units(low - static_cast<long double>(a.low), low),
                  units(static_cast<long double>(a.high) - high, high));
}
