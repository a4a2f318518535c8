// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Continuous dynamics and sensors in the chart at a state: what a continuous filter of ℝⁿ needs to run on a
/// state in a space.
///
/// x = from ⊞ z, n = degrees of freedom; P is that of z:
///   ż = g(z) = J(z)⁻¹ (f(x) + G w̄),  A = ∂g/∂z,  noise J⁻¹ G,  y = m(from ⊞ z),
/// J(z) the slope of the chart. The equations of P in two charts are the same but for the measurement: with
/// it x leaves the flow of f by K ν, and P then moves as a correction's, in the chart at where x is. Seen
/// from the one at `from` that is A b - J⁻¹ ψ''[K ν, b], ψ(z) = (from ⊞ z) ⊟ x (a Christoffel symbol): so the
/// answer does not depend on where the chart is.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/chart.hpp>
#include <jml/model/local_sensor.hpp>

namespace jml::detail {

/// D in the chart at `from` of its context, at whose `to` sensors look.
template <typename D>
struct ChartDynamics {
  using Traits = DynamicsTraits<D>;
  using On = SpaceOf<D>;  // not `Space`: these are dynamics in ℝⁿ
  using time_domain = ContinuousTime;
  template <typename Scalar>
  using Context = LocalContext<Scalar, D>;
  template <typename Scalar>
  using Plain = typename LocalContext<Scalar, D>::Plain;
  static constexpr int states = On::tangent, disturbances = Traits::disturbances, controls = Traits::controls;
  static constexpr int numbers = On::numbers;
  static constexpr bool in_chart = true;

