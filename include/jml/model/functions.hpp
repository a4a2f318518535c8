// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Every function of a model as an estimator calls it: the user's where given, else derived.
///
/// `at` is a StepContext; a model that does not ask for it never sees it. Results are plain fixed-size
/// values.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/noise.hpp>
#include <jml/model/sdc.hpp>
#include <jml/model/sensor_functions.hpp>
#include <type_traits>

namespace jml {

/// n: the numbers of a state.
template <typename D>
inline constexpr int states_of = DynamicsTraits<D>::states;

namespace detail {
template <typename D>
struct SpaceOfModel {
  using type = Euclidean<states_of<D>>;
};
template <typename D>
  requires requires { typename DynamicsTraits<D>::space; }
struct SpaceOfModel<D> {
  using type = typename DynamicsTraits<D>::space;
};
}  // namespace detail

/// The space of the states of D, and its degrees of freedom: the size of P, of a gain, of an error.
template <typename D>
using SpaceOf = detail::WholeSpace<typename detail::SpaceOfModel<D>::type>;
/// Degrees of freedom: n in ℝⁿ.
template <typename D>
inline constexpr int degrees_of = SpaceOf<D>::tangent;
/// States and errors are the same thing, and add.
template <typename D>
inline constexpr bool is_flat =
    std::is_same_v<typename detail::SpaceOfModel<D>::type, Euclidean<states_of<D>>>;

/// f(x), n, or f(x, w̄). T may be a dual number.
template <typename T, int n, typename D, typename At>
JML_INLINE inline Vector<T, n> dynamics(const D& d, const Vector<T, n>& x, const At& at) {
  using namespace detail;
  constexpr bool fits = !requires {
    requires DynamicsTraits<D>::looks_into_struct && takes_other_state<decltype(&D::dynamics), n>;
  };
  static_assert(fits, "jml: dynamics(x) takes a state of another size than `states`");
  if constexpr (!fits) {
    return {};
  } else if constexpr (HasHook<hooks::Dynamics, D, Vector<T, n>, At>) {
    if constexpr (require_value_of<n, T, decltype(ask<hooks::Dynamics>(d, x, at))>())
      return ask<hooks::Dynamics>(d, x, at);
    else
      return {};
  } else if constexpr (NoisyDynamicsIn<D, T, n, At>) {
    return ask_noisy<hooks::Dynamics>(d, x, mean_disturbance(d, x, at), at);
  } else {
    static_assert(HasHook<hooks::Dynamics, D, Vector<T, n>, At>,
                  "jml: the model has no dynamics(x) or dynamics(x, at) that is const and accepts "
                  "jml::Vector<T, states>");
    return {};
  }
}

/// f_x(x), n×n.
template <typename T, int n, typename D, typename At>
JML_INLINE inline Matrix<T, n, n> dynamics_jacobian(const D& d, const Vector<T, n>& x, const At& at) {
  const auto given = detail::hook<detail::hooks::DynamicsJacobian>(d);
  constexpr bool fits = !requires {
    requires DynamicsTraits<D>::looks_into_struct &&
                 detail::takes_other_state<decltype(&D::dynamics_jacobian), n>;
  };
  static_assert(fits, "jml: dynamics_jacobian(x) takes a state of another size than `states`");
  static_assert(
      !std::is_floating_point_v<T> || !requires { &D::dynamics_jacobian; } ||
          detail::Callable<decltype(given), Vector<T, n>, At>,
      "jml: dynamics_jacobian exists but does not accept (x) or (x, at): check its arguments and const");
  if constexpr (!fits) {
    return {};
  } else if constexpr (detail::Generic<decltype(given), Vector<T, n>, At>) {
    if constexpr (detail::require_shape<n, n, decltype(given), Vector<T, n>, At>())
      return detail::call(given, x, at);
    else
      return {};
  } else if constexpr (detail::Generic<detail::HookOf<detail::hooks::Dynamics, D>, Vector<Dual<T, n>, n>,
                                       At> ||
                       detail::NoisyDynamicsIn<D, Dual<T, n>, n, At>) {
    return derive_jacobian<n>([&](const auto& z) { return dynamics(d, z, at); }, x);
  } else {
    static_assert(
        detail::Generic<detail::HookOf<detail::hooks::Dynamics, D>, Vector<Dual<T, n>, n>, At>,
        "jml: give the dynamics a dynamics_jacobian(x), or make dynamics(x) a template over the scalar "
        "so that jml can derive it with dual numbers (and take the StepContext as const auto&)");
    return {};
  }
}

/// F(x; reference), n×n: the model's own where it fits the reference, else the derived one.
template <bool about_origin, typename T, int n, typename D, typename At>
Matrix<T, n, n> dynamics_sdc(const D& d, const Vector<T, n>& x, const Vector<T, n>& reference, const At& at) {
  using Traits = DynamicsTraits<D>;
  const auto given = detail::hook<detail::hooks::DynamicsSdc>(d);
  static_assert(
      !requires { &D::dynamics_sdc; } || detail::Callable<decltype(given), Vector<T, n>, At>,
      "jml: dynamics_sdc exists but does not accept (x) or (x, at): check its arguments and const");
  if constexpr (about_origin && detail::Callable<decltype(given), Vector<T, n>, At>) {
    static_assert(detail::require_shape<n, n, decltype(given), Vector<T, n>, At>());
    return detail::call(given, x, at);
  } else if constexpr (requires { Traits::sdc_about(d, x, reference, at); }) {
    return Traits::sdc_about(d, x, reference, at);
  } else if constexpr (requires { Traits::sdc_about(d, x, reference); }) {
    return Traits::sdc_about(d, x, reference);
  } else if constexpr (Traits::linear) {
    return dynamics_jacobian(d, x, at);
  } else {
    const Vector<T, n> here = dynamics(d, x, at), there = dynamics(d, reference, at);
    return derive_sdc<n>([&](const Vector<T, n>& z) { return dynamics_jacobian(d, z, at); },
                         Vector<T, n>(here - there), detail::sizes(here, there), x, reference);
  }
}

/// False where the model leaves G out, so that G Q Gᵀ = Q.
template <typename D, typename X, typename At>
constexpr bool has_disturbance_input() {
  return detail::HasHook<detail::hooks::DisturbanceInput, D, X, At> ||
         detail::NoisyDynamicsIn<D, typename X::Scalar, int(X::RowsAtCompileTime), At>;
}
/// False where the model leaves w̄ out: it is zero.
template <typename D, typename X, typename At>
constexpr bool has_disturbance_mean() {
  constexpr bool has = detail::HasHook<detail::hooks::DisturbanceMean, D, X, At>;
  static_assert(
      !requires { &D::disturbance_mean; } || has,
      "jml: disturbance_mean exists but does not accept (), (x) or (x, at): check its arguments and const");
  return has && !detail::NoisyDynamicsIn<D, typename X::Scalar, int(X::RowsAtCompileTime), At>;
}

/// G, n×q, or f_w at w̄.
template <typename T, int n, typename D, typename At>
Matrix<T, n, DynamicsTraits<D>::disturbances> disturbance_input(const D& d, const Vector<T, n>& x,
                                                                const At& at) {
  constexpr int q = DynamicsTraits<D>::disturbances;
  if constexpr (detail::NoisyDynamicsIn<D, T, n, At>) {
    return detail::noise_slope<detail::hooks::Dynamics, n>(d, x, detail::mean_disturbance(d, x, at), at);
  } else if constexpr (has_disturbance_input<D, Vector<T, n>, At>()) {
    return detail::evaluate<detail::hooks::DisturbanceInput, n, q>(d, x, at);
  } else {
    static_assert(q == n || q == 0,
                  "jml: the dynamics have fewer disturbances than states: give disturbance_input(), n×q, as "
                  "(), (x) or (x, at), const");
    return kernel::identity<Matrix<T, n, q>>();
  }
}

/// Q, q×q, a covariance per step.
template <typename T, int n, typename D, typename At>
Matrix<T, DynamicsTraits<D>::disturbances, DynamicsTraits<D>::disturbances> disturbance_covariance(
    const D& d, const Vector<T, n>& x, const At& at) {
  constexpr int q = DynamicsTraits<D>::disturbances;
  static_assert(q == 0 || detail::HasHook<detail::hooks::DisturbanceCovariance, D, Vector<T, n>, At>,
                "jml: discrete dynamics with disturbances need disturbance_covariance(), q×q");
  if constexpr (q > 0 && detail::HasHook<detail::hooks::DisturbanceCovariance, D, Vector<T, n>, At>)
    return detail::evaluate<detail::hooks::DisturbanceCovariance, q, q>(d, x, at);
  else
    return {};
}

/// Q of continuous dynamics, q×q, a two-sided spectral density.
template <typename T, int n, typename D, typename At>
Matrix<T, DynamicsTraits<D>::disturbances, DynamicsTraits<D>::disturbances> disturbance_spectral_density(
    const D& d, const Vector<T, n>& x, const At& at) {
  constexpr int q = DynamicsTraits<D>::disturbances;
  static_assert(q == 0 || detail::HasHook<detail::hooks::DisturbanceSpectralDensity, D, Vector<T, n>, At>,
                "jml: continuous dynamics with disturbances need disturbance_spectral_density(), q×q");
  if constexpr (q > 0 && detail::HasHook<detail::hooks::DisturbanceSpectralDensity, D, Vector<T, n>, At>)
    return detail::evaluate<detail::hooks::DisturbanceSpectralDensity, q, q>(d, x, at);
  else
    return {};
}

/// f(x) + G w̄, n: the prediction, or the mean of ẋ.
template <typename T, int n, typename D, typename At>
JML_INLINE inline Vector<T, n> predicted_state(const D& d, const Vector<T, n>& x, const At& at) {
  constexpr int q = DynamicsTraits<D>::disturbances;
  if constexpr (has_disturbance_mean<D, Vector<T, n>, At>()) {
    const Vector<T, q> w = detail::evaluate<detail::hooks::DisturbanceMean, q, 1>(d, x, at);
    return dynamics(d, x, at) + disturbance_input(d, x, at) * w;
  } else {
    return dynamics(d, x, at);
  }
}

}  // namespace jml
#include <jml/warnings_end.hpp>
