// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a model supplies: the two traits that look into a user's struct, and may be specialised from outside.
///
/// A dynamics struct has `states`, usually `disturbances`, and functions named as below; a sensor struct has
/// `measurements` and its own. Every function may take (x), (x, at) with a StepContext, and G, Q, R, the
/// bounds and the disturbance mean also nothing at all. What is missing is derived (model/functions.hpp).
/// Noise that is no sum is an argument: dynamics(x, w), measurement(x, v), each with `at` too.
///
/// For a type that cannot be edited, specialise DynamicsTraits or SensorTraits, inherit from DynamicsDefaults
/// or SensorDefaults, and give what there is, the model as first argument:
///
///     template <> struct jml::DynamicsTraits<Theirs> : jml::DynamicsDefaults {
///       static constexpr int states = 2;
///       static auto dynamics(const Theirs& model, const auto& x) { ... }
///     };
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/space.hpp>
#include <jml/model/step_context.hpp>
#include <utility>

namespace jml {

/// `using time_domain = jml::ContinuousTime;` says that dynamics(x) is a derivative and not the next state.
struct ContinuousTime {};
struct DiscreteTime {};

namespace detail {

// 0 where a struct does not have it, or not as a constant: the concepts then say what it is not, in words.
template <typename Model>
constexpr int count_of_states() {
  if constexpr (requires { requires std::is_member_pointer_v<decltype(&Model::states)>; })
    return 0;
  else if constexpr (requires { std::integral_constant<int, Model::states>(); })
    return Model::states;
  else if constexpr (requires { SpaceTraits<typename Model::Space>::numbers; })
    return SpaceTraits<typename Model::Space>::numbers;
  else
    return 0;
}

template <typename Model>
constexpr int count_of_measurements() {
  if constexpr (requires { requires std::is_member_pointer_v<decltype(&Model::measurements)>; })
    return 0;
  else if constexpr (requires { std::integral_constant<int, Model::measurements>(); })
    return Model::measurements;
  else
    return 0;
}

template <typename Model>
constexpr int noises_of() {
  if constexpr (requires { std::integral_constant<int, Model::noises>(); })
    return Model::noises;
  else
    return count_of_measurements<Model>();
}

template <typename Model>
constexpr int controls_of() {
  if constexpr (requires { requires std::is_member_pointer_v<decltype(&Model::controls)>; })
    return 0;
  else if constexpr (requires { std::integral_constant<int, Model::controls>(); })
    return Model::controls;
  else
    return 0;
}

/// True where Model has a covariance, a spectral density or a bound of disturbances, in any form for this
/// scalar.
template <typename Model, typename Scalar>
constexpr bool has_disturbances() {
  using X = Vector<Scalar, count_of_states<Model>()>;
  using At = StepContext<Scalar, controls_of<Model>()>;
  return requires(const Model& m) { m.disturbance_covariance(); } ||
         requires(const Model& m, const X& x) { m.disturbance_covariance(x); } ||
         requires(const Model& m, const X& x, const At& at) { m.disturbance_covariance(x, at); } ||
         requires(const Model& m) { m.disturbance_spectral_density(); } ||
         requires(const Model& m, const X& x) { m.disturbance_spectral_density(x); } ||
         requires(const Model& m, const X& x, const At& at) { m.disturbance_spectral_density(x, at); } ||
         requires(const Model& m) { m.disturbance_bound(); } ||
         requires(const Model& m, const X& x) { m.disturbance_bound(x); } ||
         requires(const Model& m, const X& x, const At& at) { m.disturbance_bound(x, at); };
}

template <typename Model>
constexpr int disturbances_of() {
  if constexpr (requires { Model::disturbances; })
    return Model::disturbances;
  else if constexpr (has_disturbances<Model, double>() || has_disturbances<Model, float>())
    return count_of_states<Model>();
  else
    return 0;
}

template <typename Model>
constexpr bool is_linear() {
  if constexpr (requires { Model::linear; })
    return Model::linear;
  else
    return false;
}

/// The space of a struct that gives `tangent`, plus(x, δ) and minus(a, b) itself; perhaps contains() and
/// origin() too.
template <typename Model>
struct OwnSpace {
  static constexpr int numbers = count_of_states<Model>(), tangent = Model::tangent;
  template <typename T>
  static Vector<T, numbers> plus(const Vector<T, numbers>& x, const Vector<T, tangent>& delta) {
    return Model::plus(x, delta);
  }
  template <typename T>
  static Vector<T, tangent> minus(const Vector<T, numbers>& a, const Vector<T, numbers>& b) {
    return Model::minus(a, b);
  }
  template <typename T>
    requires requires(const Vector<T, numbers>& x) { Model::contains(x); }
  static bool contains(const Vector<T, numbers>& x) {
    return Model::contains(x);
  }
  template <typename T>
    requires requires { Model::template origin<T>(); }
  static Vector<T, numbers> origin() {
    return Model::template origin<T>();
  }
};
template <typename Model>
struct StructSpace {
  using type = Euclidean<count_of_states<Model>()>;
};
template <typename Model>
  requires requires { typename Model::Space; }
struct StructSpace<Model> {
  using type = typename Model::Space;
};
template <typename Model>
  requires(
      !requires { typename Model::Space; } && requires { std::integral_constant<int, Model::tangent>(); })
struct StructSpace<Model> {
  using type = OwnSpace<Model>;
};

template <typename Model>
struct TimeDomain {
  using type = DiscreteTime;
};
template <typename Model>
  requires requires { typename Model::time_domain; }
struct TimeDomain<Model> {
  using type = typename Model::time_domain;
};

}  // namespace detail

/// What a dynamics trait looks for in a struct. A specialisation of DynamicsTraits inherits from it, and
/// hides what it gives.
struct DynamicsDefaults {
  /// Where a model says nothing.
  /// @{
  static constexpr int disturbances = 0, controls = 0;
  static constexpr bool linear = false;
  using time_domain = DiscreteTime;
  /// @}

