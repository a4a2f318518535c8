// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a step or a solver can answer. Every refusal has a name, and none of them touches the last good
/// estimate.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstdint>

namespace jml {

/// Outcome of a step, a prediction, a solver or a check: what may be used first, then every refusal.
enum class Status : std::uint8_t {
  ok,                      ///< done; the estimate was replaced
  accepted_at_rounding,    ///< iterated step: the root is exact to rounding, though its residual is above the
                           ///< tolerance
  accepted_at_limit,       ///< iterated step: the sweeps asked for were made and their result taken as it is
  accepted_at_prediction,  ///< fixed lag: no sweep lowered J, and the trajectory is the predicted one; the
                           ///< measurement stays in the window for the steps to come
  accepted_critical,  ///< algebraic Riccati equation with a double eigenvalue at the split: solved, and the
                      ///< error reported beside it says how many digits are left
  accepted_without_measurement,  ///< bounded noise: the measurement contradicts the stated bounds; the
                                 ///< predicted box was kept
  invalid_option,                ///< a tolerance, probability or bound outside its range
  invalid_time_step,             ///< dt is negative or not finite, or time is not finite
  invalid_control,               ///< the control input is not finite
  invalid_state,                 ///< the prior state is not finite
  invalid_covariance,            ///< the prior P is not finite, not symmetric where it must be, or indefinite
  invalid_measurement,           ///< y is not finite, or has not as many entries as the sensor says
  invalid_disturbance_covariance,  ///< Q is not finite, not symmetric or indefinite; or G is not finite
  invalid_noise_covariance,        ///< R is not finite, not symmetric or not positive definite
  dynamics_not_finite,             ///< f, its Jacobian or its SDC matrix gave a NaN or an infinity
  sensor_not_finite,               ///< m, its Jacobian or its SDC matrix gave a NaN or an infinity
  singular_innovation,    ///< the innovation matrix S is singular to rounding, or not positive definite in a
                          ///< symmetric rule
  innovation_indefinite,  ///< a gate was asked for, but sym(S) is not positive definite: NIS is not defined
  covariance_lost,  ///< the new P is not finite; or, of a symmetric rule, no digit of it is left in some
                    ///< direction, or no matrix of this scalar can hold it
  contradiction,    ///< a perfect measurement (R = 0) of what is known exactly says something else
  not_converged,    ///< no root of the implicit step was found within the bounds
  no_minimum,  ///< the root that was found is a saddle or a maximum of the criterion, and no way down from
               ///< it led to a minimum
  not_a_trajectory,  ///< the criterion J is not defined for this sequence of states
  riccati_escape,    ///< P of a nonsymmetric rule grows beyond all bounds in finite time, or faster than this
                     ///< step can follow
  step_too_long,     ///< beyond the stability of a fixed-step integrator at this gain or model, or it turns
                     ///< a state in a space further than a chart reaches
  step_limit,        ///< the integrator used all its steps before the end of the interval
  accuracy_not_met,  ///< the integrator could not meet its tolerances; or a measurement of a linear m is
                     ///< finer than the digits of x: give x about a nearer origin, or take the factored form
  integrator_failed,        ///< the integrator ran out of memory, or its linear algebra failed
  no_stabilizing_solution,  ///< algebraic Riccati equation: an unstable mode is not detectable (or not
                            ///< stabilisable), so that no solution stabilises
  eigenvalues_on_axis,  ///< algebraic Riccati equation: eigenvalues on the imaginary axis, no gap to split at
  memory_full,          ///< no room is left in the memory that was reserved at construction
  older_than_window,    ///< a late measurement of a time that has left the window of the fixed-lag filter
  invalid_box,          ///< a prior box with a NaN, or a lower bound above its upper one
  invalid_disturbance_bound,  ///< an entry of the disturbance bound is negative or not finite; or G is not
                              ///< finite
  invalid_noise_bound,        ///< an entry of the noise bound is negative or not finite
  outside_space,    ///< the dynamics led to numbers that are no state of their space (a quaternion of another
                    ///< length than 1)
  state_unbounded,  ///< bounded noise: a state has no bound yet, neither from a prior box nor from a
                    ///< measurement
  no_feasible_point,  ///< no trajectory of the model lies within the bounds of its states and disturbances
  damaged_image,  ///< no saved image, one cut short or changed since it was saved, or one that says what the
                  ///< object cannot be
  foreign_image,  ///< an intact image, of another filter or another format
};
/// For what is restored: jml/image/parts.hpp.
constexpr Status last_value(Status) { return Status::foreign_image; }

/// Who found the root of an implicit step.
enum class Solver : std::uint8_t {
  none,                 ///< a one-pass rule: nothing to solve
  picard,               ///< eq. (9) swept as printed
  anderson,             ///< Anderson acceleration of the Gauss-Newton sweep
  newton,               ///< damped Newton on the two ground-truth lines
  levenberg_marquardt,  ///< the core's fallback solver: whitened least squares, then Newton
  ceres,                ///< the same fallback, with Ceres (component jml::ceres)
};

/// True where the result may be used (it replaced the estimate).
[[nodiscard]] constexpr bool usable(Status status) { return status <= Status::accepted_without_measurement; }

/// One line for a log.
[[nodiscard]] constexpr const char* describe(Status status) {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::accepted_at_rounding:
      return "accepted: root exact to rounding, residual above the tolerance";
    case Status::accepted_at_limit:
      return "accepted: the bounded number of sweeps was made";
    case Status::accepted_at_prediction:
      return "accepted: no sweep lowered J, the trajectory is the predicted one";
    case Status::accepted_critical:
      return "accepted: a critical Riccati equation, with the error that is reported";
    case Status::accepted_without_measurement:
      return "accepted: the measurement contradicts the stated bounds, the predicted box was kept";
    case Status::invalid_option:
      return "refused: an option is outside its range";
    case Status::invalid_time_step:
      return "refused: dt is negative or time is not finite";
    case Status::invalid_control:
      return "refused: the control input is not finite";
    case Status::invalid_state:
      return "refused: the prior state is not finite";
    case Status::invalid_covariance:
      return "refused: the prior P is not finite, not symmetric or indefinite";
    case Status::invalid_measurement:
      return "refused: the measurement is not finite, or of the wrong size";
    case Status::invalid_disturbance_covariance:
      return "refused: Q is not finite, not symmetric or indefinite";
    case Status::invalid_noise_covariance:
      return "refused: R is not finite, not symmetric or not positive definite";
    case Status::dynamics_not_finite:
      return "refused: the dynamics gave a number that is not finite";
    case Status::sensor_not_finite:
      return "refused: the sensor model gave a number that is not finite";
    case Status::singular_innovation:
      return "refused: the innovation matrix is singular or indefinite";
    case Status::innovation_indefinite:
      return "refused: no gate is defined, the symmetric part of S is not positive definite";
    case Status::covariance_lost:
      return "refused: the new P would not be a covariance, its digits are lost";
    case Status::contradiction:
      return "refused: a perfect measurement contradicts what is known exactly";
    case Status::not_converged:
      return "refused: the implicit step did not converge";
    case Status::no_minimum:
      return "refused: the root is a saddle or a maximum of the criterion, and no minimum was reached";
    case Status::not_a_trajectory:
      return "refused: the states are no trajectory of the model";
    case Status::riccati_escape:
      return "refused: P escapes to infinity within the step, or faster than the step can follow";
    case Status::step_too_long:
      return "refused: the fixed step is too long for this gain or model, take more substeps or a stiff "
             "integrator; or it turns a state further than a chart reaches, take a shorter dt";
    case Status::step_limit:
      return "refused: the integrator used all its steps before the end of the interval";
    case Status::accuracy_not_met:
      return "refused: the integrator cannot meet its tolerances, or x has too few digits for this "
             "measurement";
    case Status::integrator_failed:
      return "refused: the integrator ran out of memory or its linear algebra failed";
    case Status::no_stabilizing_solution:
      return "refused: the Riccati equation has no stabilising solution";
    case Status::eigenvalues_on_axis:
      return "refused: the Riccati equation has eigenvalues on the imaginary axis";
    case Status::memory_full:
      return "refused: the memory reserved at construction is used up";
    case Status::older_than_window:
      return "refused: the measurement is older than the window";
    case Status::invalid_box:
      return "refused: the box has a NaN, or a lower bound above its upper one";
    case Status::invalid_disturbance_bound:
      return "refused: a bound of the disturbance is negative or not finite";
    case Status::invalid_noise_bound:
      return "refused: a bound of the measurement noise is negative or not finite";
    case Status::outside_space:
      return "refused: the dynamics left the space of the state";
    case Status::state_unbounded:
      return "refused: a state has no bound yet: give a prior box, or measure it with update() first";
    case Status::no_feasible_point:
      return "refused: no trajectory of the model lies within the bounds";
    case Status::damaged_image:
      return "refused: the saved image is damaged";
    case Status::foreign_image:
      return "refused: the saved image is of another filter, or of another format";
  }
  return "unknown status";
}

/// `std::cout << report.status`, by describe().
template <typename Stream>
auto operator<<(Stream& out, Status status) -> decltype(out << describe(status)) {
  return out << describe(status);
}

/// One word for a log.
[[nodiscard]] constexpr const char* describe(Solver solver) {
  switch (solver) {
    case Solver::none:
      return "none";
    case Solver::picard:
      return "Picard";
    case Solver::anderson:
      return "Anderson";
    case Solver::newton:
      return "Newton";
    case Solver::levenberg_marquardt:
      return "Levenberg-Marquardt";
    case Solver::ceres:
      return "Ceres";
  }
  return "unknown solver";
}

}  // namespace jml
#include <jml/warnings_end.hpp>
