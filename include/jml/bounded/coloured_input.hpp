// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A disturbance that is not white: the plant and the filter that shapes its input, as one model with a white
/// disturbance.
///
/// x⁺ = f(x) + G₂ u, u⁺ = f₁(u) + G₁ w: of a linear pair [F₂ G₂; 0 F₁] and [0; G₁]. Bounded-noise
/// dissertation, eqs. (2.35)-(2.42), which puts u above x; its scan of (2.39) is garbled.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/bounds.hpp>

namespace jml {

/// Discrete dynamics of (x, u), n + q states, for any estimator.
///
/// `shaping`: dynamics whose states are the plant's q disturbances. Its disturbance_input(), _covariance()
/// and _bound(), without arguments, are those of the whole; the plant's own covariance and bound are not
/// read. A plant whose G reads the state has it as a template over the scalar. Control goes to the plant.
template <typename Plant, typename Shaping>
struct ColouredInput {
  /// Sizes and promises as a dynamics struct gives them; `inputs`: states of the shaping filter, q.
  /// @{
  static constexpr int plant_states = states_of<Plant>, inputs = states_of<Shaping>;
  static constexpr int states = plant_states + inputs;
  static constexpr int disturbances = DynamicsTraits<Shaping>::disturbances;
  static constexpr int controls = DynamicsTraits<Plant>::controls;
  static constexpr bool linear = DynamicsTraits<Plant>::linear && DynamicsTraits<Shaping>::linear;
  /// @}
  static_assert(detail::require_discrete<Plant>() && detail::require_discrete<Shaping>());
  static_assert(inputs == DynamicsTraits<Plant>::disturbances,
                "jml: ColouredInput: the shaping filter needs one state for each disturbance of the plant");
  static_assert(
      !requires { &Plant::disturbance_mean; },
      "jml: ColouredInput: the plant's disturbance is the shaping filter's state: give that one the mean");

  /// Its functions read time, dt or control.
  static constexpr bool timed = reads_context<double, Plant>() || reads_context<double, Shaping>();

  Plant plant;      ///< f and G₂
  Shaping shaping;  ///< f₁ and G₁

  /// (f(x) + G₂ u, f₁(u)).
  template <typename T>
  Vector<T, states> dynamics(const Vector<T, states>& x) const
    requires(!timed)
  {
    return both(x, StepContext<double, controls>{});
  }
  /// The same, of a plant or shaping filter that reads time, dt or control.
  template <typename T, typename At>
  Vector<T, states> dynamics(const Vector<T, states>& x, const At& at) const
    requires timed
  {
    return both(x, at);
  }
  /// [0; G₁].
  auto disturbance_input() const {
    const StepContext<double> none;
    Matrix<double, states, disturbances> G = kernel::zeros<Matrix<double, states, disturbances>>();
    G.template bottomRows<inputs>() = jml::disturbance_input(
        shaping, Vector<double, inputs>(kernel::zeros<Vector<double, inputs>>()), none);
    return G;
  }
  /// Of w, the shaping filter's disturbance.
  /// @{
  template <typename Filter = Shaping>
  auto disturbance_covariance() const -> decltype(std::declval<const Filter&>().disturbance_covariance()) {
    return shaping.disturbance_covariance();
  }
  template <typename Filter = Shaping>
  auto disturbance_bound() const -> decltype(std::declval<const Filter&>().disturbance_bound()) {
    return shaping.disturbance_bound();
  }
  template <typename Filter = Shaping>
  auto disturbance_mean() const -> decltype(std::declval<const Filter&>().disturbance_mean()) {
    return shaping.disturbance_mean();
  }
  /// @}

 private:
  template <typename T, typename At>
  Vector<T, states> both(const Vector<T, states>& x, const At& at) const {
    const Vector<T, plant_states> own = kernel::block<plant_states, 1>(x, 0, 0);
    const Vector<T, inputs> u = kernel::block<inputs, 1>(x, plant_states, 0);
    const Matrix<T, plant_states, inputs> G = jml::disturbance_input(plant, own, at);
    Vector<T, states> out;
    kernel::set_block(out, 0, 0, jml::dynamics(plant, own, at) + G * u);
    kernel::set_block(
        out, plant_states, 0,
        jml::dynamics(shaping, u, StepContext<decltype(at.dt), 0>{.time = at.time, .dt = at.dt}));
    return out;
  }
};

/// Types from the arguments.
template <typename Plant, typename Shaping>
ColouredInput(Plant, Shaping) -> ColouredInput<Plant, Shaping>;

/// A sensor of the plant on the state of its ColouredInput. Its noise_covariance() and noise_bound() without
/// arguments.
template <typename S, int plant_states, int inputs>
struct PlantSensor {
  /// As a sensor struct gives them.
  /// @{
  static constexpr int measurements = measurements_of<S>;
  static constexpr bool linear = SensorTraits<S>::linear;
  static constexpr bool timed = sensor_reads_context<S, Vector<double, plant_states>, StepContext<double>>();
  /// @}
  S sensor;  ///< of the plant

  /// As of the plant's sensor, at the plant's part of the state.
  /// @{
  template <typename T>
  Vector<T, measurements> measurement(const Vector<T, plant_states + inputs>& x) const
    requires(!timed)
  {
    return read(x, StepContext<double>{});
  }
  template <typename T, typename At>
  Vector<T, measurements> measurement(const Vector<T, plant_states + inputs>& x, const At& at) const
    requires timed
  {
    return read(x, at);
  }
  template <typename Own = S>
  auto noise_covariance() const -> decltype(std::declval<const Own&>().noise_covariance()) {
    return sensor.noise_covariance();
  }
  template <typename Own = S>
  auto noise_bound() const -> decltype(std::declval<const Own&>().noise_bound()) {
    return sensor.noise_bound();
  }
  template <typename Y, typename Own = S>
  auto residual(const Y& y, const Y& predicted) const
      -> decltype(std::declval<const Own&>().residual(y, predicted)) {
    return sensor.residual(y, predicted);
  }
  /// @}

 private:
  template <typename T, typename At>
  Vector<T, measurements> read(const Vector<T, plant_states + inputs>& x, const At& at) const {
    return jml::measurement(sensor, Vector<T, plant_states>(kernel::block<plant_states, 1>(x, 0, 0)), at);
  }
};

/// `sensor`, which knows the plant alone, for the estimator of the whole.
template <typename Plant, typename Shaping, typename S>
[[nodiscard]] constexpr auto sensor_of(const ColouredInput<Plant, Shaping>&, const S& sensor) {
  return PlantSensor<S, states_of<Plant>, states_of<Shaping>>{sensor};
}

}  // namespace jml
#include <jml/warnings_end.hpp>
