// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The classical fourth-order Runge-Kutta method, written once: for a state, for a state and a matrix that
/// moves with it (P, or the transition matrix), and for what a filter's right-hand side asks on the way.
#include <jml/warnings_begin.hpp>
#pragma once

#include <concepts>
#include <jml/kernels.hpp>
#include <jml/status.hpp>

namespace jml {

/// `substeps` equal steps over an interval: order 4, explicit, four evaluations each.
struct RungeKutta4 {
  int substeps = 1;  ///< of equal length
};

/// One explicit step of order 1 over an interval.
struct Euler {};

/// A state and a matrix that move together.
template <typename X, typename Square>
struct StateAndMatrix {
  X x;       ///< of n
  Square P;  ///< n×n
};

namespace detail {

/// Stage i is evaluated at start + node · (slope of stage i - 1), and counts with its weight.
template <typename Scalar>
struct RungeKuttaStages {
  explicit RungeKuttaStages(Scalar h)
      : node{0, h * Scalar(0.5), h * Scalar(0.5), h},
        weight{h * Scalar(1.0 / 6), 2 * (h * Scalar(1.0 / 6)), 2 * (h * Scalar(1.0 / 6)),
               h * Scalar(1.0 / 6)} {}
  Scalar node[4], weight[4];
};

// For the points that a step can be made of: out = a, and out = a + factor·b.
template <typename T, int rows, int cols>
JML_INLINE inline void copy_to(Matrix<T, rows, cols>& out, const Matrix<T, rows, cols>& a) {
  kernel::assign(out, a);
}
template <typename X, typename Square>
JML_INLINE inline void copy_to(StateAndMatrix<X, Square>& out, const StateAndMatrix<X, Square>& a) {
  copy_to(out.x, a.x);
  copy_to(out.P, a.P);
}
template <typename T, int rows, int cols, typename Scalar>
JML_INLINE inline void move_along(Matrix<T, rows, cols>& out, const Matrix<T, rows, cols>& a, Scalar factor,
                                  const Matrix<T, rows, cols>& b) {
  if constexpr (std::is_same_v<T, Scalar>)
    kernel::add_scaled(out, a, factor, b);
  else
    out = a + factor * b;
}
template <typename X, typename Square, typename Scalar>
JML_INLINE inline void move_along(StateAndMatrix<X, Square>& out, const StateAndMatrix<X, Square>& a,
                                  Scalar factor, const StateAndMatrix<X, Square>& b) {
  move_along(out.x, a.x, factor, b.x);
  move_along(out.P, a.P, factor, b.P);
}

}  // namespace detail

/// One step of length h from `start` into `end`. slope(i, c, at, out) gives the derivative of stage i at the
/// time c after the start, and a Status: the first that is not ok is the answer, and `end` then means
/// nothing. unrolled: 4, or 0 where the stages are large.
template <int unrolled = 0, typename Point, typename Scalar, typename Slope>
[[nodiscard]] JML_INLINE inline Status explicit_step(const RungeKutta4&, const Point& start, Scalar h,
                                                     Point& end, const Slope& slope) {
  const detail::RungeKuttaStages<Scalar> stages(h);
  Point at, sum, along;
  detail::copy_to(at, start);
  detail::copy_to(sum, start);
  detail::copy_to(along, start);
  Status status = Status::ok;
  kernel::repeat<4, unrolled>([&](int i) JML_INLINE {
    if (i > 0) detail::move_along(at, start, stages.node[i], along);
    const Status stage = slope(i, stages.node[i], at, along);
    if (status == Status::ok) status = stage;
    detail::move_along(sum, sum, stages.weight[i], along);
  });
  detail::copy_to(end, sum);
  return status;
}
/// One of order 1.
template <typename Point, typename Scalar, typename Slope>
[[nodiscard]] JML_INLINE inline Status explicit_step(const Euler&, const Point& start, Scalar h, Point& end,
                                                     const Slope& slope) {
  Point along = start;
  const Status status = slope(0, Scalar(0), start, along);
  detail::move_along(end, start, h, along);
  return status;
}

/// A method with an explicit_step(method, start, h, end, slope): what discretize() and the algebraic filter
/// take.
template <typename Method>
concept ExplicitMethod =
    requires(const Method& method, Eigen::Matrix<double, 1, 1>& x,
             Status (&slope)(int, double, const Eigen::Matrix<double, 1, 1>&, Eigen::Matrix<double, 1, 1>&)) {
      { explicit_step(method, x, 1.0, x, slope) } -> std::same_as<Status>;
    };

/// Moves the pair (x, P) over dt from `time`. `flow.derivative(t, x, P, dx, dP, report)` is the right-hand
/// side; `flow.permits(h)` judges, after the first evaluation of a step, whether the step may be taken. x and
/// P are touched on refusal too, and not asked to be finite.
template <typename Flow>
[[nodiscard]] JML_INLINE inline Status advance(const RungeKutta4& method, Flow& flow, double time,
                                               typename Flow::Scalar dt, typename Flow::X& x,
                                               typename Flow::Square& P, typename Flow::Report& report) {
  using Scalar = typename Flow::Scalar;
  constexpr int n = Flow::n;
  if (method.substeps < 1) return Status::invalid_option;
  const Scalar h = dt / Scalar(method.substeps);
  const detail::RungeKuttaStages<Scalar> stages(h);
  typename Flow::Report first;  // a local: a store through a reference would make the model's numbers unknown
  for (int step = 0; step < method.substeps; ++step) {
    const double start = time + static_cast<double>(h) * step;
    // As explicit_step, with x and P apart: in one object they live in memory, which costs a sixth at n = 2.
    typename Flow::X at_x, sum_x, slope_x = kernel::zeros<typename Flow::X>();
    typename Flow::Square at_P, sum_P, slope_P = kernel::zeros<typename Flow::Square>();
    Status status = Status::ok;
    kernel::assign(at_x, x);
    kernel::assign(at_P, P);
    kernel::assign(sum_x, x);
    kernel::assign(sum_P, P);
    kernel::repeat<4, (n <= 3 ? 4 : 0)>([&](int i) JML_INLINE {
      if (i > 0) {
        kernel::add_scaled(at_x, x, stages.node[i], slope_x);
        kernel::add_scaled(at_P, P, stages.node[i], slope_P);
      }
      const Status stage = flow.derivative(start + static_cast<double>(stages.node[i]), at_x, at_P, slope_x,
                                           slope_P, i == 0 && step == 0 ? &first : nullptr);
      if (stage != Status::ok) {
        status = stage;
      } else if (i == 0) {
        status = flow.permits(h);
      } else if (i == 3 && status == Status::ok && flow.pole_within(2 * h) && all_finite(slope_P)) {
        status = Status::riccati_escape;
      }
      kernel::add_scaled(sum_x, sum_x, stages.weight[i], slope_x);
      kernel::add_scaled(sum_P, sum_P, stages.weight[i], slope_P);
    });
    if (status != Status::ok) return status;
    kernel::assign(x, sum_x);
    kernel::assign(P, sum_P);
  }
  report = first;
  report.steps = method.substeps;
  report.evaluations = 4L * method.substeps;
  return Status::ok;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
