// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A belief about a state in a space: the state, and a belief of ℝⁿ about how far off it is.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/watched.hpp>
#include <jml/model/local_context.hpp>
#include <jml/twofold.hpp>

namespace jml {

/// x: a state of D. local: a belief about the error, in the tangent at x; its x is zero.
template <typename Scalar_, typename D, typename Local>
struct LocalBelief {
  using Scalar = Scalar_;                       ///< of x
  static constexpr int states = Local::states;  ///< degrees of freedom
  /// A state of the space, `states_of` numbers.
  Vector<Scalar, states_of<D>> x = SpaceOf<D>::template origin<Scalar>();
  Local local{};  ///< about x, in its tangent

  /// Of errors in the tangent at x, degrees×degrees.
  [[nodiscard]] decltype(auto) P() const
    requires(
        requires(const Local& l) { l.P(); } || requires(const Local& l) { l.P; })
  {
    if constexpr (requires { local.P(); })
      return local.P();
    else
      return (local.P);
  }
  auto each_part(auto&& f) { return f(x, local); }  ///< for saving, image/parts.hpp
};

namespace detail {

template <typename Scalar, typename D, typename Local>
JML_INLINE inline void commit(LocalBelief<Scalar, D, Local>& belief,
                              const LocalBelief<Scalar, D, Local>& next) {
  kernel::assign(belief.x, next.x);
  commit(belief.local, next.local);
}

/// The slope of a chart (a type of its own, by which a belief's turn() is found wherever it is declared).
template <typename Scalar, int n>
struct ChartSlope {
  Matrix<Scalar, n, n> J;
};

/// P ← J P Jᵀ, where most rows of J are those of I.
template <typename Scalar, int n>
void turn_rows(const Matrix<Scalar, n, n>& J, Matrix<Scalar, n, n>& P) {
  int first[n], last[n];  // what a row of J takes in
  for (int i = 0; i < n; ++i) {
    first[i] = n;
    last[i] = -1;
    for (int j = 0; j < n; ++j) {
      if (J(i, j) == Scalar(i == j)) continue;
      first[i] = std::min({first[i], i, j});
      last[i] = std::max({last[i], i, j});
    }
  }
  for (const bool left : {true, false}) {
    const Matrix<Scalar, n, n> before = P;
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < n && last[i] >= 0; ++k) {
        Scalar sum = 0;
        for (int j = first[i]; j <= last[i]; ++j) sum += J(i, j) * (left ? before(j, k) : before(k, j));
        (left ? P(i, k) : P(k, i)) = sum;
      }
    }
  }
}

/// P ← J P Jᵀ of a belief whose x is done with: it becomes zero. False where no digits of P are left.
template <typename Scalar, int n>
[[nodiscard]] bool turn(Estimate<Scalar, n>& belief, const ChartSlope<Scalar, n>& slope) {
  kernel::set_zero(belief.x);
  turn_rows(slope.J, belief.P);
  return all_finite(belief.P);
}
template <typename Scalar, int n>
[[nodiscard]] bool turn(WatchedEstimate<Scalar, n>& belief, const ChartSlope<Scalar, n>& slope) {
  const Matrix<Scalar, n, n>& J = slope.J;
  belief.exact = false;
  if (!belief.extended) {
    kernel::set_zero(belief.x);
    turn_rows(J, belief.P);
    kernel::mirror(belief.P);
    note_spread(belief, Scalar(0));
    return all_finite(belief.P);
  }
  using T = Extended<Scalar>;
  T half[n * n];
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      T sum(0);
      for (int k = 0; k < n; ++k) sum = sum + T(J(i, k)) * as_one(belief.P(k, j), belief.P_low(k, j));
      half[i + j * n] = sum;
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      T sum(0);
      for (int k = 0; k < n; ++k) sum = sum + half[i + k * n] * T(J(j, k));
      belief.P(i, j) = belief.P(j, i) = in_two<Scalar>(sum).high;
      belief.P_low(i, j) = belief.P_low(j, i) = in_two<Scalar>(sum).low;
    }
  }
  kernel::set_zero(belief.x);
  kernel::set_zero(belief.x_low);
  return all_finite(belief.P);
}
/// The state of `next` becomes what its local x leads to from `base`, and its P that of the tangent there.
template <typename Belief, typename Point>
[[nodiscard]] Status settle_at(Belief& next, const Point& base) {
  using D = typename Belief::Dynamics;
  using Local = decltype(next.local);
  const auto z = next.local.x;
  next.x = SpaceOf<D>::plus(base, z);
  if (!all_finite(next.x)) return Status::covariance_lost;
  return all_zero(z) ||
                 turn(next.local,
                      ChartSlope<typename Local::Scalar, Local::states>{SpaceOf<D>::chart_slope(base, z)})
             ? Status::ok
             : Status::covariance_lost;
}

template <typename Inner, typename D>
struct LocalMethod;

}  // namespace detail

template <typename Inner, typename D>
struct PartsOf<detail::LocalMethod<Inner, D>> : PartsOfBase<detail::LocalMethod<Inner, D>, Inner> {};

}  // namespace jml
#include <jml/warnings_end.hpp>
