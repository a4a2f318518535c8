// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The joint maximum likelihood criterion (Rusnak 2015, eq. (5)), and its one-step form (11).
///
/// J = ½ (x_0-x̂_0)ᵀP_0⁻¹(x_0-x̂_0) + ½ Σ wᵀQ⁻¹w + ½ Σ (y-m(x))ᵀR⁻¹(y-m(x)) is a function of (x_0, w), or of a
/// sequence of states that the model can follow: x_0 - x̂_0 in the range of P_0, x_{i+1} - f(x_i) in the range
/// of G Q Gᵀ. The output of a filter is no such sequence; for a filter, sum its one-step costs.
#pragma once

#include <jml/filter/iterated.hpp>

namespace jml {

/// Adds up J along a trajectory, in the order of time. After a refusal the value is NaN and stays so.
template <typename D, typename Scalar = double>
class Criterion {
  using Traits = DynamicsTraits<D>;
  static constexpr int n = Traits::states, q = Traits::disturbances;

 public:
  using At = Instant<Scalar, Traits::controls>;

  /// `prior`: x̂_0 and P_0; P_0 may be singular. `time`: s, of x_0.
  Criterion(D dynamics, const Estimate<Scalar, n>& prior, double time = 0)
      : dynamics_(std::move(dynamics)), prior_(prior), time_(time), status_(check_estimate(Ekf<>{}, prior)) {}

  /// Begins at x_0. not_a_trajectory where x_0 - x̂_0 is not in the range of P_0.
  Status start(const Vector<Scalar, n>& x0) {
    const kernel::SemidefiniteFactor<Scalar, n> factor(prior_.P);
    x_ = x0;
    return add(factor.squared_norm(x0 - prior_.x, slack(x0, prior_.x), term_));
  }

  /// x⁺ = f(x) + G (w̄ + w) over dt. not_a_trajectory where w is not in the range of Q.
  Status disturb(const Vector<Scalar, q>& w, Scalar dt = 0,
                 const Vector<Scalar, Traits::controls>& control = Vector<Scalar, Traits::controls>::Zero()) {
    const At at{time_, dt, control};
    const kernel::SemidefiniteFactor<Scalar, q> factor(disturbance_covariance(dynamics_, x_, at));
    const bool possible = factor.squared_norm(w, rounding * w.cwiseAbs(), term_);
    x_ = predicted_state(dynamics_, x_, at) + disturbance_input(dynamics_, x_, at) * w;
    time_ += static_cast<double>(dt);
    return add(possible);
  }

  /// The same for a given next state. not_a_trajectory where no disturbance of the model leads there.
  Status advance_to(
      const Vector<Scalar, n>& next, Scalar dt = 0,
      const Vector<Scalar, Traits::controls>& control = Vector<Scalar, Traits::controls>::Zero()) {
    const At at{time_, dt, control};
    const Vector<Scalar, n> f = predicted_state(dynamics_, x_, at);
    bool possible = false;
    const detail::ProcessNoise<Scalar, D> process_noise(dynamics_);
    const bool valid = process_noise.with(dynamics_, x_, at, [&](const Matrix<Scalar, n, n>& noise) {
      possible = kernel::SemidefiniteFactor<Scalar, n>(noise).squared_norm(next - f, slack(next, f), term_);
    });
    if (!valid) status_ = Status::invalid_disturbance_covariance;
    x_ = next;
    time_ += static_cast<double>(dt);
    return add(possible);
  }

  /// Adds the measurement y of the present state.
  template <typename S>
  Status measure(const S& sensor, const Vector<Scalar, measurements_of<S>>& y) {
    constexpr int p = measurements_of<S>;
    const At at{time_, 0, Vector<Scalar, Traits::controls>::Zero()};
    const Matrix<Scalar, p, p> R = noise_covariance(sensor, x_, at);
    kernel::SymmetricFactor<Scalar, p> factor;
    if (!detail::is_noise_covariance(R) || !factor.factor(R)) status_ = Status::invalid_noise_covariance;
    term_ = factor.squared_norm(measurement_residual(sensor, y, measurement(sensor, x_, at)));
    return add(true);
  }

  [[nodiscard]] Status status() const { return status_; }
  /// J so far; NaN after a refusal.
  [[nodiscard]] Scalar value() const {
    return status_ == Status::ok ? sum_ : std::numeric_limits<Scalar>::quiet_NaN();
  }
  [[nodiscard]] const Vector<Scalar, n>& x() const { return x_; }

