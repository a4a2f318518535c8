// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Every function of a model as an estimator calls it: the user's where given, else derived.
///
/// `at` is an StepContext; a model that does not ask for it never sees it. Results are plain fixed-size values.
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
  static_assert(detail::Callable<decltype(detail::dynamics_of(d)), Vector<T, n>, At>,
                "jml: the model has no dynamics(x) or dynamics(x, at) that is const and accepts "
                "jml::Vector<T, states>");
  static_assert(detail::require_shape<n, 1, decltype(detail::dynamics_of(d)), Vector<T, n>, At>());
  return detail::call(detail::dynamics_of(d), x, at);
}

/// f_x(x), n×n.
template <typename T, int n, typename D, typename At>
JML_INLINE inline Matrix<T, n, n> dynamics_jacobian(const D& d, const Vector<T, n>& x,
                                                                const At& at) {
  const auto given = detail::jacobian_of(d);
  if constexpr (detail::Generic<decltype(given), Vector<T, n>, At>) {
    static_assert(detail::require_shape<n, n, decltype(given), Vector<T, n>, At>());
    return detail::call(given, x, at);
  } else {
    static_assert(
        detail::Generic<decltype(detail::dynamics_of(d)), Vector<Dual<T, n>, n>, At>,
        "jml: give the dynamics a dynamics_jacobian(x), or make dynamics(x) a template over the scalar "
        "so that jml can derive it with dual numbers (and take the StepContext as const auto&)");
    return derive_jacobian<n>([&](const auto& z) { return dynamics(d, z, at); }, x);
  }
}

/// F(x; reference), n×n: the model's own where it fits the reference, else the derived one.
template <bool about_origin, typename T, int n, typename D, typename At>
Matrix<T, n, n> dynamics_sdc(const D& d, const Vector<T, n>& x, const Vector<T, n>& reference, const At& at) {
  using Traits = DynamicsTraits<D>;
  const auto given = [&d](const auto&... a) -> decltype(Traits::sdc(d, a...)) {
    return Traits::sdc(d, a...);
  };
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
  } else {
    const Vector<T, n> here = dynamics(d, x, at), there = dynamics(d, reference, at);
    return derive_sdc<n>([&](const Vector<T, n>& z) { return dynamics_jacobian(d, z, at); },
                         Vector<T, n>(here - there), detail::sizes(here, there), x, reference);
  }
}

/// G, n×q.
template <typename T, int n, typename D, typename At>
Matrix<T, n, DynamicsTraits<D>::disturbances> disturbance_input(const D& d, const Vector<T, n>& x,
                                                                const At& at) {
  using Traits = DynamicsTraits<D>;
  const auto given = [&d](const auto&... a) -> decltype(Traits::disturbance_input(d, a...)) {
    return Traits::disturbance_input(d, a...);
  };
  if constexpr (detail::Callable<decltype(given), Vector<T, n>, At>) {
    static_assert(detail::require_shape<n, Traits::disturbances, decltype(given), Vector<T, n>, At>());
    return kernel::cast<T>(detail::call(given, x, at));
  } else {
    static_assert(Traits::disturbances == n || Traits::disturbances == 0,
                  "jml: the dynamics have fewer disturbances than states: give disturbance_input(), n×q, as "
                  "(), (x) or (x, at), const");
    return kernel::identity<Matrix<T, n, Traits::disturbances>>();
  }
}

/// False where the model leaves G out, so that G Q Gᵀ = Q.
template <typename D, typename X, typename At>
constexpr bool has_disturbance_input() {
  using T = DynamicsTraits<D>;
  return requires(const D& d) { T::disturbance_input(d); } || requires(const D& d, const X& x) {
    T::disturbance_input(d, x);
  } || requires(const D& d, const X& x, const At& at) { T::disturbance_input(d, x, at); };
}

template <typename D, typename X, typename At>
constexpr bool has_disturbance_mean() {
  using T = DynamicsTraits<D>;
  static_assert(
      !requires { &D::disturbance_mean; } || requires(const D& d) { T::disturbance_mean(d); } ||
          requires(const D& d, const X& x) { T::disturbance_mean(d, x); } ||
          requires(const D& d, const X& x, const At& at) { T::disturbance_mean(d, x, at); },
      "jml: disturbance_mean exists but does not accept (), (x) or (x, at): check its arguments and const");
  return requires(const D& d) { T::disturbance_mean(d); } || requires(const D& d, const X& x) {
    T::disturbance_mean(d, x);
  } || requires(const D& d, const X& x, const At& at) { T::disturbance_mean(d, x, at); };
}

/// Q, q×q, a covariance per step.
template <typename T, int n, typename D, typename At>
Matrix<T, DynamicsTraits<D>::disturbances, DynamicsTraits<D>::disturbances> disturbance_covariance(
    const D& d, const Vector<T, n>& x, const At& at) {
  using Traits = DynamicsTraits<D>;
  const auto given = [&d](const auto&... a) -> decltype(Traits::disturbance_covariance(d, a...)) {
    return Traits::disturbance_covariance(d, a...);
  };
  static_assert(Traits::disturbances == 0 || detail::Callable<decltype(given), Vector<T, n>, At>,
                "jml: discrete dynamics with disturbances need disturbance_covariance(), q×q");
  if constexpr (Traits::disturbances == 0) {
    return {};
  } else {
    static_assert(detail::require_shape<Traits::disturbances, Traits::disturbances, decltype(given),
                                        Vector<T, n>, At>());
    return kernel::cast<T>(detail::call(given, x, at));
  }
}

