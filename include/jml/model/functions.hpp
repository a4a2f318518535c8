// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Every function of a model as an estimator calls it: the user's where given, else derived.
///
/// `at` is a StepContext; a model that does not ask for it never sees it. Results are plain fixed-size
/// values.
#pragma once

#include <jml/model/call.hpp>
#include <jml/model/jacobian.hpp>
#include <jml/model/sdc.hpp>
#include <type_traits>

namespace jml {

template <typename D>
inline constexpr int states_of = DynamicsTraits<D>::states;
template <typename S>
inline constexpr int measurements_of = SensorTraits<S>::measurements;

/// f(x), n. T may be a dual number.
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
                                       At>) {
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
  return detail::HasHook<detail::hooks::DisturbanceInput, D, X, At>;
}
template <typename D, typename X, typename At>
constexpr bool has_disturbance_mean() {
  constexpr bool has = detail::HasHook<detail::hooks::DisturbanceMean, D, X, At>;
  static_assert(
      !requires { &D::disturbance_mean; } || has,
      "jml: disturbance_mean exists but does not accept (), (x) or (x, at): check its arguments and const");
  return has;
}

/// G, n×q.
template <typename T, int n, typename D, typename At>
Matrix<T, n, DynamicsTraits<D>::disturbances> disturbance_input(const D& d, const Vector<T, n>& x,
                                                                const At& at) {
  constexpr int q = DynamicsTraits<D>::disturbances;
  if constexpr (has_disturbance_input<D, Vector<T, n>, At>()) {
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
  if constexpr (detail::HasHook<detail::hooks::DisturbanceMean, D, Vector<T, n>, At>) {
    const Vector<T, q> w = detail::evaluate<detail::hooks::DisturbanceMean, q, 1>(d, x, at);
    return dynamics(d, x, at) + disturbance_input(d, x, at) * w;
  } else {
    return dynamics(d, x, at);
  }
}

/// m(x), p. T may be a dual number.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Vector<T, measurements_of<S>> measurement(const S& s, const Vector<T, n>& x, const At& at) {
  using namespace detail;
  constexpr bool fits = !requires {
    requires SensorTraits<S>::looks_into_struct && takes_other_state<decltype(&S::measurement), n>;
  };
  if constexpr (fits && HasHook<hooks::Measurement, S, Vector<T, n>, At>) {
    if constexpr (require_value_of<measurements_of<S>, T, decltype(ask<hooks::Measurement>(s, x, at))>())
      return ask<hooks::Measurement>(s, x, at);
    else
      return {};
  } else {
    static_assert(
        fits && HasHook<hooks::Measurement, S, Vector<T, n>, At>,
        "jml: the sensor's measurement(x) does not accept this model's state: check its size and scalar");
    return {};
  }
}

/// m_x(x), p×n.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Matrix<T, measurements_of<S>, n> measurement_jacobian(const S& s, const Vector<T, n>& x,
                                                                        const At& at) {
  const auto given = detail::hook<detail::hooks::MeasurementJacobian>(s);
  constexpr bool fits = !requires {
    requires SensorTraits<S>::looks_into_struct &&
                 detail::takes_other_state<decltype(&S::measurement_jacobian), n>;
  };
  static_assert(fits, "jml: measurement_jacobian(x) takes a state of another size than the model's");
  static_assert(
      !std::is_floating_point_v<T> || !requires { &S::measurement_jacobian; } ||
          detail::Callable<decltype(given), Vector<T, n>, At>,
      "jml: measurement_jacobian exists but does not accept (x) or (x, at): check its arguments and const");
  if constexpr (!fits) {
    return {};
  } else if constexpr (detail::Generic<decltype(given), Vector<T, n>, At>) {
    if constexpr (detail::require_shape<measurements_of<S>, n, decltype(given), Vector<T, n>, At>())
      return detail::call(given, x, at);
    else
      return {};
  } else if constexpr (detail::Generic<detail::HookOf<detail::hooks::Measurement, S>, Vector<Dual<T, n>, n>,
                                       At>) {
    return derive_jacobian<measurements_of<S>>([&](const auto& z) { return measurement(s, z, at); }, x);
  } else {
    static_assert(
        detail::Generic<detail::HookOf<detail::hooks::Measurement, S>, Vector<Dual<T, n>, n>, At>,
        "jml: give the sensor a measurement_jacobian(x), or make measurement(x) a template over the "
        "scalar so that jml can derive it with dual numbers");
    return {};
  }
}

