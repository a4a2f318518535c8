// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The classical fourth-order Runge-Kutta method over an interval, in fixed time.
#pragma once

#include <jml/linear_algebra.hpp>
#include <jml/status.hpp>

namespace jml {

/// `substeps` equal steps over an interval: order 4, explicit, four evaluations each.
struct RungeKutta4 {
  int substeps = 1;
};

/// Moves the pair (x, P) over dt from `time`. `flow.derivative(t, x, P, dx, dP, report)` is the right-hand
/// side; `flow.permits(h)` judges, after the first evaluation of a step, whether the step may be taken. x and
/// P are touched on refusal too, and not asked to be finite.
template <typename Flow>
[[nodiscard]] JML_INLINE inline Status advance(const RungeKutta4& method, Flow& flow, double time,
                                                        typename Flow::Scalar dt, typename Flow::X& x,
                                                        typename Flow::Square& P,
                                                        typename Flow::Report& report) {
  using Scalar = typename Flow::Scalar;
  constexpr int n = Flow::n;
  if (method.substeps < 1) return Status::invalid_option;
  const Scalar h = dt / Scalar(method.substeps);
  // Stage i is evaluated at x + node · (slope of stage i - 1), and counts with its weight.
  const Scalar node[4] = {0, h * Scalar(0.5), h * Scalar(0.5), h};
  const Scalar sixth = h * Scalar(1.0 / 6), weight[4] = {sixth, 2 * sixth, 2 * sixth, sixth};
  typename Flow::Report first;  // a local: a store through a reference would make the model's numbers unknown
  for (int step = 0; step < method.substeps; ++step) {
    const double start = time + static_cast<double>(h) * step;
    typename Flow::X at_x, sum_x, slope_x = kernel::zeros<typename Flow::X>();
    typename Flow::Square at_P, sum_P, slope_P = kernel::zeros<typename Flow::Square>();
    Status status = Status::ok;
    kernel::assign(at_x, x);
    kernel::assign(at_P, P);
    kernel::assign(sum_x, x);
    kernel::assign(sum_P, P);
    kernel::repeat<4, (n <= 3 ? 4 : 0)>([&](int i) JML_INLINE {
      if (i > 0) {
        kernel::add_scaled(at_x, x, node[i], slope_x);
        kernel::add_scaled(at_P, P, node[i], slope_P);
      }
      const Status stage = flow.derivative(start + static_cast<double>(node[i]), at_x, at_P, slope_x, slope_P,
                                           i == 0 && step == 0 ? &first : nullptr);
      if (stage != Status::ok) {
        status = stage;
      } else if (i == 0) {
        status = flow.permits(h);
      } else if (i == 3 && status == Status::ok && flow.pole_within(2 * h) && all_finite(slope_P)) {
        status = Status::riccati_escape;
      }
      kernel::add_scaled(sum_x, sum_x, weight[i], slope_x);
      kernel::add_scaled(sum_P, sum_P, weight[i], slope_P);
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
