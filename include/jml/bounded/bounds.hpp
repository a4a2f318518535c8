// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The bounds of disturbance and noise that a model states, |w| ≤ ū and |v| ≤ b, as a bounded-noise estimator
/// reads them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/interval.hpp>
#include <jml/model/concepts.hpp>

namespace jml::detail {
struct NoNumbers;
}
namespace Eigen::internal {
template <>
struct traits<jml::detail::NoNumbers> {
  using StorageKind = Dense;
};
}  // namespace Eigen::internal

namespace jml {

/// ū, q: |w| ≤ ū by component, per step.
template <typename T, int n, typename D, typename At>
JML_INLINE inline Vector<T, DynamicsTraits<D>::disturbances> disturbance_bound(const D& d,
                                                                               const Vector<T, n>& x,
                                                                               const At& at) {
  constexpr int q = DynamicsTraits<D>::disturbances;
  static_assert(q == 0 || detail::HasHook<detail::hooks::DisturbanceBound, D, Vector<T, n>, At>,
                "jml: bounded noise: dynamics with disturbances need disturbance_bound(), q, as (), (x) or "
                "(x, at), const");
  static_assert(!detail::NoisyDynamicsIn<D, T, n, At>,
                "jml: a box is of noise that adds: dynamics(x), and disturbance_input() where it is not the "
                "identity; dynamics(x, w) is for the methods with a covariance");
  if constexpr (q == 0)
    return {};
  else
    return detail::evaluate<detail::hooks::DisturbanceBound, q, 1>(d, x, at);
}

/// b, p: |v| ≤ b by component.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Vector<T, measurements_of<S>> noise_bound(const S& s, const Vector<T, n>& x, const At& at) {
  static_assert(detail::HasHook<detail::hooks::NoiseBound, S, Vector<T, n>, At>,
                "jml: bounded noise: a sensor needs noise_bound(), p, as (), (x) or (x, at), const");
  static_assert(
      !detail::NoisySensorIn<S, T, n, At>,
      "jml: a box is of noise that adds: measurement(x); measurement(x, v) is for the methods with a "
      "covariance");
  return detail::evaluate<detail::hooks::NoiseBound, measurements_of<S>, 1>(s, x, at);
}

/// True where every entry is finite and zero or positive.
template <typename Scalar, int size>
[[nodiscard]] JML_INLINE inline bool is_bound(const Vector<Scalar, size>& bound) {
  bool good = all_finite(bound);
  for (int i = 0; i < size; ++i) good &= bound(i) >= Scalar(0);
  return good;
}

namespace detail {

/// A bound that was stated in double, not below that in a shorter scalar.
template <typename Scalar, int size>
[[nodiscard]] Vector<Scalar, size> rounded_up(Vector<Scalar, size> bound) {
  if constexpr (!std::is_same_v<Scalar, double>) {
    for (int i = 0; i < size; ++i) bound(i) = bound(i) == Scalar(0) ? bound(i) : above_any(bound(i));
  }
  return bound;
}

/// A box that is no state of numbers: Eigen has two ways to make those of it, and takes none.
struct NoNumbers {};
template <typename Scalar, int n>
struct BoxAlone : Vector<Interval<Scalar>, n>, Eigen::EigenBase<NoNumbers> {};

/// False where a model has the function, with x for an argument, but not as a template over the scalar: the
/// intervals of a box would be converted into numbers.
template <typename Hook, typename D, typename Scalar, int n, typename At>
consteval bool takes_box() {
  using X = Vector<Interval<Scalar>, n>;
  if constexpr (Generic<HookOf<Hook, D>, X, At>)
    return true;
  else if constexpr (ReadsContext<Hook, D, X, At> || ReadsState<Hook, D, X>)
    return ReadsContext<Hook, D, BoxAlone<Scalar, n>, At> || ReadsState<Hook, D, BoxAlone<Scalar, n>>;
  else
    return true;
}

}  // namespace detail

/// An enclosure of w̄ over a box, q: the known part of the disturbance; zero where the model has none.
template <typename Scalar, int n, typename D, typename At>
Vector<Interval<Scalar>, DynamicsTraits<D>::disturbances> disturbance_mean_over(
    const D& d, const Vector<Interval<Scalar>, n>& box, const At& at) {
  using Traits = DynamicsTraits<D>;
  using Range = Interval<Scalar>;
  const auto given = detail::hook<detail::hooks::DisturbanceMean>(d);
  constexpr bool constant = requires { Traits::disturbance_mean(d); };
  constexpr bool takes_template = detail::takes_box<detail::hooks::DisturbanceMean, D, Scalar, n, At>();
  static_assert(
      constant || takes_template,
      "jml: bounded noise: the disturbance's mean reads the state: make disturbance_mean(x) a template "
      "over the scalar, so that it can be enclosed over a box, or use jml::Linearised");
  if constexpr (constant)
    return kernel::cast<Range>(given());
  else if constexpr (takes_template && detail::Callable<decltype(given), Vector<Range, n>, At>)
    return kernel::cast<Range>(detail::call(given, box, at));
  else
    return kernel::filled<Vector<Range, Traits::disturbances>>(Range(Scalar(0)));
}

/// An enclosure of G over a box, n×q.
template <typename Scalar, int n, typename D, typename At>
Matrix<Interval<Scalar>, n, DynamicsTraits<D>::disturbances> disturbance_input_over(
    const D& d, const Vector<Interval<Scalar>, n>& box, const At& at) {
  constexpr bool constant = requires { DynamicsTraits<D>::disturbance_input(d); };
  constexpr bool takes_template = detail::takes_box<detail::hooks::DisturbanceInput, D, Scalar, n, At>();
  static_assert(
      constant || takes_template,
      "jml: bounded noise: G reads the state: make disturbance_input(x) a template over the scalar, so "
      "that it can be enclosed over a box, or use jml::Linearised");
  if constexpr (constant || takes_template)
    return disturbance_input(d, box, at);
  else
    return {};
}

}  // namespace jml
#include <jml/warnings_end.hpp>