/// y - ŷ, p, through the sensor's residual hook where it has one.
template <typename T, int p, typename S>
JML_INLINE inline Vector<T, p> measurement_residual(const S& s, const Vector<T, p>& y,
                                                    const Vector<T, p>& predicted) {
  static_assert(
      !requires { &S::residual; } || requires { SensorTraits<S>::residual(s, y, predicted); },
      "jml: residual exists but does not accept (y, predicted): check its arguments and const");
  if constexpr (requires { SensorTraits<S>::residual(s, y, predicted); }) {
    using Value = std::remove_cvref_t<decltype(SensorTraits<S>::residual(s, y, predicted))>;
    static_assert(
        std::is_base_of_v<Eigen::PlainObjectBase<Value>, Value>,
        "jml: residual must return a jml::Vector<T, measurements>, not auto of an Eigen expression");
    static_assert(int(Value::RowsAtCompileTime) == p && int(Value::ColsAtCompileTime) == 1,
                  "jml: residual returns a vector of the wrong size: it has as many entries as y");
    return SensorTraits<S>::residual(s, y, predicted);
  } else {
    return y - predicted;
  }
}

/// M(x; reference), p×n: the model's own where it fits the reference, else the derived one.
template <bool about_origin, typename T, int n, typename S, typename At>
Matrix<T, measurements_of<S>, n> measurement_sdc(const S& s, const Vector<T, n>& x,
                                                 const Vector<T, n>& reference, const At& at) {
  using Traits = SensorTraits<S>;
  const auto given = detail::hook<detail::hooks::MeasurementSdc>(s);
  static_assert(
      !requires { &S::measurement_sdc; } || detail::Callable<decltype(given), Vector<T, n>, At>,
      "jml: measurement_sdc exists but does not accept (x) or (x, at): check its arguments and const");
  if constexpr (about_origin && detail::Callable<decltype(given), Vector<T, n>, At>) {
    static_assert(detail::require_shape<measurements_of<S>, n, decltype(given), Vector<T, n>, At>());
    return detail::call(given, x, at);
  } else if constexpr (requires { Traits::sdc_about(s, x, reference, at); }) {
    return Traits::sdc_about(s, x, reference, at);
  } else if constexpr (requires { Traits::sdc_about(s, x, reference); }) {
    return Traits::sdc_about(s, x, reference);
  } else if constexpr (Traits::linear) {
    return measurement_jacobian(s, x, at);
  } else {
    constexpr int p = measurements_of<S>;
    const Vector<T, p> here = measurement(s, x, at), there = measurement(s, reference, at);
    // A residual of angles is one of neighbours: M d says how many turns lie between the two.
    const auto left = [&](const Vector<T, p>& along) {
      return measurement_residual(s, here, Vector<T, p>(there + along));
    };
    return derive_sdc<p>([&](const Vector<T, n>& z) { return measurement_jacobian(s, z, at); }, left,
                         detail::sizes(here, there), x, reference);
  }
}

/// R, p×p.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Matrix<T, measurements_of<S>, measurements_of<S>> noise_covariance(const S& s,
                                                                                     const Vector<T, n>& x,
                                                                                     const At& at) {
  static_assert(detail::HasHook<detail::hooks::NoiseCovariance, S, Vector<T, n>, At>,
                "jml: a sensor needs noise_covariance(), p×p, as (), (x) or (x, at), const");
  if constexpr (detail::HasHook<detail::hooks::NoiseCovariance, S, Vector<T, n>, At>)
    return detail::evaluate<detail::hooks::NoiseCovariance, measurements_of<S>, measurements_of<S>>(s, x, at);
  else
    return {};
}

/// R of a measurement in continuous time, p×p, a two-sided spectral density.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Matrix<T, measurements_of<S>, measurements_of<S>> noise_spectral_density(
    const S& s, const Vector<T, n>& x, const At& at) {
  static_assert(
      detail::HasHook<detail::hooks::NoiseSpectralDensity, S, Vector<T, n>, At>,
      "jml: a sensor in continuous time needs noise_spectral_density(), p×p, as (), (x) or (x, at), "
      "const");
  if constexpr (detail::HasHook<detail::hooks::NoiseSpectralDensity, S, Vector<T, n>, At>)
    return detail::evaluate<detail::hooks::NoiseSpectralDensity, measurements_of<S>, measurements_of<S>>(s, x,
                                                                                                         at);
  else
    return {};
}

}  // namespace jml
