// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What counts as a model, and the sentences a user reads when theirs does not.
#pragma once

#include <concepts>
#include <jml/model/functions.hpp>

namespace jml {

/// Dynamics of which nothing is known but how many states they have: where a correction stands alone.
template <int n>
struct OfStates {
  static constexpr int states = n;
};

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

/// A sensor that measures all the time.
template <typename S, typename X, typename At>
constexpr bool has_noise_spectral_density() {
  return detail::HasHook<detail::hooks::NoiseSpectralDensity, S, X, At>;
}
/// A sensor of samples.
template <typename S, typename X, typename At>
constexpr bool has_noise_covariance() {
  return detail::HasHook<detail::hooks::NoiseCovariance, S, X, At>;
}

/// True where any function of the dynamics takes a StepContext.
template <typename Scalar, typename D>
constexpr bool reads_context() {
  using namespace detail;
  using X = Vector<Scalar, states_of<D>>;
  using At = StepContext<Scalar, DynamicsTraits<D>::controls>;
  return ReadsContext<hooks::Dynamics, D, X, At> || ReadsContext<hooks::DynamicsJacobian, D, X, At> ||
         ReadsContext<hooks::DynamicsSdc, D, X, At> ||
         requires(const D& d, const X& x, const At& at) { DynamicsTraits<D>::sdc_about(d, x, x, at); } ||
         ReadsContext<hooks::DisturbanceInput, D, X, At> ||
         ReadsContext<hooks::DisturbanceCovariance, D, X, At> ||
         ReadsContext<hooks::DisturbanceSpectralDensity, D, X, At> ||
         ReadsContext<hooks::DisturbanceMean, D, X, At> || ReadsContext<hooks::DisturbanceBound, D, X, At>;
}

/// The same of a sensor.
template <typename S, typename X, typename At>
constexpr bool sensor_reads_context() {
  using namespace detail;
  return ReadsContext<hooks::Measurement, S, X, At> || ReadsContext<hooks::NoiseCovariance, S, X, At> ||
         ReadsContext<hooks::NoiseBound, S, X, At>;
}

/// The StepContext of a free function that was given none: only for a model that does not ask.
template <typename Scalar, typename D>
constexpr StepContext<Scalar, DynamicsTraits<D>::controls> no_context() {
  static_assert(!reads_context<Scalar, D>(), "jml: this model reads time, dt or control: pass a StepContext");
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
