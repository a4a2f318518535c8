// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What moves (x, P) over an interval: the concept behind RungeKutta4, DavisonMaki and Cvode.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/riccati/differential.hpp>
#include <jml/solve/runge_kutta.hpp>

namespace jml {

namespace detail {

template <typename I, typename Scalar, int n>
struct EngineOf {
  using type = I;
};
template <typename I, typename Scalar, int n>
  requires requires { typename I::template Engine<Scalar, n>; }
struct EngineOf<I, Scalar, n> {
  using type = typename I::template Engine<Scalar, n>;
};

}  // namespace detail

/// What moves (x, P) for one filter: the integrator itself, or what it keeps, a type Engine<Scalar, n> made
/// from it.
template <typename I, typename Scalar, int n>
using EngineOf = typename detail::EngineOf<I, Scalar, n>::type;

/// I can move a flow: `advance(engine, flow, time, dt, x, P, record)` takes (x, P) from `time` over dt > 0,
/// s, by the right-hand side flow.derivative(t, x, P, dx, dP), or by flow.coefficients(…). It may touch x and
/// P where it refuses, and need not ask whether they are finite; record.steps and .evaluations are its count.
/// One that says `adaptive` takes a state in a space from chart to chart, each with a call of its own.
template <typename I, typename Flow>
concept Integrator = requires(EngineOf<I, typename Flow::Scalar, Flow::n>& engine, Flow& flow, double time,
                              typename Flow::Scalar dt, typename Flow::X& x, typename Flow::Square& P,
                              typename Flow::Report& record) {
  { advance(engine, flow, time, dt, x, P, record) } -> std::same_as<Status>;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
