// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How a caller says when a measurement was taken, and what may be given in place of a measurement.
#include <jml/warnings_begin.hpp>
#pragma once

#include <concepts>
#include <jml/clock.hpp>
#include <jml/gate.hpp>
#include <jml/model/concepts.hpp>
#include <jml/model/part.hpp>
#include <tuple>

namespace jml {

/// No dt was given.
struct NoTime {};

/// s, on the filter's clock. Made by at_time().
struct AtTime {
  double time;  ///< s
};
/// `filter.step(gnss, y, jml::at_time(t))`: step to t; `filter.update(gnss, y, jml::at_time(t))`: y was taken
/// at t.
[[nodiscard]] constexpr AtTime at_time(double time) { return {time}; }

/// Steps back from the present. Made by age().
struct Age {
  int steps;  ///< back from the present; negative: invalid_option
};
/// `filter.update(radar, y, jml::age(7))`: y was taken seven steps ago.
[[nodiscard]] constexpr Age age(int steps) { return {steps}; }

/// y(t) over a step: a jml::Line, or a function of the absolute time, s.
template <typename Y, typename Scalar, int p>
concept Signal = requires(const Y& y) {
  y.from;
  y.to;
} || (std::is_invocable_v<const Y&, double> && !requires { Y::RowsAtCompileTime; });

/// When a measurement was taken, as a method with a memory is asked (its correct_late).
struct Lateness {
  Status status = Status::ok;                                 ///< ok, or why there is no such time
  int steps = 0;                                              ///< age, where that was given
  double time = 0;                                            ///< s, where that was given
  bool timed = false;                                         ///< by at_time()
  bool aged = false;                                          ///< by age()
  Gate gate;                                                  ///< of the measurement
  [[nodiscard]] bool now() const { return !timed && !aged; }  ///< of the present
};

namespace detail {

template <typename Belief>
concept HasRiccati = requires(const Belief& b) { b.P; } || requires(const Belief& b) { b.P(); };
template <typename Belief>
concept HasAges = requires(const Belief& b) {
  b.x(0);
  b.P(0);
  b.time(0);
};

template <typename Start>
struct ScalarOfStart {
  using type = double;
};
template <typename Start>
  requires requires { typename Start::Scalar; }
struct ScalarOfStart<Start> {
  using type = typename Start::Scalar;
};
template <typename Start>
using ScalarOf = typename ScalarOfStart<Start>::type;

template <typename Which>
void note(Lateness&, const Clock&, const Which&) {
  static_assert(
      !sizeof(Which*),
      "jml: update(sensor, y, …) takes only(0, 2), first(k), finite_rows(y), at_time(t) or age(k), and "
      "no dt: it corrects, and step(sensor, y, dt) or predict(dt) go on");
}
inline void note(Lateness&, const Clock&, const Rows&) {}
inline void note(Lateness& late, const Clock&, const Age& age) {
  late.steps = age.steps;
  late.aged = age.steps != 0;
  if (age.steps < 0) late.status = Status::invalid_option;
}
inline void note(Lateness& late, const Clock& clock, const AtTime& at) {
  const double ahead = clock.until(at.time);
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * std::abs(at.time);
  late.time = at.time;
  if (!std::isfinite(at.time) || !(ahead <= rounding))
    late.status = Status::invalid_time_step;
  else
    late.timed = ahead < -rounding;
}
template <typename... Which>
[[nodiscard]] JML_INLINE inline Lateness lateness(const Clock& clock, const Which&... which) {
  Lateness late;
  (note(late, clock, which), ...);
  return late;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
