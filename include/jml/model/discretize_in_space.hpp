// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One discrete step of continuous dynamics in a space: ξ = f(x, w), the tangent velocity at x, x being x ⊞ ξ
/// dt after a short dt.
///
/// x(t) = x_k ⊞ δ(t), and δ is integrated (model/chart.hpp): the state stays in its space, and the order of
/// the integrator is kept. The disturbance is held over the step, with covariance Q/dt, and enters through f
/// itself.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/chart.hpp>
#include <jml/solve/runge_kutta.hpp>

namespace jml {

/// One step of `Continuous`, whose dynamics(x) or dynamics(x, w) answers with a tangent vector (degrees of
/// freedom); with additive disturbances f(x) + G w. Made by discretize().
template <typename Continuous, typename Integrator>
class DiscretizedInSpace {
  using Traits = DynamicsTraits<Continuous>;
  using On = SpaceOf<Continuous>;
  static constexpr int numbers = On::numbers, n = On::tangent, q = Traits::disturbances;
  static_assert(ExplicitMethod<Integrator>,
                "jml: discretize<Integrator> makes a step of jml::Euler or jml::RungeKutta4, and of no other "
                "integrator");

 public:
  /// Space and sizes as a dynamics struct gives them.
  /// @{
  using Space = typename detail::SpaceOfModel<Continuous>::type;
  static constexpr int states = numbers, disturbances = q, controls = Traits::controls;
  /// @}

  /// ẋ = f(x), in the tangent.
  explicit DiscretizedInSpace(Continuous model) : continuous(std::move(model)) {}
  Continuous continuous;  ///< ẋ = f(x), in the tangent

  /// x after one step of the integrator of length at.dt, `states` numbers; w is held over it.
  /// @{
  template <typename T, typename S>
    requires(q > 0)
  Vector<T, numbers> dynamics(const Vector<T, numbers>& x, const Vector<T, q>& w,
                              const StepContext<S, controls>& at) const {
    return step(x, w, at);
  }
  template <typename T, typename S>
    requires(q == 0)
  Vector<T, numbers> dynamics(const Vector<T, numbers>& x, const StepContext<S, controls>& at) const {
    return step(x, Vector<T, 0>(), at);
  }
  /// @}
  /// Q/dt, q×q; zero where dt is zero.
  template <typename S>
    requires(q > 0)
  Matrix<S, q, q> disturbance_covariance(const Vector<S, numbers>& x,
                                         const StepContext<S, controls>& at) const {
    const Matrix<S, q, q> Q = jml::disturbance_spectral_density(continuous, x, at);
    return at.dt > S(0) ? Matrix<S, q, q>(Q / at.dt) : kernel::zeros<Matrix<S, q, q>>();
  }
  /// w̄, q.
  template <typename S>
    requires(q > 0 && detail::HasHook<detail::hooks::DisturbanceMean, Continuous, Vector<S, numbers>,
                                      StepContext<S, controls>>)
  Vector<S, q> disturbance_mean(const Vector<S, numbers>& x, const StepContext<S, controls>& at) const {
    return detail::mean_disturbance(continuous, x, at);
  }

 private:
  template <typename T, typename S>
  Vector<T, numbers> step(const Vector<T, numbers>& x, const Vector<T, q>& w,
                          const StepContext<S, controls>& at) const {
    const Vector<T, n> still = kernel::zeros<Vector<T, n>>();
    Vector<T, n> end = still;
    static_cast<void>(explicit_step(
        Integrator{}, still, at.dt, end, [&](int, S after, const Vector<T, n>& delta, Vector<T, n>& slope) {
          StepContext<S, controls> then = at;
          then.time += static_cast<double>(after);
          const Vector<T, numbers> here = On::plus(x, delta);
          const Vector<T, n> rate = detail::tangent_velocity(continuous, here, w, then);
          slope = detail::velocity_in_chart<On>(x, here, rate);
          return Status::ok;
        }));
    return On::plus(x, end);
  }
};

namespace detail {
template <typename D>
consteval bool steps_in_space() {
  if constexpr (!requires {
                  requires DynamicsTraits<D>::states > 0;
                  DynamicsTraits<D>::disturbances;
                })
    return false;
  else
    return !is_flat<D> ||
           NoisyDynamicsIn<D, double, states_of<D>, StepContext<double, DynamicsTraits<D>::controls>>;
}
}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
