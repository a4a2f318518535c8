// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Every function of a sensor as an estimator calls it: the user's where given, else derived.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/noise.hpp>
#include <jml/model/sdc.hpp>
#include <type_traits>

namespace jml {

/// p: the entries of a measurement.
template <typename S>
inline constexpr int measurements_of = SensorTraits<S>::measurements;

/// m(x), p, or m(x, 0). T may be a dual number.
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
  } else if constexpr (NoisySensorIn<S, T, n, At>) {
    constexpr int r = noises_of_sensor<S>();
    return ask_noisy<hooks::Measurement>(s, x, kernel::zeros<Vector<T, r>>(), at);
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
                                       At> ||
                       detail::NoisySensorIn<S, Dual<T, n>, n, At>) {
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

/// R, p×p, or m_v R m_vᵀ at v = 0.
template <typename T, int n, typename S, typename At>
JML_INLINE inline Matrix<T, measurements_of<S>, measurements_of<S>> noise_covariance(const S& s,
                                                                                     const Vector<T, n>& x,
                                                                                     const At& at) {
  static_assert(detail::HasHook<detail::hooks::NoiseCovariance, S, Vector<T, n>, At>,
                "jml: a sensor needs noise_covariance(), p×p, as (), (x) or (x, at), const");
  if constexpr (!detail::HasHook<detail::hooks::NoiseCovariance, S, Vector<T, n>, At>) {
    return {};
  } else if constexpr (detail::NoisySensorIn<S, T, n, At>) {
    constexpr int p = measurements_of<S>, r = detail::noises_of_sensor<S>();
    const Matrix<T, r, r> R = detail::evaluate<detail::hooks::NoiseCovariance, r, r>(s, x, at);
    const Matrix<T, p, r> m_v =
        detail::noise_slope<detail::hooks::Measurement, p>(s, x, kernel::zeros<Vector<T, r>>(), at);
    return kernel::symmetric_part(Matrix<T, p, p>(m_v * R * kernel::transposed(m_v)));
  } else {
    return detail::evaluate<detail::hooks::NoiseCovariance, measurements_of<S>, measurements_of<S>>(s, x, at);
  }
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
#include <jml/warnings_end.hpp>