 private:
  static constexpr Scalar rounding = Scalar(1e4) * std::numeric_limits<Scalar>::epsilon();

  /// What rounding may leave of a difference between two states.
  static Vector<Scalar, n> slack(const Vector<Scalar, n>& a, const Vector<Scalar, n>& b) {
    return rounding * (a.cwiseAbs() + b.cwiseAbs());
  }
  Status add(bool possible) {
    if (!possible && status_ == Status::ok) status_ = Status::not_a_trajectory;
    if (status_ == Status::ok && !std::isfinite(term_)) status_ = Status::dynamics_not_finite;
    sum_ += term_ / Scalar(2);
    return status_;
  }

  D dynamics_;
  Estimate<Scalar, n> prior_;
  Vector<Scalar, n> x_ = Vector<Scalar, n>::Zero();
  double time_;
  Scalar sum_ = 0, term_ = 0;
  Status status_;
};

/// A one-step cost, or why there is none.
template <typename Scalar>
struct OneStepCost {
  Status status = Status::ok;
  Scalar value = std::numeric_limits<Scalar>::quiet_NaN();
};

/// The criterion (11) of one step, from its prior, at the pair (x_{i/i+1}, w_i) that the rule implies;
/// `report` is what that step answered. An iterated rule has solved for the pair. A one-pass rule implies the
/// pair of its own linear problem, x̂ + P Bᵀ λ and w = Q Gᵀ λ with λ = Dᵀ S⁻¹ (y - m(x̄)); on a linear model
/// that is ½ NIS, the minimum. No cost: the step's own refusal, invalid_measurement for a rejected one,
/// invalid_covariance where sym(P) is indefinite.
template <typename Rule, typename D, typename S, typename Scalar, int n, int p>
[[nodiscard]] OneStepCost<Scalar> one_step_cost(const Rule& rule, const D& d, const S& s,
                                                const Estimate<Scalar, n>& prior, const Vector<Scalar, p>& y,
                                                const Instant<Scalar, DynamicsTraits<D>::controls>& at,
                                                const StepReport<Scalar, n, p>& report) {
  if (!usable(report.status)) return {report.status};
  if (report.gate == Verdict::rejected) return {Status::invalid_measurement};
  const Matrix<Scalar, n, n> symmetric_part = (prior.P + prior.P.transpose()) / Scalar(2);
  if (!is_definite<Definite::positive_or_zero>(symmetric_part)) return {Status::invalid_covariance};
  if constexpr (IteratedRule<Rule>) {
    return {Status::ok, report.cost};
  } else {
    const auto at_y = detail::at_sample(at);
    const Vector<Scalar, n> prediction = predicted_state(d, prior.x, at);
    const Vector<Scalar, n>& point = Rule::evaluated_at == EvaluatedAt::estimate ? prior.x : prediction;
    const Matrix<Scalar, p, p> R = noise_covariance(s, prediction, at_y);
    kernel::GeneralFactor<Scalar, p> S_factor;
    kernel::SymmetricFactor<Scalar, p> R_factor;
    if (!S_factor.factor(report.innovation_matrix, detail::noise_units(R)) || !R_factor.factor(R)) {
      return {Status::singular_innovation};
    }
    const Vector<Scalar, n> lambda = sensor_slot<Rule::D>(rule, s, prediction, prediction, at_y).transpose() *
                                     S_factor.solve(report.innovation);
    const Vector<Scalar, n> back = dynamics_slot<Rule::B>(rule, d, point, prior.x, at).transpose() * lambda;
    const Vector<Scalar, n> smoothed = prior.x + prior.P * back;
    OneStepCost<Scalar> cost{Status::ok, back.dot(prior.P * back)};
    Vector<Scalar, n> next = dynamics(d, smoothed, at) + (prediction - dynamics(d, prior.x, at));
    const bool valid =
        detail::ProcessNoise<Scalar, D>(d).with(d, prior.x, at, [&](const Matrix<Scalar, n, n>& noise) {
          next += noise * lambda;
          cost.value += lambda.dot(noise * lambda);
        });
    if (!valid) return {Status::invalid_disturbance_covariance};
    cost.value =
        (cost.value + R_factor.squared_norm(measurement_residual(s, y, measurement(s, next, at_y)))) /
        Scalar(2);
    if (!std::isfinite(cost.value)) return {Status::sensor_not_finite};
    return cost;
  }
}

}  // namespace jml
