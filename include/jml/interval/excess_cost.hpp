// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a filter's estimate costs in the criterion J: min{J : x_N = x̂} - min J.
///
/// J is a function of a trajectory, which a filter's output is not; the least J of all trajectories that end
/// where the filter stands is. Zero for the exact estimator, ½ (x̂ - x_N)ᵀ P⁻¹ (x̂ - x_N) on a linear system.
/// The end is held by a term ½ |x_N - target|² in units of P_N / 10⁴, whose target is moved by what is left
/// of the difference until none is (method of multipliers): P_N may be singular.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/batch.hpp>

namespace jml {

/// An excess cost, or why there is none.
template <typename Scalar>
struct ExcessCost {
  /// ok. not_a_trajectory: no disturbance of the model leads there (GQGᵀ or P_0 singular). Else what a
  /// minimisation answered.
  Status status = Status::ok;
  /// The least J of trajectories that end at x, above the least of all: ≥ 0 to rounding; NaN on refusal.
  Scalar value = std::numeric_limits<Scalar>::quiet_NaN();
};

namespace detail {

/// Of a Batch, or what serves in the place of one.
template <typename Interval, typename Scalar, int n>
[[nodiscard]] ExcessCost<Scalar> excess_cost_of(Interval batch, const Vector<Scalar, n>& x) {
  static_assert(n == Interval::states, "jml: the estimate has not as many states as the dynamics");
  if (!all_finite(x)) return {Status::invalid_state};
  batch.options.tolerance = 0;  // the default: the difference is of two minima
  const auto least = batch.solve();
  if (!usable(least.status)) return {least.status};
  const int last = batch.steps();
  const Matrix<Scalar, n, n> P = batch.P(last);
  if (!all_finite(P)) return {Status::covariance_lost};
  auto& store = batch.recording();
  Vector<Scalar, n> size;
  for (int i = 0; i < n; ++i) size(i) = std::sqrt(P(i, i));
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  constexpr Scalar slack = Scalar(1e4) * epsilon;

  // Units: the standard deviations where there are any. A state that is certain stays so, or x is elsewhere.
  Terminal<Scalar, n> end;
  constexpr Scalar stiffness = 1e4;
  for (int i = 0; i < n; ++i) {
    if (size(i) > Scalar(0)) end.weight(i, i) = stiffness / P(i, i);
  }
  end.target = x;
  for (int round = 0; round < 30; ++round) {
    store.end_near(end);
    const auto held = minimise(store, batch.options, true, false);
    if (!usable(held.status)) return {held.status};
    const Vector<Scalar, n> off = x - batch.x(last);
    bool there = true;
    for (int i = 0; i < n; ++i)
      there = there && std::abs(off(i)) <= Scalar(1e-9) * size(i) + slack * (std::abs(x(i)) + size(i));
    if (there) {
      const Vector<Scalar, n> pull = batch.x(last) - end.target;
      return {Status::ok,
              held.cost - kernel::dot(pull, Vector<Scalar, n>(end.weight * pull)) / Scalar(2) - least.cost};
    }
    end.target += off;
  }
  return {Status::not_a_trajectory};
}

}  // namespace detail

/// The excess of `x`, an estimate of the last state of `batch`, whose options hold. The argument is a copy:
/// the caller's batch keeps its answer, and the copy uses the heap.
template <typename D, typename List, typename Scalar, int n>
[[nodiscard]] ExcessCost<Scalar> excess_cost(Batch<D, List, Scalar> batch, const Vector<Scalar, n>& x) {
  return detail::excess_cost_of(std::move(batch), x);
}

}  // namespace jml
#include <jml/warnings_end.hpp>