/// Q of continuous dynamics, q×q, a two-sided spectral density.
template <typename T, int n, typename D, typename At>
Matrix<T, DynamicsTraits<D>::disturbances, DynamicsTraits<D>::disturbances> disturbance_spectral_density(
    const D& d, const Vector<T, n>& x, const At& at) {
  using Traits = DynamicsTraits<D>;
  const auto given = [&d](const auto&... a) -> decltype(Traits::disturbance_spectral_density(d, a...)) {
    return Traits::disturbance_spectral_density(d, a...);
  };
  static_assert(Traits::disturbances == 0 || detail::Callable<decltype(given), Vector<T, n>, At>,
                "jml: continuous dynamics with disturbances need disturbance_spectral_density(), q×q");
  if constexpr (Traits::disturbances == 0) {
    return {};
  } else {
    static_assert(detail::require_shape<Traits::disturbances, Traits::disturbances, decltype(given),
                                        Vector<T, n>, At>());
    return kernel::cast<T>(detail::call(given, x, at));
  }
}

/// f(x) + G w̄, n: the prediction, or the mean of ẋ.
template <typename T, int n, typename D, typename At>
JML_INLINE inline Vector<T, n> predicted_state(const D& d, const Vector<T, n>& x, const At& at) {
  using Traits = DynamicsTraits<D>;
  const auto mean = [&d](const auto&... a) -> decltype(Traits::disturbance_mean(d, a...)) {
    return Traits::disturbance_mean(d, a...);
  };
  if constexpr (detail::Callable<decltype(mean), Vector<T, n>, At>) {
    const Vector<T, Traits::disturbances> w = kernel::cast<T>(detail::call(mean, x, at));
    return dynamics(d, x, at) + disturbance_input(d, x, at) * w;
  } else {
    return dynamics(d, x, at);
  }
}

/// m(x), p. T may be a dual number.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Vector<T, measurements_of<S>> measurement(const S& s, const Vector<T, n>& x,
                                                                        const At& at) {
  static_assert(
      detail::Callable<decltype(detail::measurement_of(s)), Vector<T, n>, At>,
      "jml: the sensor's measurement(x) does not accept this model's state: check its size and scalar");
  static_assert(
      detail::require_shape<measurements_of<S>, 1, decltype(detail::measurement_of(s)), Vector<T, n>, At>());
  return detail::call(detail::measurement_of(s), x, at);
}

/// m_x(x), p×n.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Matrix<T, measurements_of<S>, n> measurement_jacobian(const S& s,
                                                                                    const Vector<T, n>& x,
                                                                                    const At& at) {
  const auto given = detail::sensor_jacobian_of(s);
  if constexpr (detail::Generic<decltype(given), Vector<T, n>, At>) {
    static_assert(detail::require_shape<measurements_of<S>, n, decltype(given), Vector<T, n>, At>());
    return detail::call(given, x, at);
  } else {
    static_assert(
        detail::Generic<decltype(detail::measurement_of(s)), Vector<Dual<T, n>, n>, At>,
        "jml: give the sensor a measurement_jacobian(x), or make measurement(x) a template over the "
        "scalar so that jml can derive it with dual numbers");
    return derive_jacobian<measurements_of<S>>([&](const auto& z) { return measurement(s, z, at); }, x);
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
  const auto given = [&s](const auto&... a) -> decltype(Traits::sdc(s, a...)) {
    return Traits::sdc(s, a...);
  };
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
  } else {
    constexpr int p = measurements_of<S>;
    const Vector<T, p> here = measurement(s, x, at), there = measurement(s, reference, at);
    return derive_sdc<p>([&](const Vector<T, n>& z) { return measurement_jacobian(s, z, at); },
                         measurement_residual(s, here, there), detail::sizes(here, there), x, reference);
  }
}

/// R, p×p.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Matrix<T, measurements_of<S>, measurements_of<S>> noise_covariance(
    const S& s, const Vector<T, n>& x, const At& at) {
  using Traits = SensorTraits<S>;
  const auto given = [&s](const auto&... a) -> decltype(Traits::noise_covariance(s, a...)) {
    return Traits::noise_covariance(s, a...);
  };
  static_assert(detail::Callable<decltype(given), Vector<T, n>, At>,
                "jml: a sensor needs noise_covariance(), p×p, as (), (x) or (x, at), const");
  static_assert(
      detail::require_shape<measurements_of<S>, measurements_of<S>, decltype(given), Vector<T, n>, At>());
  return kernel::cast<T>(detail::call(given, x, at));
}

/// R of a measurement in continuous time, p×p, a two-sided spectral density.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Matrix<T, measurements_of<S>, measurements_of<S>> noise_spectral_density(
    const S& s, const Vector<T, n>& x, const At& at) {
  using Traits = SensorTraits<S>;
  const auto given = [&s](const auto&... a) -> decltype(Traits::noise_spectral_density(s, a...)) {
    return Traits::noise_spectral_density(s, a...);
  };
  static_assert(
      detail::Callable<decltype(given), Vector<T, n>, At>,
      "jml: a sensor in continuous time needs noise_spectral_density(), p×p, as (), (x) or (x, at), "
      "const");
  static_assert(
      detail::require_shape<measurements_of<S>, measurements_of<S>, decltype(given), Vector<T, n>, At>());
  return kernel::cast<T>(detail::call(given, x, at));
}

}  // namespace jml
