// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One discrete step of continuous dynamics in a space: ξ = f(x, w), the tangent velocity at x, x being x ⊞ ξ
/// dt after a short dt.
///
/// x(t) = x_k ⊞ δ(t), and δ is integrated: δ̇ = (∂/∂ε) ((x_k ⊞ δ ⊞ ε ξ) ⊟ x_k), which is dexp⁻¹ of ξ on a
/// group (Munthe-Kaas 1998): the state stays in its space, and the order of the integrator is kept. The
/// disturbance is held over the step, with covariance Q/dt, and enters through f itself.
#pragma once

#include <jml/model/concepts.hpp>
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
  using Space = typename detail::SpaceOfModel<Continuous>::type;
  static constexpr int states = numbers, disturbances = q, controls = Traits::controls;

  explicit DiscretizedInSpace(Continuous model) : continuous(std::move(model)) {}
  Continuous continuous;

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
  template <typename S>
    requires(q > 0)
  Matrix<S, q, q> disturbance_covariance(const Vector<S, numbers>& x,
                                         const StepContext<S, controls>& at) const {
    const Matrix<S, q, q> Q = jml::disturbance_spectral_density(continuous, x, at);
    return at.dt > S(0) ? Matrix<S, q, q>(Q / at.dt) : kernel::zeros<Matrix<S, q, q>>();
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
          const Vector<T, n> rate = velocity(here, w, then);
          using Along = Dual<T, 1>;
          Vector<Along, numbers> wide;
          Vector<Along, n> ahead;
          for (int i = 0; i < numbers; ++i) wide(i) = here(i);
          for (int i = 0; i < n; ++i) {
            ahead(i) = T(0);
            ahead(i).partial[0] = rate(i);
          }
          const Matrix<T, n, 1> moved = On::slope_of_minus(Vector<Along, numbers>(On::plus(wide, ahead)), x);
          for (int i = 0; i < n; ++i) slope(i) = moved(i, 0);
          return Status::ok;
        }));
    return On::plus(x, end);
  }
  template <typename T, typename At>
  Vector<T, n> velocity(const Vector<T, numbers>& x, const Vector<T, q>& w, const At& at) const {
    if constexpr (q > 0 && detail::NoisyDynamicsIn<Continuous, T, numbers, At>) {
      return detail::ask_noisy<detail::hooks::Dynamics>(continuous, x, w, at);
    } else {
      using Value = std::remove_cvref_t<decltype(detail::ask<detail::hooks::Dynamics>(continuous, x, at))>;
      static_assert(
          int(Value::RowsAtCompileTime) == n,
          "jml: continuous dynamics in a space answer with a tangent vector, of as many entries as there "
          "are degrees of freedom");
      Vector<T, n> out = detail::ask<detail::hooks::Dynamics>(continuous, x, at);
      if constexpr (q > 0) {
        using Plain = decltype(plain_value(T()));
        Vector<Plain, numbers> here;
        for (int i = 0; i < numbers; ++i) here(i) = plain_value(x(i));
        const auto G = detail::input_in<n>(continuous, here, at);
        for (int i = 0; i < n; ++i) {
          for (int j = 0; j < q; ++j) out(i) += G(i, j) * w(j);
        }
      }
      return out;
    }
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
