// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The bounds of disturbance and noise that a model states, |w| ≤ ū and |v| ≤ b, as a bounded-noise estimator
/// reads them.
#pragma once

#include <jml/bounded/interval.hpp>
#include <jml/model/concepts.hpp>

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

}  // namespace detail

/// An enclosure of w̄ over a box, q: the known part of the disturbance; zero where the model has none.
template <typename Scalar, int n, typename D, typename At>
Vector<Interval<Scalar>, DynamicsTraits<D>::disturbances> disturbance_mean_over(
    const D& d, const Vector<Interval<Scalar>, n>& box, const At& at) {
  using Traits = DynamicsTraits<D>;
  using Range = Interval<Scalar>;
  const auto given = detail::hook<detail::hooks::DisturbanceMean>(d);
  constexpr bool constant = requires { Traits::disturbance_mean(d); };
  constexpr bool plain = requires { &D::disturbance_mean; };
  static_assert(
      constant || !plain,
      "jml: bounded noise: the disturbance's mean reads the state: make disturbance_mean(x) a template "
      "over the scalar, so that it can be enclosed over a box, or use jml::Linearised");
  if constexpr (constant)
    return kernel::cast<Range>(given());
  else if constexpr (!plain && detail::Callable<decltype(given), Vector<Range, n>, At>)
    return kernel::cast<Range>(detail::call(given, box, at));
  else
    return kernel::filled<Vector<Range, Traits::disturbances>>(Range(Scalar(0)));
}

/// An enclosure of G over a box, n×q.
template <typename Scalar, int n, typename D, typename At>
Matrix<Interval<Scalar>, n, DynamicsTraits<D>::disturbances> disturbance_input_over(
    const D& d, const Vector<Interval<Scalar>, n>& box, const At& at) {
  // A function that is no template would have the box converted into a vector of numbers.
  constexpr bool constant = requires { DynamicsTraits<D>::disturbance_input(d); };
  constexpr bool plain = requires { &D::disturbance_input; };
  static_assert(
      constant || !plain,
      "jml: bounded noise: G reads the state: make disturbance_input(x) a template over the scalar, so "
      "that it can be enclosed over a box, or use jml::Linearised");
  if constexpr (constant || !plain) return disturbance_input(d, box, at);
}

}  // namespace jml