  /// f(x), n; or f(x, w), w of q.
  template <typename M, typename... A>
  static constexpr auto dynamics(const M& m, const A&... a) -> decltype(m.dynamics(a...)) {
    return m.dynamics(a...);
  }
  /// f_x(x), n×n. Optional.
  template <typename M, typename... A>
  static constexpr auto jacobian(const M& m, const A&... a) -> decltype(m.dynamics_jacobian(a...)) {
    return m.dynamics_jacobian(a...);
  }
  /// F(x) with F(x) x = f(x) - f(0), n×n. Optional.
  template <typename M, typename... A>
  static constexpr auto sdc(const M& m, const A&... a) -> decltype(m.dynamics_sdc(a...)) {
    return m.dynamics_sdc(a...);
  }
  /// F(x; r) with F (x - r) = f(x) - f(r), arguments (x, r) or (x, r, at), n×n. Optional.
  template <typename M, typename... A>
  static constexpr auto sdc_about(const M& m, const A&... a) -> decltype(m.dynamics_sdc_about(a...)) {
    return m.dynamics_sdc_about(a...);
  }
  /// G, n×q. Optional where q = n: the identity.
  template <typename M, typename... A>
  static constexpr auto disturbance_input(const M& m, const A&... a) -> decltype(m.disturbance_input(a...)) {
    return m.disturbance_input(a...);
  }
  /// Q of discrete dynamics, a covariance per step, q×q.
  template <typename M, typename... A>
  static constexpr auto disturbance_covariance(const M& m, const A&... a)
      -> decltype(m.disturbance_covariance(a...)) {
    return m.disturbance_covariance(a...);
  }
  /// Q of continuous dynamics, a two-sided spectral density, q×q.
  template <typename M, typename... A>
  static constexpr auto disturbance_spectral_density(const M& m, const A&... a)
      -> decltype(m.disturbance_spectral_density(a...)) {
    return m.disturbance_spectral_density(a...);
  }
  /// ū, q: |w| ≤ ū, entries zero or positive. Of boxes only, which read no Q.
  template <typename M, typename... A>
  static constexpr auto disturbance_bound(const M& m, const A&... a) -> decltype(m.disturbance_bound(a...)) {
    return m.disturbance_bound(a...);
  }
  /// w̄, q: a known part of the disturbance, eqs. (11)-(12). Optional: zero.
  template <typename M, typename... A>
  static constexpr auto disturbance_mean(const M& m, const A&... a) -> decltype(m.disturbance_mean(a...)) {
    return m.disturbance_mean(a...);
  }
};

/// Dynamics x⁺ = f(x) + G (w̄ + w), cov w = Q; or ẋ = f(x) + G w with spectral density Q of w.
template <typename Model>
struct DynamicsTraits : DynamicsDefaults {
  static constexpr bool looks_into_struct =
      true;  ///< a specialisation says nothing of the struct's own names
  static constexpr int states = detail::count_of_states<Model>();  ///< n, the numbers of a state
  using space = typename detail::StructSpace<Model>::type;         ///< default Euclidean<states>
  static constexpr int disturbances =
      detail::disturbances_of<Model>();  ///< q; default: n with a covariance or a bound, else 0
  static constexpr int controls = detail::controls_of<Model>();  ///< entries of at.control; default 0
  static constexpr bool linear = detail::is_linear<Model>();     ///< promises f_x constant in x
  using time_domain = typename detail::TimeDomain<Model>::type;  ///< default DiscreteTime
};

/// What a sensor trait looks for in a struct; likewise.
struct SensorDefaults {
  static constexpr bool linear = false;  ///< where a model says nothing

