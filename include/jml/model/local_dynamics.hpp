// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Dynamics in local coordinates: φ(z) = f(from ⊞ z, w) ⊟ to and its derivatives, see
/// model/local_context.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/local_context.hpp>

namespace jml::detail {

/// D about the points of its context. `refrozen`: the point w of the context is moved by an estimator that
/// iterates, so that the mean of what is left of the disturbance is not zero.
template <typename D, bool refrozen = false>
struct LocalDynamics {
  using Traits = DynamicsTraits<D>;
  using On = SpaceOf<D>;  // not `Space`: these are dynamics in ℝⁿ
  template <typename Scalar>
  using Context = LocalContext<Scalar, D>;
  template <typename Scalar>
  using Plain = typename LocalContext<Scalar, D>::Plain;
  static constexpr int states = On::tangent, disturbances = Traits::disturbances, controls = Traits::controls;
  static constexpr int numbers = On::numbers;

  [[no_unique_address]] D model;

  template <typename T, typename Scalar>
    requires MovesIn<D, T, typename LocalContext<Scalar, D>::Plain>
  [[nodiscard]] Vector<T, states> dynamics(const Vector<T, states>& z,
                                           const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    const Vector<T, numbers> x = On::plus(cast_to<T>(at.from), z);
    return On::minus(moved(model, x, cast_to<T>(at.w), plain), cast_to<T>(at.to));
  }

  /// Of a model with its own f_x, which is that of f(x ⊞ δ) ⊟ f(x).
  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar> &&
             Callable<HookOf<hooks::DynamicsJacobian, D>, Vector<Scalar, numbers>,
                      typename LocalContext<Scalar, D>::Plain>)
  [[nodiscard]] Matrix<Scalar, states, states> dynamics_jacobian(const Vector<Scalar, states>& z,
                                                                 const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    const Vector<Scalar, numbers> x = On::plus(at.from, z);
    const Vector<Scalar, numbers> f = jml::dynamics(model, x, plain);
    const Matrix<Scalar, states, states> f_x = call(hook<hooks::DynamicsJacobian>(model), x, plain);
    const auto outer = [&](const auto& d) {
      using T = typename std::remove_cvref_t<decltype(d)>::Scalar;
      Vector<T, numbers> y = On::plus(cast_to<T>(f), d);
      if constexpr (disturbances > 0 &&
                    !NoisyDynamicsIn<D, Scalar, numbers, typename LocalContext<Scalar, D>::Plain>) {
        const Vector<Scalar, states> push = input_in<states>(model, x, plain) * at.w;
        y = On::plus(y, cast_to<T>(push));
      }
      return On::minus(y, cast_to<T>(at.to));
    };
    const Matrix<Scalar, states, states> left =
        derive_jacobian<states>(outer, kernel::zeros<Vector<Scalar, states>>());
    return left * f_x * On::chart_slope(at.from, z);
  }

  /// Of one without, by dual numbers through f; where z is zero without going through the chart.
  template <typename Scalar>
    requires(
        std::is_floating_point_v<Scalar> &&
        !Callable<HookOf<hooks::DynamicsJacobian, D>, Vector<Scalar, numbers>,
                  typename LocalContext<Scalar, D>::Plain> &&
        MovesIn<D, Dual<Scalar, derivatives_at_once(On::tangent)>, typename LocalContext<Scalar, D>::Plain>)
  [[nodiscard]] Matrix<Scalar, states, states> dynamics_jacobian(const Vector<Scalar, states>& z,
                                                                 const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    constexpr int m = derivatives_at_once(states);
    Matrix<Scalar, states, states> out;
    const bool still = all_zero(z);
    for (int first = 0; first < states; first += m)
      set_columns(out, first, slope_along<m>(still, z, first, plain, at));
    return out;
  }

