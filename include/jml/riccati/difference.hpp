// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The one difference recursion behind Kalman, EKF, SDDRE and JML (Rusnak 2015, Table 1), in gain form.
///
/// N = A P Bᵀ + G Q Gᵀ; S = R + E N Dᵀ; K = N Dᵀ S⁻¹; P⁺ = N - K E N, which is [N⁻¹ + Dᵀ R⁻¹ E]⁻¹ without
/// inverting N: P_0 = 0 and a rank-deficient G Q Gᵀ are ordinary, and P⁺ Dᵀ R⁻¹ = K. (The print of (7) has
/// P_i in the update; it is P_{i+1}.) A symmetric rule factors S = L D Lᵀ and mirrors one triangle, so P
/// stays exactly symmetric; a nonsymmetric one uses LU with column exchanges.
///
/// A rule that has keep_transition(A) and keep_correction(D, S, innovation, K) is handed what a step used, as
/// a smoother's is; for any other rule nothing is compiled.
#pragma once

#include <jml/factors.hpp>
#include <jml/gate.hpp>
#include <jml/riccati/gain_rule.hpp>
#include <jml/riccati/process_noise.hpp>
#include <jml/filter/report.hpp>

namespace jml {

namespace detail {

template <typename Scalar, int controls>
JML_INLINE inline Status check_context(const StepContext<Scalar, controls>& at) {
  if (!(at.dt >= Scalar(0)) || !std::isfinite(at.dt) || !std::isfinite(at.time))
    return Status::invalid_time_step;
  if constexpr (controls > 0) {
    if (!all_finite(at.control)) return Status::invalid_control;
  }
  return Status::ok;
}

/// The sensor's time is the end of the step.
template <typename At>
At at_sample(At at) {
  at.time += static_cast<double>(at.dt);
  return at;
}

/// √R_ii, the unit of each component for a pivot test; with p = 1 no unit is needed but R's own, and no root.
template <typename Scalar, int p>
Vector<Scalar, p> noise_units(const Matrix<Scalar, p, p>& R) {
  if constexpr (p == 1)
    return R;
  else {
    Vector<Scalar, p> units;
    for (int i = 0; i < p; ++i) units(i) = std::sqrt(R(i, i));
    return units;
  }
}

/// K and P⁺ from N: the algebra of one correction, for slots D and E (p×n).
/// False where S is singular (or, in a symmetric rule, not positive definite).
template <bool symmetric, typename Scalar, int n, int p>
JML_INLINE inline bool correct_riccati(const Matrix<Scalar, n, n>& N,
                                                   const Matrix<Scalar, p, n>& slot_d,
                                                   const Matrix<Scalar, p, n>& slot_e,
                                                   const Matrix<Scalar, p, p>& R, Matrix<Scalar, p, p>& S,
                                                   Matrix<Scalar, n, p>& gain, Matrix<Scalar, n, n>& P) {
  Matrix<Scalar, n, p> ND;
  kernel::product_transposed(N, slot_d, ND);
  if constexpr (symmetric) {
    kernel::add_product<1>(R, slot_d, ND, S);
    kernel::SymmetricFactor<Scalar, p> factor;
    if (!factor.factor(S)) return false;
    Matrix<Scalar, n, p> v, scaled;
    factor.right_solve(ND, v, scaled, gain);
    kernel::add_symmetric_product<-1>(N, scaled, v, P);
  } else {
    kernel::add_product<1>(R, slot_e, ND, S);
    kernel::GeneralFactor<Scalar, p> factor;
    if (!factor.factor(S, noise_units(R))) return false;
    factor.right_solve(ND, gain);
    Matrix<Scalar, p, n> EN;
    kernel::product(slot_e, N, EN);
    kernel::add_product<-1>(N, gain, EN, P);
  }
  return true;
}

/// A prediction's P is finite and, in a symmetric rule, has no negative variance. (A zero is right where the
/// dynamics forget a state.)
template <bool symmetric, typename Scalar, int n>
JML_INLINE inline bool is_valid(const Matrix<Scalar, n, n>& P) {
  if constexpr (symmetric) {
    bool positive = true;
    kernel::repeat<n>([&](int i) JML_INLINE { positive &= P(i, i) >= Scalar(0); });
    if (!positive) return false;
  }
  return all_finite(P);
}

/// A variance of P⁺ that is zero was zero before: with R > 0 a measurement leaves something of every other.
/// Asked where some variance is not positive, out of the way of the rest.
template <bool symmetric, typename Scalar, int n>
JML_NOINLINE bool zeros_were_zeros(const Matrix<Scalar, n, n>& N, const Matrix<Scalar, n, n>& P) {
  for (int i = 0; i < n; ++i) {
    if (symmetric && !(P(i, i) >= Scalar(0))) return false;
    if (P(i, i) == Scalar(0) && N(i, i) != Scalar(0)) return false;
  }
  return true;
}

/// P⁺ of a correction of N is finite and has lost no variance: N - K E N cancels where N is much larger than
/// R, and a zero left there would shut the filter against all later measurements. In a nonsymmetric rule,
/// whose diagonal may have either sign, only an exact zero tells.
template <bool symmetric, typename Scalar, int n>
JML_INLINE inline bool is_valid(const Matrix<Scalar, n, n>& N, const Matrix<Scalar, n, n>& P) {
  bool clear = true;
  kernel::repeat<n>([&](int i) JML_INLINE {
    clear &= symmetric ? P(i, i) > Scalar(0) : P(i, i) != Scalar(0);
  });
  return (clear || zeros_were_zeros<symmetric>(N, P)) && all_finite(P);
}

template <typename Rule, bool linear>
consteval bool require_linear_if_kalman() {
  if constexpr (requires { Rule::linear_only; }) {
    static_assert(
        linear,
        "jml: Kalman is for linear models: say `static constexpr bool linear = true;` in it, or use Ekf");
  }
  return true;
}

/// predict() into the caller's x̄ and N, which are touched on refusal too and not asked to be finite: a NaN
/// goes through every later line, so the hot path looks for it once, at its end, and only then asks where it
/// came from.
template <typename Rule, typename D, typename Scalar, int n, typename At>
JML_INLINE inline Status predict_into(const Rule& rule, const D& d,
                                                  const ProcessNoise<Scalar, D>& process_noise,
                                                  const Estimate<Scalar, n>& prior, const At& at,
                                                  Vector<Scalar, n>& x, Matrix<Scalar, n, n>& N) {
  if (const Status status = check_context(at); status != Status::ok) return status;
  kernel::assign(x, predicted_state(d, prior.x, at));
  const Vector<Scalar, n>& point = Rule::evaluated_at == EvaluatedAt::estimate ? prior.x : x;
  const Matrix<Scalar, n, n> A = dynamics_slot<Rule::A>(rule, d, point, prior.x, at);
  if constexpr (requires { rule.keep_transition(A); }) rule.keep_transition(A);
  Matrix<Scalar, n, n> AP;
  kernel::product(A, prior.P, AP);
  const bool valid = process_noise.with(
      d, prior.x, at, [&](const Matrix<Scalar, n, n>& noise) JML_INLINE {
        if constexpr (Rule::symmetric) {
          kernel::add_symmetric_product<1>(noise, AP, A, N);
        } else {
          kernel::add_product_transposed<1>(noise, AP, dynamics_slot<Rule::B>(rule, d, point, prior.x, at),
                                            N);
        }
      });
  return valid ? Status::ok : Status::invalid_disturbance_covariance;
}

/// Why a prediction from `prior` to x, N is not one.
template <typename Scalar, int n>
JML_NOINLINE Status diagnose(const Estimate<Scalar, n>& prior, const Vector<Scalar, n>& x,
                               const Matrix<Scalar, n, n>& N) {
  if (!all_finite(prior.x)) return Status::invalid_state;
  if (!all_finite(prior.P)) return Status::invalid_covariance;
  return all_finite(x) && all_finite(N) ? Status::covariance_lost : Status::dynamics_not_finite;
}

/// Why a correction failed, in the order in which its inputs came.
template <typename Scalar, int n, int p>
JML_NOINLINE Status diagnose(const Vector<Scalar, n>& prediction, const Matrix<Scalar, n, n>& N,
                               const Vector<Scalar, p>& y, const Matrix<Scalar, p, n>& slot_d,
                               const StepReport<Scalar, n, p>& report, bool regular) {
  if (!all_finite(y)) return Status::invalid_measurement;
  if (!all_finite(prediction)) return Status::invalid_state;
  if (!all_finite(N)) return Status::invalid_covariance;
  if (!all_finite(report.innovation) || !all_finite(slot_d) || !all_finite(report.innovation_matrix))
    return Status::sensor_not_finite;
  return regular ? Status::covariance_lost : Status::singular_innovation;
}

/// update() of x̄, N into the caller's x and P, which are touched on refusal too. A measurement that the gate
/// rejects leaves the prediction in them.
template <typename Rule, typename S, typename Scalar, int n, int p, typename At>
JML_INLINE inline void update_into(const Rule& rule, const S& s,
                                               const Vector<Scalar, n>& prediction,
                                               const Matrix<Scalar, n, n>& N, const Vector<Scalar, p>& y,
                                               const At& at, const Gate& gate,
                                               StepReport<Scalar, n, p>& report, Vector<Scalar, n>& x,
                                               Matrix<Scalar, n, n>& P) {
  const auto answer = [&report](Status status) { report.status = status; };
  const Matrix<Scalar, p, p> R = noise_covariance(s, prediction, at);
  if (!is_noise_covariance(R))
    return answer(all_finite(prediction) ? Status::invalid_noise_covariance : Status::invalid_state);
  // Locals, stored into the report when done: a value just stored in pieces is slow to load back as a whole.
  const Vector<Scalar, p> innovation = measurement_residual(s, y, measurement(s, prediction, at));
  const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(rule, s, prediction, prediction, at);
  Matrix<Scalar, p, p> S_matrix;
  Matrix<Scalar, n, p> gain;
  bool regular = false;
  if constexpr (Rule::D == Rule::E) {
    regular = correct_riccati<Rule::symmetric>(N, slot_d, slot_d, R, S_matrix, gain, P);
  } else {
    const Matrix<Scalar, p, n> slot_e = sensor_slot<Rule::E>(rule, s, prediction, prediction, at);
    regular = correct_riccati<Rule::symmetric>(N, slot_d, slot_e, R, S_matrix, gain, P);
  }
  kernel::assign(report.innovation, innovation);
  kernel::assign(report.innovation_matrix, S_matrix);
  if (!regular) return answer(diagnose(prediction, N, y, slot_d, report, false));
  kernel::assign(report.gain, gain);
  if (!gate.off()) {
    if (!gate.valid()) return answer(Status::invalid_option);
    if (!all_finite(S_matrix) || !all_finite(innovation) || !all_finite(N) || !all_finite(prediction)) {
      return answer(diagnose(prediction, N, y, slot_d, report, true));
    }
    if (!judge(gate, report)) return answer(Status::innovation_indefinite);
    if (report.gate == Verdict::rejected) {
      if (!is_valid<Rule::symmetric>(N)) return answer(Status::covariance_lost);
      kernel::assign(x, prediction);
      kernel::assign(P, N);
      return;
    }
  }
  if constexpr (requires { rule.keep_correction(slot_d, S_matrix, innovation, gain); })
    rule.keep_correction(slot_d, S_matrix, innovation, gain);
  kernel::add_product<1>(prediction, gain, innovation, x);
  if (!(is_valid<Rule::symmetric>(N, P) && all_finite(x)))
    answer(diagnose(prediction, N, y, slot_d, report, true));
}

}  // namespace detail

/// What a prior must be: finite, and P symmetric positive semidefinite; for a nonsymmetric rule, whose later
/// P are no covariances, the symmetric part of P.
template <typename Rule, typename Scalar, int n>
[[nodiscard]] Status check_estimate(const Rule&, const Estimate<Scalar, n>& estimate) {
  if (!all_finite(estimate.x)) return Status::invalid_state;
  if (!all_finite(estimate.P)) return Status::invalid_covariance;
  if (Rule::symmetric && !is_symmetric(estimate.P)) return Status::invalid_covariance;
  const Matrix<Scalar, n, n> symmetric_part = kernel::symmetric_part(estimate.P);
  return is_definite<Definite::positive_or_zero>(symmetric_part) ? Status::ok : Status::invalid_covariance;
}

/// Propagates an estimate over a step: x̄ = f(x̂) + G w̄, N = A P Bᵀ + G Q Gᵀ.
/// Refuses a bad StepContext, a prior or a model that is not finite, a varying Q that is no covariance, an N with
/// a negative variance (symmetric rules). That P is a covariance is trusted here: check_estimate asks it
/// once.
template <OnePassRule Rule, typename D, typename Scalar, int n>
[[nodiscard]] PredictResult<Scalar, n> predict(
    const Rule& rule, const D& d, const detail::ProcessNoise<Scalar, D>& process_noise,
    const Estimate<Scalar, n>& prior,
    const StepContext<Scalar, DynamicsTraits<D>::controls>& at = no_context<Scalar, D>()) {
  static_assert(detail::require_discrete<D>() &&
                detail::require_linear_if_kalman<Rule, DynamicsTraits<D>::linear>());
  static_assert(states_of<D> == n, "jml: the estimate has not as many states as the dynamics");
  PredictResult<Scalar, n> out;
  out.status = detail::predict_into(rule, d, process_noise, prior, at, out.estimate.x, out.estimate.P);
  if (out.status == Status::ok && !(all_finite(out.estimate.x) && all_finite(prior.x) &&
                                    detail::is_valid<Rule::symmetric>(out.estimate.P))) {
    out.status = detail::diagnose(prior, out.estimate.x, out.estimate.P);
  }
  if (out.status != Status::ok) out.estimate = prior;
  return out;
}

template <OnePassRule Rule, typename D, typename Scalar, int n>
[[nodiscard]] PredictResult<Scalar, n> predict(
    const Rule& rule, const D& d, const Estimate<Scalar, n>& prior,
    const StepContext<Scalar, DynamicsTraits<D>::controls>& at = no_context<Scalar, D>()) {
  return predict(rule, d, detail::ProcessNoise<Scalar, D>(d), prior, at);
}

/// Corrects an estimate with a measurement of the same instant: x⁺ = x̄ + K (y - m(x̄)), P⁺ = N - K E N.
/// `at`: the time of the sample. Refuses y, R, gate or a sensor model that is not valid, a singular S, and
/// a P⁺ that has lost a variance to rounding (covariance_lost: where P is 1/ε times R and more).
template <OnePassRule Rule, typename S, typename Scalar, int n, int controls = 0>
[[nodiscard]] StepResult<Scalar, n, measurements_of<S>> update(const Rule& rule, const S& s,
                                                               const Estimate<Scalar, n>& prior,
                                                               const Vector<Scalar, measurements_of<S>>& y,
                                                               const StepContext<Scalar, controls>& at = {},
                                                               const Gate& gate = {}) {
  static_assert(detail::require_sensor<S>() &&
                detail::require_linear_if_kalman<Rule, SensorTraits<S>::linear>());
  StepResult<Scalar, n, measurements_of<S>> out;
  out.report.status = detail::check_context(at);
  if (out.report.status == Status::ok)
    detail::update_into(rule, s, prior.x, prior.P, y, at, gate, out.report, out.estimate.x, out.estimate.P);
  if (usable(out.report.status) && !all_finite(prior.x)) out.report.status = Status::invalid_state;
  if (!usable(out.report.status)) out.estimate = prior;
  return out;
}

/// step() with the process noise kept by the caller; x and P are touched on refusal too.
template <OnePassRule Rule, typename D, typename S, typename Scalar, int n, int p, typename At>
JML_INLINE inline void step_into(const Rule& rule, const D& d,
                                             const detail::ProcessNoise<Scalar, D>& process_noise, const S& s,
                                             const Estimate<Scalar, n>& prior, const Vector<Scalar, p>& y,
                                             const At& at, const Gate& gate, StepReport<Scalar, n, p>& report,
                                             Vector<Scalar, n>& x, Matrix<Scalar, n, n>& P) {
  static_assert(detail::require_discrete<D>() && detail::require_sensor<S>());
  static_assert(detail::require_linear_if_kalman<Rule, DynamicsTraits<D>::linear>() &&
                detail::require_linear_if_kalman<Rule, SensorTraits<S>::linear>());
  static_assert(states_of<D> == n, "jml: the estimate has not as many states as the dynamics");
  Vector<Scalar, n> prediction;
  Matrix<Scalar, n, n> N;
  report.status = detail::predict_into(rule, d, process_noise, prior, at, prediction, N);
  if (report.status != Status::ok) return;
  detail::update_into(rule, s, prediction, N, y, detail::at_sample(at), gate, report, x, P);
  if (report.status == Status::invalid_covariance || report.status == Status::invalid_state)
    report.status = detail::diagnose(prior, prediction, N);
}

/// One whole step, eq. (14), (16) or (17): predict over at.dt, then correct with y of its end.
template <OnePassRule Rule, typename D, typename S, typename Scalar, int n>
[[nodiscard]] StepResult<Scalar, n, measurements_of<S>> step(
    const Rule& rule, const D& d, const S& s, const Estimate<Scalar, n>& prior,
    const Vector<Scalar, measurements_of<S>>& y,
    const StepContext<Scalar, DynamicsTraits<D>::controls>& at = no_context<Scalar, D>(), const Gate& gate = {}) {
  StepResult<Scalar, n, measurements_of<S>> out;
  step_into(rule, d, detail::ProcessNoise<Scalar, D>(d), s, prior, y, at, gate, out.report, out.estimate.x,
            out.estimate.P);
  if (usable(out.report.status) && !all_finite(prior.x))
    out.report.status = Status::invalid_state;  // f may not have looked at it
  if (!usable(out.report.status)) out.estimate = prior;
  return out;
}

}  // namespace jml
