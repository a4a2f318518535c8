// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// States that are known better than Scalar can say. The rounding of x, ε |x| a step, is no small part of
/// their deviations, and dynamics that expand make more of both: so their x moves in twice the digits until
/// the deviations are larger, or until nothing is dropped, as of a known constant.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/watched.hpp>
#include <jml/riccati/difference.hpp>
#include <jml/rounding.hpp>
#include <jml/twofold.hpp>

namespace jml::detail {

/// The dynamics of a model of steps are affine.
template <typename Model>
consteval bool is_affine() {
  if constexpr (requires(const Model& model) { model.dynamics; })
    return DynamicsTraits<std::remove_cvref_t<decltype(Model::dynamics)>>::linear;
  else
    return false;
}

/// `low`, a part of x that Scalar does not hold, is more than P may be off by, in deviations of that state.
template <typename Scalar>
[[nodiscard]] inline bool low_digits_tell(Scalar low, Scalar variance) {
  return !(low * low <= plain_error<Scalar> * plain_error<Scalar> * variance);
}

/// An ε of some state would be. (A start is no rare thing: what must call a cold function is cold itself.)
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE bool better_known_than_rounding(const Vector<Scalar, n>& x,
                                                           const Matrix<Scalar, n, n>& P) {
  bool better = false;
  for (int i = 0; i < n; ++i)
    better = better || low_digits_tell(std::numeric_limits<Scalar>::epsilon() * x(i), P(i, i));
  return better;
}

/// x of `belief` has low digits, or might get some with its next move.
template <typename Belief>
[[nodiscard]] JML_INLINE inline bool has_known_states(const Belief& belief) {
  bool known = is_extended(belief);
  for (int i = 0; i < Belief::states; ++i) known = known || belief.P(i, i) == typename Belief::Scalar(0);
  return known;
}

/// Whether affine dynamics move the states of variance zero from x without rounding.
template <typename Rule, typename Model, typename Scalar, int n, typename At>
[[nodiscard]] JML_RARE bool moves_known_exactly(const Rule& rule, const Model& model,
                                                const Vector<Scalar, n>& x, At at,
                                                Vector<Scalar, n> variances) {
  using T = Extended<Scalar>;
  const auto& d = model.dynamics;
  const Vector<Scalar, n> constant = predicted_state(d, kernel::zeros<Vector<Scalar, n>>(), at);
  const Vector<Scalar, n> moved = predicted_state(d, x, at);
  const Matrix<Scalar, n, n> A = dynamics_slot<Rule::A>(rule, d, x, x, at);
  bool exact = true;
  for (int i = 0; i < n; ++i) {
    if (variances(i) != Scalar(0)) continue;
    T sum(constant(i));
    for (int j = 0; j < n; ++j) sum = sum + T(A(i, j)) * T(x(j));
    const auto parts = in_two<Scalar>(sum);
    exact = exact && parts.low == Scalar(0) && parts.high == moved(i);
  }
  return exact;
}

/// The question of has_digits() of a step from `prior` over `at`. A belief without low digits is not asked.
template <typename Rule, typename Model, typename Belief, typename At>
struct KnownMove {
  const Rule& rule;
  const Model& model;
  const Belief& prior;
  const At& at;

  template <typename Variances>
  [[nodiscard]] JML_INLINE bool operator()(const Variances& variances) const {
    if constexpr (is_affine<Model>() && requires { prior.x_low; })
      return moves_known_exactly(rule, model, prior.x, at, variances);
    else
      return true;
  }
};
template <typename Rule, typename Model, typename Belief, typename At>  // clang 16 does not guess it
KnownMove(const Rule&, const Model&, const Belief&, const At&) -> KnownMove<Rule, Model, Belief, At>;

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