  /// F about the origin of the space, F (z - r) = φ(z) - φ(r) with from ⊞ r the origin.
  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar>)
  [[nodiscard]] Matrix<Scalar, states, states> dynamics_sdc(const Vector<Scalar, states>& z,
                                                            const LocalContext<Scalar, D>& at) const {
    const Vector<Scalar, states> r = On::minus(On::template origin<Scalar>(), at.from);
    const Vector<Scalar, states> here = dynamics(z, at), there = dynamics(r, at);
    return derive_sdc<states>(
        [&](const Vector<Scalar, states>& between) { return jml::dynamics_jacobian(*this, between, at); },
        Vector<Scalar, states>(here - there), sizes(here, there), z, r);
  }

  /// φ_w.
  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar> && disturbances > 0)
  [[nodiscard]] Matrix<Scalar, states, disturbances> disturbance_input(
      const Vector<Scalar, states>& z, const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    const Vector<Scalar, numbers> x = On::plus(at.from, at.frozen ? at.slope_at : z);
    if constexpr (!refrozen && !HasHook<hooks::DisturbanceMean, D, Vector<Scalar, numbers>, Plain<Scalar>> &&
                  !NoisyDynamicsIn<D, Scalar, numbers, Plain<Scalar>>) {
      return input_in<states>(model, x, plain);  // at w = 0 and to = f(x)
    } else {
      constexpr int m = derivatives_at_once(disturbances);
      Matrix<Scalar, states, disturbances> out;
      for (int first = 0; first < disturbances; first += m)
        set_columns(out, first, On::slope_of_minus(moved_by(x, seed_from<m>(at.w, first), plain), at.to));
      return out;
    }
  }
  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar> && disturbances > 0)
  [[nodiscard]] Matrix<Scalar, disturbances, disturbances> disturbance_covariance(
      const Vector<Scalar, states>& z, const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    if constexpr (ConstantHook<hooks::DisturbanceCovariance, D, Vector<Scalar, numbers>,
                               typename LocalContext<Scalar, D>::Plain>)
      return jml::disturbance_covariance(model, at.from, plain);
    else
      return jml::disturbance_covariance(model, Vector<Scalar, numbers>(On::plus(at.from, z)), plain);
  }
  /// What is left of w̄ beside the w of the context.
  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar> && disturbances > 0 && refrozen)
  [[nodiscard]] Vector<Scalar, disturbances> disturbance_mean(const Vector<Scalar, states>& z,
                                                              const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    return mean_disturbance(model, Vector<Scalar, numbers>(On::plus(at.from, z)), plain) - at.w;
  }

 private:
  /// Columns first … first + m - 1 of φ_z.
  template <int m, typename Scalar>
  [[nodiscard]] JML_NOINLINE Matrix<Scalar, states, m> slope_along(
      bool still, const Vector<Scalar, states>& z, int first,
      const typename LocalContext<Scalar, D>::Plain& plain, const LocalContext<Scalar, D>& at) const {
    using T = Dual<Scalar, m>;
    const Vector<T, numbers> x = still ? On::template seed_at<m>(at.from, -first)
                                       : On::plus(cast_to<T>(at.from), seed_from<m>(z, first));
    return On::slope_of_minus(moved(model, x, cast_to<T>(at.w), plain), at.to);
  }
  template <typename T, typename Scalar, typename At>
  [[nodiscard]] Vector<T, numbers> moved_by(const Vector<Scalar, numbers>& x,
                                            const Vector<T, disturbances>& w, const At& at) const {
    if constexpr (NoisyDynamicsIn<D, T, numbers, At>) {
      return ask_noisy<hooks::Dynamics>(model, cast_to<T>(x), w, at);
    } else {
      const auto G = input_in<states>(model, x, at);
      Vector<T, states> push = kernel::zeros<Vector<T, states>>();
      for (int i = 0; i < states; ++i) {
        for (int j = 0; j < disturbances; ++j) push(i) += G(i, j) * w(j);
      }
      return On::plus(cast_to<T>(jml::dynamics(model, x, at)), push);
    }
  }
};

/// A step from the chart at x to that at its prediction.
template <typename Scalar, typename D, typename At>
[[nodiscard]] LocalContext<Scalar, D> local_step(const D& d, const Vector<Scalar, states_of<D>>& x,
                                                 const At& at) {
  LocalContext<Scalar, D> there(at);
  there.from = x;
  if constexpr (DynamicsTraits<D>::disturbances > 0) there.w = mean_disturbance(d, x, at);
  there.to = moved(d, x, there.w, at);
  return there;
}
/// Of the prediction; brought back to its space, which rounding or an integrator may have left by little.
template <typename Space, typename There>
[[nodiscard]] Status check_step(There& there) {
  if (!all_finite(there.from)) return Status::invalid_state;
  if (!all_finite(there.to)) return Status::dynamics_not_finite;
  there.to = Space::plus(there.to, kernel::zeros<Vector<typename There::Point::Scalar, Space::tangent>>());
  return Space::contains(there.to) ? Status::ok : Status::outside_space;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
