// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What counts as a model, and the sentences a user reads when theirs does not.
#pragma once

#include <concepts>
#include <jml/model/functions.hpp>

namespace jml {

template <typename D>
concept Dynamics = DynamicsTraits<D>::states > 0;

template <typename D>
concept DiscreteDynamics =
    Dynamics<D> && std::is_same_v<typename DynamicsTraits<D>::time_domain, DiscreteTime>;

template <typename D>
concept ContinuousDynamics =
    Dynamics<D> && std::is_same_v<typename DynamicsTraits<D>::time_domain, ContinuousTime>;

template <typename S>
concept Sensor = SensorTraits<S>::measurements > 0;

/// A sensor whose measurement is there all the time, with a spectral density of its noise.
template <typename S, typename X, typename At>
constexpr bool has_noise_spectral_density() {
  using T = SensorTraits<S>;
  return requires(const S& s) { T::noise_spectral_density(s); } || requires(const S& s, const X& x) {
    T::noise_spectral_density(s, x);
  } || requires(const S& s, const X& x, const At& at) { T::noise_spectral_density(s, x, at); };
}

/// A sensor of samples, with their covariance.
template <typename S, typename X, typename At>
constexpr bool has_noise_covariance() {
  using T = SensorTraits<S>;
  return requires(const S& s) { T::noise_covariance(s); } || requires(const S& s, const X& x) {
    T::noise_covariance(s, x);
  } || requires(const S& s, const X& x, const At& at) { T::noise_covariance(s, x, at); };
}

/// True where f, f_x, G, Q or ū of this model take an StepContext: then a step needs its dt.
template <typename Scalar, typename D>
constexpr bool reads_context() {
  using X = Vector<Scalar, states_of<D>>;
  using At = StepContext<Scalar, DynamicsTraits<D>::controls>;
  using T = DynamicsTraits<D>;
  return requires(const D& d, const X& x, const At& at) { T::dynamics(d, x, at); } ||
         requires(const D& d, const X& x, const At& at) { T::jacobian(d, x, at); } ||
         requires(const D& d, const X& x, const At& at) { T::sdc(d, x, at); } ||
         requires(const D& d, const X& x, const At& at) { T::sdc_about(d, x, x, at); } ||
         requires(const D& d, const X& x, const At& at) { T::disturbance_input(d, x, at); } ||
         requires(const D& d, const X& x, const At& at) { T::disturbance_covariance(d, x, at); } ||
         requires(const D& d, const X& x, const At& at) { T::disturbance_spectral_density(d, x, at); } ||
         requires(const D& d, const X& x, const At& at) { T::disturbance_mean(d, x, at); } ||
         requires(const D& d, const X& x, const At& at) { T::disturbance_bound(d, x, at); };
}

/// True where m, R or b of this sensor take an StepContext.
template <typename S, typename X, typename At>
constexpr bool sensor_reads_context() {
  using T = SensorTraits<S>;
  return requires(const S& s, const X& x, const At& at) { T::measurement(s, x, at); } ||
         requires(const S& s, const X& x, const At& at) { T::noise_covariance(s, x, at); } ||
         requires(const S& s, const X& x, const At& at) { T::noise_bound(s, x, at); };
}

/// The StepContext of a free function that was given none: only for a model that does not ask.
template <typename Scalar, typename D>
constexpr StepContext<Scalar, DynamicsTraits<D>::controls> no_context() {
  static_assert(!reads_context<Scalar, D>(), "jml: this model reads time, dt or control: pass an StepContext");
  return {};
}

namespace detail {

/// Compile-time checks of a discrete model, each with the user's mistake in words.
template <typename D>
consteval bool require_discrete() {
  static_assert(
      DynamicsTraits<D>::states > 0,
      "jml: a dynamics model needs `static constexpr int states` (or a DynamicsTraits specialisation)");
  static_assert(
      DiscreteDynamics<D>,
      "jml: this dynamics model is continuous in time: wrap it in jml::discretize before giving it to a "
      "discrete filter");
  static_assert(
      !requires(const D& d) { d.disturbance_spectral_density(); },
      "jml: disturbance_spectral_density() belongs to continuous dynamics; a discrete model has "
      "disturbance_covariance(), a covariance per step");
  return true;
}

template <typename D>
consteval bool require_continuous() {
  static_assert(
      DynamicsTraits<D>::states > 0,
      "jml: a dynamics model needs `static constexpr int states` (or a DynamicsTraits specialisation)");
  static_assert(
      ContinuousDynamics<D>,
      "jml: this dynamics model is discrete in time: a continuous filter wants ẋ = f(x), which says "
      "`using time_domain = jml::ContinuousTime;`; for x⁺ = f(x) take jml::Filter");
  static_assert(
      !requires(const D& d) { d.disturbance_covariance(); },
      "jml: disturbance_covariance() is per step and belongs to discrete dynamics; a continuous model has "
      "disturbance_spectral_density()");
  return true;
}

template <typename S>
consteval bool require_sensor() {
  static_assert(SensorTraits<S>::measurements > 0,
                "jml: a sensor needs `static constexpr int measurements` (or a SensorTraits specialisation)");
  return true;
}

}  // namespace detail

}  // namespace jml
