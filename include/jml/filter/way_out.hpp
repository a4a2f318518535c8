// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A way out of a refusal that keeps x: P made larger, or the variance of one state given anew.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored.hpp>
#include <jml/filter/known_states.hpp>
#include <jml/filter/local_belief.hpp>

namespace jml::detail {

/// P ← J P J + Σ v_i e_i e_iᵀ, J a diagonal: zero for a state whose covariances are dropped.
template <typename Scalar, int n>
struct Loosening {
  Vector<Scalar, n> kept = kernel::filled<Vector<Scalar, n>>(Scalar(1));
  Vector<Scalar, n> added = kernel::zeros<Vector<Scalar, n>>();

  [[nodiscard]] bool valid(bool infinite_too) const {
    bool good = true;
    for (int i = 0; i < n; ++i)
      good = good && added(i) >= Scalar(0) && (infinite_too || !std::isinf(added(i))) &&
             kept(i) >= Scalar(0) && std::isfinite(kept(i));
    return good;
  }
};

/// P of a belief can be made larger.
template <typename Belief, typename Scalar, int n>
concept Loosens = requires(Belief& belief, const Loosening<Scalar, n>& by) { loosen(belief, by, 0.0); };

template <typename Belief, typename Scalar, int n>
  requires std::is_base_of_v<Estimate<Scalar, n>, Belief>
[[nodiscard]] Status loosen(Belief& belief, const Loosening<Scalar, n>& by, double) {
  if (!by.valid(false)) return Status::invalid_option;
  Matrix<Scalar, n, n> P = belief.P;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) P(i, j) *= by.kept(i) * by.kept(j);
    P(i, i) += by.added(i);
  }
  if (!all_finite(P)) return Status::invalid_option;
  kernel::assign(belief.P, P);
  if constexpr (requires { belief.P_low; }) {
    if (!belief.extended) kernel::set_zero(belief.x_low);
    belief.extended = better_known_than_rounding(belief.x, belief.P);  // as at a start; x keeps what it has
  }
  note_spread(belief, Scalar(0));
  return Status::ok;
}

template <typename Scalar, int n>
[[nodiscard]] Status loosen(FactoredBelief<Scalar, n>& belief, const Loosening<Scalar, n>& by, double) {
  if (!by.valid(true)) return Status::invalid_option;
  Matrix<Scalar, n, n> J = kernel::zeros<Matrix<Scalar, n, n>>(), Q = J;
  const Matrix<Scalar, n, n> I = kernel::identity<Matrix<Scalar, n, n>>();
  for (int i = 0; i < n; ++i) {
    J(i, i) = by.kept(i);
    Q(i, i) = by.added(i);
  }
  ExtendedMemory<Scalar, n, n, 0> memory;
  ExtendedStep<Scalar> two(memory);
  two.load(belief.U.data(), belief.D.data(), belief.extended ? belief.U_low.data() : nullptr,
           belief.extended ? belief.D_low.data() : nullptr);
  two.load_state(belief.x.data(), belief.x_low.data());
  if (!two.move(J.data(), I.data(), Q.data(), nullptr)) return Status::invalid_option;
  FactoredBelief<Scalar, n> next;
  const Status status = store_extended(two, next);
  if (status == Status::ok) commit(belief, next);
  return status;
}

/// A belief with a window begins anew at its present; accuracy_not_met where a state stays known better than
/// x says.
template <typename Belief, typename Scalar, int n>
  requires requires(Belief& belief, const Estimate<Scalar, n>& estimate) { belief.reset(estimate, 0.0); }
[[nodiscard]] Status loosen(Belief& belief, const Loosening<Scalar, n>& by, double time) {
  WatchedEstimate<Scalar, n> present;
  present.x = belief.x();
  present.P = belief.P();
  if (!all_finite(present.P)) return Status::covariance_lost;
  Status status = loosen(present, by, time);
  if constexpr (requires {
                  belief.x_low();
                }) {  // what x lacks would be lost: more than a state's deviation bears?
    const Vector<Scalar, n> low = belief.x_low();
    for (int i = 0; i < n && status == Status::ok; ++i) {
      if (low(i) != Scalar(0) && low_digits_tell(low(i), present.P(i, i))) status = Status::accuracy_not_met;
    }
  }
  const auto held = belief.last_control();
  if (status == Status::ok) status = belief.reset(present, time);
  if (status == Status::ok) belief.last_control() = held;
  return status;
}

/// Of a state in a space P is in the tangent at it, and the state stays.
template <typename Scalar, typename D, typename Local, int n>
[[nodiscard]] Status loosen(LocalBelief<Scalar, D, Local>& belief, const Loosening<Scalar, n>& by,
                            double time) {
  return loosen(belief.local, by, time);
}
template <typename Belief, typename Scalar, int n>
  requires requires(Belief& belief, const Estimate<Scalar, n>& estimate) {
    belief.reset(belief.x(), estimate, 0.0);
  }
[[nodiscard]] Status loosen(Belief& belief, const Loosening<Scalar, n>& by, double time) {
  WatchedEstimate<Scalar, n> present;
  present.P = belief.P();
  if (!all_finite(present.P)) return Status::covariance_lost;
  Status status = loosen(present, by, time);
  const auto held = belief.last_control();
  if (status == Status::ok) status = belief.reset(belief.x(), present, time);
  if (status == Status::ok) belief.last_control() = held;
  return status;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