  /// m(x), p; or m(x, v), v of `noises`.
  template <typename M, typename... A>
  static constexpr auto measurement(const M& m, const A&... a) -> decltype(m.measurement(a...)) {
    return m.measurement(a...);
  }
  /// m_x(x), p×n. Optional.
  template <typename M, typename... A>
  static constexpr auto jacobian(const M& m, const A&... a) -> decltype(m.measurement_jacobian(a...)) {
    return m.measurement_jacobian(a...);
  }
  /// M(x) with M(x) x = m(x) - m(0), p×n. Optional.
  template <typename M, typename... A>
  static constexpr auto sdc(const M& m, const A&... a) -> decltype(m.measurement_sdc(a...)) {
    return m.measurement_sdc(a...);
  }
  /// M(x; r) with M (x - r) = m(x) - m(r), arguments (x, r) or (x, r, at), p×n. Optional.
  template <typename M, typename... A>
  static constexpr auto sdc_about(const M& m, const A&... a) -> decltype(m.measurement_sdc_about(a...)) {
    return m.measurement_sdc_about(a...);
  }
  /// R of a sample, p×p, symmetric positive definite.
  template <typename M, typename... A>
  static constexpr auto noise_covariance(const M& m, const A&... a) -> decltype(m.noise_covariance(a...)) {
    return m.noise_covariance(a...);
  }
  /// R of a measurement that is there all the time, a two-sided spectral density, p×p, positive definite.
  template <typename M, typename... A>
  static constexpr auto noise_spectral_density(const M& m, const A&... a)
      -> decltype(m.noise_spectral_density(a...)) {
    return m.noise_spectral_density(a...);
  }
  /// b, p: |v| ≤ b, entries zero or positive. Of boxes only, which read no R.
  template <typename M, typename... A>
  static constexpr auto noise_bound(const M& m, const A&... a) -> decltype(m.noise_bound(a...)) {
    return m.noise_bound(a...);
  }
  /// y - ŷ where subtraction is not enough (angles: wrap to [-π, π]), arguments (y, ŷ), p. Optional.
  template <typename M, typename... A>
  static constexpr auto residual(const M& m, const A&... a) -> decltype(m.residual(a...)) {
    return m.residual(a...);
  }
};

/// Sensor y = m(x) + v: samples with cov v = R (noise_covariance), or a measurement in continuous time with v
/// of spectral density R (noise_spectral_density).
template <typename Model>
struct SensorTraits : SensorDefaults {
  static constexpr bool looks_into_struct = true;                              ///< as of DynamicsTraits
  static constexpr int measurements = detail::count_of_measurements<Model>();  ///< p
  static constexpr int noises = detail::noises_of<Model>();   ///< r, entries of v of m(x, v); default p
  static constexpr bool linear = detail::is_linear<Model>();  ///< promises m_x constant in x
};

}  // namespace jml
#include <jml/warnings_end.hpp>
