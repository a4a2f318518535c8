// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What counts as a model, and the sentences a user reads when theirs does not.
#include <jml/warnings_begin.hpp>
#pragma once

#include <concepts>
#include <jml/model/functions.hpp>

namespace jml {

/// Dynamics of which nothing is known but how many states they have: where a correction stands alone.
template <int n>
struct OfStates {
  static constexpr int states = n;  ///< n
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

namespace detail {
/// What the functions of D are given beside x: a StepContext, or of an adaptor something that is one.
template <typename Scalar, typename D>
struct ContextType {
  using type = StepContext<Scalar, DynamicsTraits<D>::controls>;
};
template <typename Scalar, typename D>
  requires requires { typename D::template Context<Scalar>; }
struct ContextType<Scalar, D> {
  using type = typename D::template Context<Scalar>;
};
template <typename Scalar, typename D>
using Context = typename ContextType<Scalar, D>::type;
}  // namespace detail

namespace detail {
/// G of an additive model, n×q in the tangent at f(x).
template <int n, typename D, typename Scalar, int numbers, typename At>
[[nodiscard]] Matrix<Scalar, n, DynamicsTraits<D>::disturbances> input_in(const D& d,
                                                                          const Vector<Scalar, numbers>& x,
                                                                          const At& at) {
  constexpr int q = DynamicsTraits<D>::disturbances;
  if constexpr (HasHook<hooks::DisturbanceInput, D, Vector<Scalar, numbers>, At>) {
    return evaluate<hooks::DisturbanceInput, n, q>(d, x, at);
  } else {
    static_assert(
        q == n,
        "jml: the dynamics have fewer disturbances than degrees of freedom: give disturbance_input(), "
        "degrees × q, or take w as an argument, dynamics(x, w)");
    return kernel::identity<Matrix<Scalar, n, q>>();
  }
}
}  // namespace detail

/// True where any function of the dynamics takes a StepContext.
template <typename Scalar, typename D>
constexpr bool reads_context() {
  using namespace detail;
  using X = Vector<Scalar, states_of<D>>;
  using At = Context<Scalar, D>;
  return ReadsContext<hooks::Dynamics, D, X, At> ||
         ReadsNoiseAt<hooks::Dynamics, D, X, Vector<Scalar, DynamicsTraits<D>::disturbances>, At> ||
         ReadsContext<hooks::DynamicsJacobian, D, X, At> || ReadsContext<hooks::DynamicsSdc, D, X, At> ||
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
  return ReadsContext<hooks::Measurement, S, X, At> ||
         ReadsNoiseAt<hooks::Measurement, S, X, Vector<typename X::Scalar, noises_of_sensor<S>()>, At> ||
         ReadsContext<hooks::NoiseCovariance, S, X, At> || ReadsContext<hooks::NoiseBound, S, X, At>;
}

/// The StepContext of a free function that was given none: only for a model that does not ask.
template <typename Scalar, typename D>
constexpr StepContext<Scalar, DynamicsTraits<D>::controls> no_context() {
  static_assert(!reads_context<Scalar, D>(), "jml: this model reads time, dt or control: pass a StepContext");
  return {};
}

namespace detail {

template <typename T>
concept PointsToAModel = requires(const T& t) {
  *t;
  requires !requires { T::RowsAtCompileTime; };
};

/// plus and minus of a struct that says `tangent`: static, and templates, as their slopes are derived.
template <typename D>
concept MovesByItself =
    requires(const Vector<double, states_of<D>>& x, const Vector<double, D::tangent>& delta) {
      { D::plus(x, delta) } -> std::convertible_to<Vector<double, states_of<D>>>;
      { D::minus(x, x) } -> std::convertible_to<Vector<double, D::tangent>>;
    } && !requires { &D::plus; } && !requires { &D::minus; };

/// What every estimator reads of DynamicsTraits<D> is there.
template <typename D>
consteval bool require_dynamics() {
  using Traits = DynamicsTraits<D>;
  constexpr bool counted = requires { requires Traits::states > 0; };
  static_assert(counted || !PointsToAModel<D>,
                "jml: a pointer in place of the dynamics: give the model itself, *model");
  static_assert(
      counted,
      "jml: a dynamics model needs `static constexpr int states` (or a DynamicsTraits specialisation)");
  static_assert(
      requires {
        Traits::disturbances;
        Traits::controls;
        Traits::linear;
        typename Traits::time_domain;
      },
      "jml: a specialisation of DynamicsTraits lacks what it should inherit: write `template <> struct "
      "jml::DynamicsTraits<Yours> : jml::DynamicsDefaults`");
  if constexpr (requires { Traits::looks_into_struct; }) {
    constexpr bool data = requires { requires is_data<decltype(&D::disturbance_covariance)>; } ||
                          requires { requires is_data<decltype(&D::disturbance_spectral_density)>; } ||
                          requires { requires is_data<decltype(&D::disturbance_bound)>; } ||
                          requires { requires is_data<decltype(&D::disturbance_input)>; } ||
                          requires { requires is_data<decltype(&D::disturbance_mean)>; } ||
                          requires { requires is_data<decltype(&D::dynamics_jacobian)>; };
    static_assert(!data,
                  "jml: disturbance_covariance and its like are functions, not data: write a const "
                  "member function that returns it");
    if constexpr (requires { typename D::Space; }) {
      constexpr bool same = SpaceOf<D>::numbers == Traits::states;
      static_assert(same, "jml: `states` is not how many numbers a state of `Space` has: leave it out");
      return same;
    } else if constexpr (requires { std::integral_constant<int, D::tangent>(); }) {
      constexpr bool moves = MovesByItself<D>;
      static_assert(moves,
                    "jml: dynamics with `tangent` give their space too: plus(x, δ), of `states` numbers, and "
                    "minus(a, b), of `tangent`, static, templates over the scalar");
      return moves;
    }
  }
  return true;
}

/// An estimator that does not know of spaces.
template <typename D>
consteval bool require_flat() {
  static_assert(
      is_flat<D>,
      "jml: this estimator is of states in ℝⁿ; states in a space (`Space`, `tangent`) take Ekf, "
      "Sddre, Jml, their factored and iterated forms, FixedLag, Batch and Smoother, and in continuous "
      "time Continuous{Ekf{}}");
  return is_flat<D>;
}

/// Compile-time checks of a discrete model, each with the user's mistake in words.
template <typename D>
consteval bool require_discrete() {
  static_assert(require_dynamics<D>());
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
  static_assert(require_dynamics<D>());
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
  using Traits = SensorTraits<S>;
  constexpr bool counted = requires { requires Traits::measurements > 0; };
  static_assert(counted || !PointsToAModel<S>,
                "jml: a pointer in place of the sensor: give the sensor itself, *sensor");
  static_assert(counted,
                "jml: a sensor needs `static constexpr int measurements` (or a SensorTraits specialisation)");
  static_assert(
      requires { Traits::linear; },
      "jml: a specialisation of SensorTraits lacks what it should inherit: write `template <> struct "
      "jml::SensorTraits<Yours> : jml::SensorDefaults`");
  if constexpr (requires { Traits::looks_into_struct; }) {
    constexpr bool data = requires { requires is_data<decltype(&S::noise_covariance)>; } ||
                          requires { requires is_data<decltype(&S::noise_spectral_density)>; } ||
                          requires { requires is_data<decltype(&S::noise_bound)>; } ||
                          requires { requires is_data<decltype(&S::measurement_jacobian)>; };
    static_assert(!data,
                  "jml: noise_covariance and its like are functions, not data: write a const member "
                  "function that returns it");
  }
  return true;
}

/// As many entries as a control has; 0 where that cannot be said.
template <typename D>
consteval int entries_of_control() {
  if constexpr (require_dynamics<D>() && requires { DynamicsTraits<D>::controls; })
    return DynamicsTraits<D>::controls;
  else
    return 0;
}
/// As many entries as y has; 1 where that cannot be said.
template <typename S>
consteval int entries_of_measurement() {
  if constexpr (require_sensor<S>() && requires { requires SensorTraits<S>::measurements > 0; })
    return SensorTraits<S>::measurements;
  else
    return 1;
}

}  // namespace detail

/// What the functions of D may take as their second argument.
template <typename D, typename Scalar = double>
using ContextOf = std::type_identity_t<StepContext<Scalar, detail::entries_of_control<D>()>>;

/// A measurement of S as a caller gives it: p entries, or a number where p = 1.
template <typename S, typename Scalar = double>
using MeasurementOf = std::type_identity_t<Argument<Scalar, detail::entries_of_measurement<S>()>>;

}  // namespace jml
#include <jml/warnings_end.hpp>
