// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The joint maximum likelihood criterion (Rusnak 2015, eq. (5)). Its one-step form (11):
/// iterated/one_step_cost.hpp.
///
/// J = ½ (x_0-x̂_0)ᵀP_0⁻¹(x_0-x̂_0) + ½ Σ wᵀQ⁻¹w + ½ Σ (y-m(x))ᵀR⁻¹(y-m(x)) is a function of (x_0, w), or of a
/// sequence of states that the model can follow: x_0 - x̂_0 in the range of P_0, x_{i+1} - f(x_i) in the range
/// of G Q Gᵀ. The output of a filter is no such sequence; for a filter, sum its one-step costs.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/riccati/difference.hpp>

namespace jml {

/// Adds up J along a trajectory, in the order of time. After a refusal the value is NaN and stays so.
template <typename D, typename Scalar = double>
class Criterion {
  using Traits = DynamicsTraits<D>;
  static constexpr int n = Traits::states, q = Traits::disturbances;

 public:
  using At = StepContext<Scalar, Traits::controls>;  ///< time, dt and control of a step

  /// `prior`: x̂_0 and P_0; P_0 may be singular. `time`: s, of x_0.
  Criterion(D dynamics, const Estimate<Scalar, n>& prior, double time = 0)
      : dynamics_(std::move(dynamics)), prior_(prior), time_(time), status_(check_estimate(Ekf<>{}, prior)) {}

  /// Begins at x_0. not_a_trajectory where x_0 - x̂_0 is not in the range of P_0.
  Status start(const Argument<Scalar, n>& x0) {
    const kernel::SemidefiniteFactor<Scalar, n> factor(prior_.P);
    x_ = x0;
    sum_ = 0;
    started_ = true;
    return add(factor.squared_norm(x0 - prior_.x, slack(x0, prior_.x), term_));
  }

  /// x⁺ = f(x) + G (w̄ + w) over dt. not_a_trajectory where w is not in the range of Q.
  Status disturb(
      const Argument<Scalar, q>& w, Scalar dt = 0,
      const Argument<Scalar, Traits::controls>& control = kernel::zeros<Vector<Scalar, Traits::controls>>()) {
    const At at{time_, dt, control};
    const Matrix<Scalar, q, q> Q = disturbance_covariance(dynamics_, x_, at);
    if (!is_covariance(Q)) refuse(Status::invalid_disturbance_covariance);
    const kernel::SemidefiniteFactor<Scalar, q> factor(Q);
    const bool possible = factor.squared_norm(w, rounding * kernel::absolute(w), term_);
    x_ = predicted_state(dynamics_, x_, at) + disturbance_input(dynamics_, x_, at) * w;
    time_ += static_cast<double>(dt);
    return add(possible);
  }

  /// The same for a given next state. not_a_trajectory where no disturbance of the model leads there.
  Status advance_to(
      const Argument<Scalar, n>& next, Scalar dt = 0,
      const Argument<Scalar, Traits::controls>& control = kernel::zeros<Vector<Scalar, Traits::controls>>()) {
    const At at{time_, dt, control};
    const Vector<Scalar, n> f = predicted_state(dynamics_, x_, at);
    bool possible = false;
    const ProcessNoise<Scalar, D> process_noise(dynamics_);
    const bool valid = process_noise.with(dynamics_, x_, at, [&](const Matrix<Scalar, n, n>& noise) {
      possible = kernel::SemidefiniteFactor<Scalar, n>(noise).squared_norm(next - f, slack(next, f), term_);
    });
    if (!valid) refuse(Status::invalid_disturbance_covariance);
    x_ = next;
    time_ += static_cast<double>(dt);
    return add(possible);
  }

  /// Adds the measurement y of the present state.
  template <typename S>
  Status measure(const S& sensor, const Argument<Scalar, measurements_of<S>>& y) {
    constexpr int p = measurements_of<S>;
    const At at{time_, 0, kernel::zeros<Vector<Scalar, Traits::controls>>()};
    const Matrix<Scalar, p, p> R = noise_covariance(sensor, x_, at);
    kernel::SymmetricFactor<Scalar, p> factor;
    term_ = std::numeric_limits<Scalar>::quiet_NaN();
    if (!all_finite(y)) refuse(Status::invalid_measurement);
    if (!is_noise_covariance(R) || !factor.factor(R)) {
      refuse(Status::invalid_noise_covariance);
    } else {
      term_ = factor.squared_norm(measurement_residual(sensor, y, measurement(sensor, x_, at)));
      if (!std::isfinite(term_)) refuse(Status::sensor_not_finite);
    }
    return add(true);
  }

  [[nodiscard]] Status status() const { return status_; }  ///< ok, or the first refusal
  /// J so far; NaN after a refusal.
  [[nodiscard]] Scalar value() const {
    return status_ == Status::ok ? sum_ : std::numeric_limits<Scalar>::quiet_NaN();
  }
  [[nodiscard]] const Vector<Scalar, n>& x() const { return x_; }  ///< the last state added

 private:
  static constexpr Scalar rounding = Scalar(1e4) * std::numeric_limits<Scalar>::epsilon();

  /// What rounding may leave of a difference between two states.
  static Vector<Scalar, n> slack(const Vector<Scalar, n>& a, const Vector<Scalar, n>& b) {
    return rounding * (kernel::absolute(a) + kernel::absolute(b));
  }
  /// The first refusal stays.
  void refuse(Status status) {
    if (status_ == Status::ok) status_ = status;
  }
  Status add(bool possible) {
    if (!started_ || !possible) refuse(Status::not_a_trajectory);  // without start() there is no x_0
    if (!std::isfinite(term_)) refuse(Status::dynamics_not_finite);
    sum_ += term_ / Scalar(2);
    return status_;
  }

  D dynamics_;
  Estimate<Scalar, n> prior_;
  Vector<Scalar, n> x_ = kernel::zeros<Vector<Scalar, n>>();
  double time_;
  bool started_ = false;
  Scalar sum_ = 0, term_ = 0;
  Status status_;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
