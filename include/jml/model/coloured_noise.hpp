// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Noise of a sensor that is not white: y = m(x, v) + C ξ with ξ⁺ = f₁(ξ, η), a shaping filter beside the
/// plant (bounded-noise dissertation, eq. (2.35), has it for inputs; those: bounded/coloured_input.hpp).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/beside.hpp>

namespace jml {

/// Discrete dynamics of (x, ξ): `plant`, and beside it the `shaping` filter of a sensor's noise, in ℝᵏ (of a
/// continuous one jml::discretize makes a discrete one). Disturbances (w, η); control goes to the plant. Its
/// sensors: with_coloured_noise() of that one, beside() of the others.
template <typename Plant, typename Shaping>
struct ColouredNoise {
  static_assert(detail::require_discrete<Plant>() && detail::require_discrete<Shaping>());
  static_assert(detail::require_no_mean<Plant>() && detail::require_no_mean<Shaping>());
  /// Sizes as a dynamics struct gives them; `shaped`: states of the shaping filter; `timed`: reads time, dt
  /// or control.
  /// @{
  static constexpr int shaped = states_of<Shaping>, plant_states = states_of<Plant>;
  static constexpr int plant_disturbances = DynamicsTraits<Plant>::disturbances;
  using Space = detail::SpaceBeside<Plant, shaped>;
  static constexpr int states = plant_states + shaped;
  static constexpr int disturbances = plant_disturbances + DynamicsTraits<Shaping>::disturbances;
  static constexpr int controls = DynamicsTraits<Plant>::controls;

  static constexpr bool timed = reads_context<double, Plant>() || reads_context<double, Shaping>();
  /// @}

  Plant plant;      ///< of x
  Shaping shaping;  ///< of ξ

  /// As a dynamics struct gives them: (f(x, w), f₁(ξ, η)), and the covariances of w and η side by side.
  /// @{
  template <typename T>
  Vector<T, states> dynamics(const Vector<T, states>& x, const Vector<T, disturbances>& w) const
    requires(!timed)
  {
    return both(x, w, StepContext<double, controls>{});
  }
  template <typename T, typename Scalar>
  Vector<T, states> dynamics(const Vector<T, states>& x, const Vector<T, disturbances>& w,
                             const StepContext<Scalar, controls>& at) const
    requires timed
  {
    return both(x, w, at);
  }
  template <typename Scalar>
  Matrix<Scalar, disturbances, disturbances> disturbance_covariance(const Vector<Scalar, states>& x) const
    requires(!timed)
  {
    return covariance(x, StepContext<Scalar, controls>{});
  }
  template <typename Scalar>
  Matrix<Scalar, disturbances, disturbances> disturbance_covariance(
      const Vector<Scalar, states>& x, const StepContext<Scalar, controls>& at) const
    requires timed
  {
    return covariance(x, at);
  }
  /// @}

 private:
  template <typename T, typename Scalar>
  Vector<T, states> both(const Vector<T, states>& x, const Vector<T, disturbances>& w,
                         const StepContext<Scalar, controls>& at) const {
    Vector<T, states> out;
    detail::set_piece(
        out, 0,
        detail::moved(plant, detail::piece<plant_states>(x, 0), detail::piece<plant_disturbances>(w, 0), at));
    detail::set_piece(out, plant_states,
                      detail::moved(shaping, detail::piece<shaped>(x, plant_states),
                                    detail::piece<disturbances - plant_disturbances>(w, plant_disturbances),
                                    StepContext<Scalar>{.time = at.time, .dt = at.dt}));
    return out;
  }
  template <typename Scalar>
  Matrix<Scalar, disturbances, disturbances> covariance(const Vector<Scalar, states>& x,
                                                        const StepContext<Scalar, controls>& at) const {
    Matrix<Scalar, disturbances, disturbances> Q =
        kernel::zeros<Matrix<Scalar, disturbances, disturbances>>();
    if constexpr (plant_disturbances > 0)
      kernel::set_block(Q, 0, 0, jml::disturbance_covariance(plant, detail::piece<plant_states>(x, 0), at));
    kernel::set_block(Q, plant_disturbances, plant_disturbances,
                      jml::disturbance_covariance(shaping, detail::piece<shaped>(x, plant_states),
                                                  StepContext<Scalar>{.time = at.time, .dt = at.dt}));
    return Q;
  }
};
/// Types from the arguments.
template <typename Plant, typename Shaping>
ColouredNoise(Plant, Shaping) -> ColouredNoise<Plant, Shaping>;

namespace detail {

/// C ξ.
template <int p, int k>
struct AddedColour : NoEffect {
  explicit AddedColour(const Matrix<double, p, k>& matrix) : C(matrix) {}
  Matrix<double, p, k> C;
  template <typename Y, typename X>
  void add(Y& y, const X& shaped) const {
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j < k; ++j) y(i) += C(i, j) * shaped(j);
    }
  }
};
}  // namespace detail

/// y = m(x, v) + C ξ, C p×k; R stays that of the white part v.
template <typename Plant, typename Shaping, typename S>
[[nodiscard]] auto with_coloured_noise(const ColouredNoise<Plant, Shaping>&, const S& sensor,
                                       const Matrix<double, measurements_of<S>, states_of<Shaping>>& C) {
  using Effect = detail::AddedColour<measurements_of<S>, states_of<Shaping>>;
  return detail::SensorBeside<S, states_of<Plant>, states_of<Shaping>, Effect>{sensor, Effect(C)};
}

}  // namespace jml
#include <jml/warnings_end.hpp>
