// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The one-step form (11) of the joint maximum likelihood criterion, for any rule.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/iterated/iterated.hpp>

namespace jml {

/// A one-step cost, or why there is none.
template <typename Scalar>
struct OneStepCost {
  Status status = Status::ok;                               ///< ok, or why there is no cost
  Scalar value = std::numeric_limits<Scalar>::quiet_NaN();  ///< of (11), no unit; NaN where there is none
};

/// The criterion (11) of one step, from its prior, at the pair (x_{i/i+1}, w_i) that the rule implies;
/// `report` is what that step answered. An iterated rule has solved for the pair. A one-pass rule implies the
/// pair of its own linear problem, x̂ + P Bᵀ λ and w = Q Gᵀ λ with λ = Dᵀ S⁻¹ (y - m(x̄)); on a linear model
/// that is ½ NIS, the minimum. No cost: the step's own refusal, invalid_measurement for a rejected one,
/// invalid_covariance where sym(P) is indefinite.
template <typename Rule, typename D, typename S, typename Scalar, int n, int p, typename Report>
[[nodiscard]] OneStepCost<Scalar> one_step_cost(const Rule& rule, const D& d, const S& s,
                                                const Estimate<Scalar, n>& prior, const Vector<Scalar, p>& y,
                                                const StepContext<Scalar, DynamicsTraits<D>::controls>& at,
                                                const Report& report) {
  if (!usable(report.status)) return {report.status};
  if (report.gate == Verdict::rejected) return {Status::invalid_measurement};
  const Matrix<Scalar, n, n> symmetric_part = kernel::symmetric_part(prior.P);
  if (!is_definite<Definite::positive_or_zero>(symmetric_part)) return {Status::invalid_covariance};
  if constexpr (IteratedRule<Rule>) {
    if (!std::isfinite(report.cost)) return {Status::not_converged};  // accepted_at_limit: no root, no cost
    return {Status::ok, report.cost};
  } else {
    const auto at_y = end_of(at);
    const Vector<Scalar, n> prediction = predicted_state(d, prior.x, at);
    const Vector<Scalar, n>& point = Rule::evaluated_at == EvaluatedAt::estimate ? prior.x : prediction;
    const Matrix<Scalar, p, p> R = noise_covariance(s, prediction, at_y);
    kernel::GeneralFactor<Scalar, p> S_factor;
    kernel::SymmetricFactor<Scalar, p> R_factor;
    if (!S_factor.factor(report.innovation_matrix, detail::noise_units(R)) || !R_factor.factor(R)) {
      return {Status::singular_innovation};
    }
    const Vector<Scalar, n> lambda =
        kernel::transposed(sensor_slot<Rule::D>(rule, s, prediction, prediction, at_y)) *
        S_factor.solve(report.innovation);
    const Vector<Scalar, n> back =
        kernel::transposed(dynamics_slot<Rule::B>(rule, d, point, prior.x, at)) * lambda;
    const Vector<Scalar, n> smoothed = prior.x + prior.P * back;
    OneStepCost<Scalar> cost{Status::ok, kernel::dot(back, Vector<Scalar, n>(prior.P * back))};
    Vector<Scalar, n> next = dynamics(d, smoothed, at) + (prediction - dynamics(d, prior.x, at));
    const bool valid =
        ProcessNoise<Scalar, D>(d).with(d, prior.x, at, [&](const Matrix<Scalar, n, n>& noise) {
          next += noise * lambda;
          cost.value += kernel::dot(lambda, Vector<Scalar, n>(noise * lambda));
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
#include <jml/warnings_end.hpp>