  [[no_unique_address]] D model;

  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar> && MovesIn<D, Scalar, typename LocalContext<Scalar, D>::Plain>)
  [[nodiscard]] Vector<Scalar, states> dynamics(const Vector<Scalar, states>& z,
                                                const LocalContext<Scalar, D>& at) const {
    const Vector<Scalar, numbers> x = On::plus(at.from, z);
    return velocity_in_chart<On>(at.from, x, velocity(x, at));
  }
  /// Of a model with its own f_x, which is that of f(x ⊞ δ).
  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar> &&
             Callable<HookOf<hooks::DynamicsJacobian, D>, Vector<Scalar, numbers>,
                      typename LocalContext<Scalar, D>::Plain>)
  [[nodiscard]] Matrix<Scalar, states, states> dynamics_jacobian(const Vector<Scalar, states>& z,
                                                                 const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    const Vector<Scalar, numbers> x = On::plus(at.from, z);
    const Vector<Scalar, states> held = velocity(x, at);
    const Matrix<Scalar, states, states> f_x = call(hook<hooks::DynamicsJacobian>(model), x, plain);
    return slopes(z, at,
                  [&](const auto& here) {
                    return cast_to<typename std::remove_cvref_t<decltype(here)>::Scalar>(held);
                  }) +
           columns_in_chart<On, Scalar, states>(at.from, x, f_x * On::chart_slope(at.from, z));
  }
  /// Of one without, by dual numbers through f and the chart.
  template <typename Scalar>
    requires(
        std::is_floating_point_v<Scalar> &&
        !Callable<HookOf<hooks::DynamicsJacobian, D>, Vector<Scalar, numbers>,
                  typename LocalContext<Scalar, D>::Plain> &&
        MovesIn<D, Dual<Scalar, derivatives_at_once(On::tangent)>, typename LocalContext<Scalar, D>::Plain>)
  [[nodiscard]] Matrix<Scalar, states, states> dynamics_jacobian(const Vector<Scalar, states>& z,
                                                                 const LocalContext<Scalar, D>& at) const {
    return slopes(z, at, [&](const auto& x) { return velocity(x, at); });
  }
  /// J⁻¹ G, or J⁻¹ f_w.
  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar> && disturbances > 0)
  [[nodiscard]] Matrix<Scalar, states, disturbances> disturbance_input(
      const Vector<Scalar, states>& z, const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    const Vector<Scalar, numbers> x = On::plus(at.from, z);
    if constexpr (NoisyDynamicsIn<D, Scalar, numbers, Plain<Scalar>>) {
      const auto xi = [&](const auto& w) {
        using T = typename std::remove_cvref_t<decltype(w)>::Scalar;
        return Vector<T, states>(tangent_velocity(model, cast_to<T>(x), w, plain));
      };
      const Matrix<Scalar, states, disturbances> f_w =
          derive_jacobian<states>(xi, mean_disturbance(model, x, plain));
      return columns_in_chart<On, Scalar, disturbances>(at.from, x, f_w);
    } else {
      return columns_in_chart<On, Scalar, disturbances>(at.from, x, input_in<states>(model, x, plain));
    }
  }
  template <typename Scalar>
    requires(std::is_floating_point_v<Scalar> && disturbances > 0)
  [[nodiscard]] Matrix<Scalar, disturbances, disturbances> disturbance_spectral_density(
      const Vector<Scalar, states>& z, const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    return jml::disturbance_spectral_density(model, Vector<Scalar, numbers>(On::plus(at.from, z)), plain);
  }

  /// The chart goes as far as z.
  template <typename Scalar>
  [[nodiscard]] bool reaches(const Vector<Scalar, states>& z, const LocalContext<Scalar, D>& at) const {
    return all_zero(z) || chart_reaches<On>(at.from, z);
  }
  /// What a motion of x by `push`, from outside the flow, adds to A: b → -J⁻¹ ψ''[push, b].
  template <typename Scalar>
  [[nodiscard]] Matrix<Scalar, states, states> carried(const Vector<Scalar, states>& z,
                                                       const Vector<Scalar, states>& push,
                                                       const LocalContext<Scalar, D>& at) const {
    constexpr int m = derivatives_at_once(states);
    using Along = Dual<Scalar, 1>;
    using Twice = Dual<Along, m>;
    const Vector<Scalar, numbers> x = On::plus(at.from, z);
    Matrix<Scalar, states, states> bend;
    for (int first = 0; first < states; first += m) {
      Vector<Twice, states> there;
      for (int i = 0; i < states; ++i) {
        there(i) = Twice(z(i));
        there(i).value.partial[0] = push(i);
        if (i >= first && i < first + m) there(i).partial[i - first] = Along(Scalar(1));
      }
      const Vector<Twice, states> off =
          On::minus(On::plus(cast_to<Twice>(at.from), there), cast_to<Twice>(x));
      for (int j = 0; j < m && first + j < states; ++j) {
        for (int i = 0; i < states; ++i) bend(i, first + j) = -off(i).partial[j].partial[0];
      }
    }
    return columns_in_chart<On, Scalar, states>(at.from, x, bend);
  }

 private:
  template <typename T, typename Scalar>
  [[nodiscard]] Vector<T, states> velocity(const Vector<T, numbers>& x,
                                           const LocalContext<Scalar, D>& at) const {
    const typename LocalContext<Scalar, D>::Plain& plain = at;
    return tangent_velocity(model, x, mean_disturbance<T>(model, x, plain), plain);
  }
  /// ∂/∂z of J(z)⁻¹ ξ(from ⊞ z).
  template <typename Scalar, typename Velocity>
  [[nodiscard]] Matrix<Scalar, states, states> slopes(const Vector<Scalar, states>& z,
                                                      const LocalContext<Scalar, D>& at,
                                                      const Velocity& velocity_at) const {
    constexpr int m = derivatives_at_once(states);
    using T = Dual<Scalar, m>;
    Matrix<Scalar, states, states> out;
    for (int first = 0; first < states; first += m) {
      const Vector<T, numbers> base = cast_to<T>(at.from), x = On::plus(base, seed_from<m>(z, first));
      const Vector<T, states> rate = velocity_in_chart<On>(base, x, Vector<T, states>(velocity_at(x)));
      for (int j = 0; j < m && first + j < states; ++j) {
        for (int i = 0; i < states; ++i) out(i, first + j) = rate(i).partial[j];
      }
    }
    return out;
  }
};

/// A sensor that measures all the time, in the chart at the `to` of its context.
template <typename S, typename D, typename Scalar>
struct ChartSensor {
  using Local = LocalSensor<S, D, Scalar>;
  using On = SpaceOf<D>;
  using Plain = typename LocalContext<Scalar, D>::Plain;
  using X = Vector<Scalar, On::numbers>;
  using Z = Vector<Scalar, On::tangent>;
  static constexpr int measurements = measurements_of<S>;
  using Square = Matrix<Scalar, measurements, measurements>;

  Local local;

  [[nodiscard]] Vector<Scalar, measurements> measurement(const Z& z,
                                                         const LocalContext<Scalar, D>& at) const {
    return jml::measurement(local, z, at);
  }
  [[nodiscard]] Matrix<Scalar, measurements, On::tangent> measurement_jacobian(
      const Z& z, const LocalContext<Scalar, D>& at) const {
    return jml::measurement_jacobian(local, z, at);
  }
  [[nodiscard]] Square noise_spectral_density(const Z& z, const LocalContext<Scalar, D>& at) const {
    return jml::noise_spectral_density(local.sensor, X(On::plus(at.to, z)), static_cast<const Plain&>(at));
  }
  [[nodiscard]] Vector<Scalar, measurements> residual(const Vector<Scalar, measurements>& y,
                                                      const Vector<Scalar, measurements>& predicted) const {
    return local.residual(y, predicted);
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
