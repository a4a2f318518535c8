// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Noise of a sensor that goes with the disturbance of its step: E[w vᵀ] = C of the step that ends with the
/// measurement. Then v = Cᵀ Q⁻¹ w + v' with v' of covariance R - Cᵀ Q⁻¹ C, independent of w: the usual
/// elimination, with a state that remembers w.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>
#include <jml/model/beside.hpp>

namespace jml {

/// Discrete dynamics of (x, w): the plant, which remembers the disturbance of the last step. Its sensors:
/// correlated() of those whose noise goes with it, beside() of the others.
template <typename Plant>
struct RemembersDisturbance {
  static_assert(detail::require_discrete<Plant>() && detail::require_no_mean<Plant>());
  /// Sizes as a dynamics struct gives them; `timed`: reads time, dt or control.
  /// @{
  static constexpr int plant_states = states_of<Plant>, disturbances = DynamicsTraits<Plant>::disturbances;
  using Space = detail::SpaceBeside<Plant, disturbances>;
  static constexpr int states = plant_states + disturbances, controls = DynamicsTraits<Plant>::controls;

  static constexpr bool timed = reads_context<double, Plant>();
  /// @}

  Plant plant;  ///< of x

  /// As a dynamics struct gives them: (f(x, w), w), and the plant's Q.
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
    return jml::disturbance_covariance(plant, detail::piece<plant_states>(x, 0),
                                       StepContext<Scalar, controls>{});
  }
  template <typename Scalar>
  Matrix<Scalar, disturbances, disturbances> disturbance_covariance(
      const Vector<Scalar, states>& x, const StepContext<Scalar, controls>& at) const
    requires timed
  {
    return jml::disturbance_covariance(plant, detail::piece<plant_states>(x, 0), at);
  }
  /// @}

 private:
  template <typename T, typename Scalar>
  Vector<T, states> both(const Vector<T, states>& x, const Vector<T, disturbances>& w,
                         const StepContext<Scalar, controls>& at) const {
    Vector<T, states> out;
    detail::set_piece(out, 0, detail::moved(plant, detail::piece<plant_states>(x, 0), w, at));
    detail::set_piece(out, plant_states, w);
    return out;
  }
};
/// Types from the arguments.
template <typename Plant>
RemembersDisturbance(Plant) -> RemembersDisturbance<Plant>;

namespace detail {

/// Cᵀ Q⁻¹ w, and R - Cᵀ Q⁻¹ C.
template <int q, int r>
struct Correlation : NoEffect {
  Matrix<double, r, q> share;
  Matrix<double, q, r> C;
  template <typename V, typename X>
  V noise(const V& v, const X& w) const {
    V out = v;
    for (int i = 0; i < r; ++i) {
      for (int j = 0; j < q; ++j) out(i) += share(i, j) * w(j);
    }
    return out;
  }
  template <typename R>
  R covariance(const R& given) const {
    return kernel::symmetric_part(
        R(given - kernel::cast<typename R::Scalar>(Matrix<double, r, r>(share * C))));
  }
};

}  // namespace detail

/// A sensor with E[w vᵀ] = C, q×r, w being the disturbance of the step that ends with the measurement. Q, a
/// constant of the plant, has to be positive definite: where it is not, the sensor's R is NaN, and refused.
template <typename Plant, typename S>
[[nodiscard]] auto correlated(
    const RemembersDisturbance<Plant>& whole, const S& sensor,
    const Matrix<double, DynamicsTraits<Plant>::disturbances, detail::noises_of_sensor<S>()>& C) {
  constexpr int q = DynamicsTraits<Plant>::disturbances, r = detail::noises_of_sensor<S>();
  using X = Vector<double, states_of<Plant>>;
  using At = StepContext<double, DynamicsTraits<Plant>::controls>;
  static_assert(detail::ConstantHook<detail::hooks::DisturbanceCovariance, Plant, X, At>,
                "jml: correlated() asks for a plant whose disturbance_covariance() takes no arguments");
  detail::Correlation<q, r> effect;
  effect.C = C;
  kernel::SymmetricFactor<double, q> factor;
  const bool regular = factor.factor(jml::disturbance_covariance(whole.plant, X(kernel::zeros<X>()), At{}));
  for (int j = 0; j < r; ++j) {
    const Vector<double, q> column = factor.solve(kernel::column_of(C, j));
    for (int i = 0; i < q; ++i)
      effect.share(j, i) = regular ? column(i) : std::numeric_limits<double>::quiet_NaN();
  }
  return detail::SensorBeside<S, states_of<Plant>, q, detail::Correlation<q, r>>{sensor, effect};
}

}  // namespace jml
#include <jml/warnings_end.hpp>
