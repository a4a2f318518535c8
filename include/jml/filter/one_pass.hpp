// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A rule of Table 1 as a method: eqs. (7), (14), (16), (17) in one pass, with every refusal named.
#pragma once

#include <jml/filter/filter.hpp>
#include <jml/filter/method.hpp>
#include <jml/riccati/difference.hpp>

namespace jml {

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

namespace detail {

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
template <typename Rule, typename S, typename Scalar, int n, int p, typename At,
          typename Observer = Unobserved>
JML_INLINE inline void update_into(const Rule& rule, const S& s, const Vector<Scalar, n>& prediction,
                                   const Matrix<Scalar, n, n>& N, const Vector<Scalar, p>& y, const At& at,
                                   const Gate& gate, StepReport<Scalar, n, p>& report, Vector<Scalar, n>& x,
                                   Matrix<Scalar, n, n>& P, const Observer& observer = {}) {
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
  if constexpr (same_slot<Rule::D, Rule::E>) {
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
  observer.correction(prediction, slot_d, R, innovation);
  kernel::add_product<1>(prediction, gain, innovation, x);  // x⁺ = x̄ + K (y - m(x̄))
  if (!(is_valid<Rule::symmetric>(N, P) && all_finite(x)))
    answer(diagnose(prediction, N, y, slot_d, report, true));
}

template <typename Rule, typename Model, typename Scalar, int n, typename At, typename Observer = Unobserved>
[[nodiscard]] Status one_pass_predict(const Rule& rule, const Model& model, const Estimate<Scalar, n>& prior,
                                      const At& at, Estimate<Scalar, n>& next,
                                      const Observer& observer = {}) {
  const Status status = predict_into(rule, model.dynamics, model.noise, prior, at, next.x, next.P, observer);
  if (status == Status::ok &&
      !(all_finite(next.x) && all_finite(prior.x) && is_valid<Rule::symmetric>(next.P)))
    return diagnose(prior, next.x, next.P);
  return status;
}

template <typename Rule, typename Scalar, int n, typename Sample, typename Observer = Unobserved>
void one_pass_correct(const Rule& rule, const Estimate<Scalar, n>& prior, const Sample& sample,
                      Estimate<Scalar, n>& next, StepReport<Scalar, n, Sample::measurements>& report,
                      const Observer& observer = {}) {
  update_into(rule, sample.sensor, prior.x, prior.P, sample.y, sample.at, sample.gate, report, next.x, next.P,
              observer);
}

/// One step by `rule`, with what an observer asks: predict over at.dt, correct with the measurement of its
/// end.
template <typename Rule, typename Model, typename Scalar, int n, typename Sample,
          typename Observer = Unobserved>
JML_INLINE inline void one_pass_step(const Rule& rule, const Model& model, const Estimate<Scalar, n>& prior,
                                     const Sample& sample, Estimate<Scalar, n>& next,
                                     StepReport<Scalar, n, Sample::measurements>& report,
                                     const Observer& observer = {}) {
  Vector<Scalar, n> prediction;
  Matrix<Scalar, n, n> N;
  report.status = predict_into(rule, model.dynamics, model.noise, prior, sample.at, prediction, N, observer);
  if (report.status != Status::ok) return;
  const auto update = [&](Vector<Scalar, n>& x, Matrix<Scalar, n, n>& P) JML_INLINE {
    update_into(rule, sample.sensor, prediction, N, sample.y, end_of(sample.at), sample.gate, report, x, P,
                observer);
  };
  if constexpr (n <= 3) {  // apart: in one object with P, whose address a rare check takes, x lives in memory
    Vector<Scalar, n> x;
    Matrix<Scalar, n, n> P;
    kernel::assign(x, prior.x);
    kernel::assign(P, prior.P);
    update(x, P);
    if (usable(report.status)) {
      kernel::assign(next.x, x);
      kernel::assign(next.P, P);
    }
  } else {
    update(next.x, next.P);
  }
  if (report.status == Status::invalid_covariance || report.status == Status::invalid_state)
    report.status = diagnose(prior, prediction, N);
}

}  // namespace detail

/// The method of a one-pass rule: Kalman, Ekf, Sddre, Jml, or one of your own.
///
/// predict: x̄ = f(x̂) + G w̄, N = A P Bᵀ + G Q Gᵀ. Refuses a prior or a model that is not finite, a varying Q
/// that is no covariance, an N with a negative variance (symmetric rules).
/// correct: x⁺ = x̄ + K (y - m(x̄)), P⁺ = N - K E N. Refuses y, R, gate or a sensor model that is not valid, a
/// singular S, and a P⁺ that has lost a variance to rounding (covariance_lost: where P is 1/ε times R and
/// more). That the prior P is a covariance is trusted; start() asks it once.
template <OnePassRule Rule_>
struct OnePass : Rule_ {
  using Rule = Rule_;
  static constexpr bool optimal_on_linear = true;
  template <typename Scalar, typename D>
  using Belief = Estimate<Scalar, states_of<D>>;

  constexpr OnePass() = default;
  constexpr OnePass(const Rule& rule) : Rule(rule) {}  // NOLINT(google-explicit-constructor): the same thing

  template <typename D>
  static consteval bool accepts() {
    return detail::require_discrete<D>() &&
           detail::require_linear_if_kalman<Rule, DynamicsTraits<D>::linear>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return detail::require_sensor<S>() && detail::require_linear_if_kalman<Rule, SensorTraits<S>::linear>();
  }

  /// P: symmetric positive semidefinite; of a nonsymmetric rule, whose later P are no covariances, its
  /// symmetric part. Zero means x is known exactly.
  template <typename Model, typename Scalar, int m, int n>
  [[nodiscard]] Status start(const Model& model, const Estimate<Scalar, m>& given,
                             Estimate<Scalar, n>& belief) const {
    static_assert(m == n, "jml: the estimate has not as many states as the dynamics");
    belief = given;
    const Status status = check_estimate(rule(), given);
    return status == Status::ok ? model.status() : status;
  }

  template <typename Model, typename Scalar, int n, typename At>
  [[nodiscard]] Status predict(const Model& model, const Estimate<Scalar, n>& prior, const At& at,
                               Estimate<Scalar, n>& next) const {
    return detail::one_pass_predict(rule(), model, prior, at, next);
  }

  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  void correct(const Model&, const Estimate<Scalar, n>& prior, const Sample& sample,
               Estimate<Scalar, n>& next, Report& report) const {
    detail::one_pass_correct(rule(), prior, sample, next, report);
  }

  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  JML_INLINE void step(const Model& model, const Estimate<Scalar, n>& prior, const Sample& sample,
                       Estimate<Scalar, n>& next, Report& report) const {
    detail::one_pass_step(rule(), model, prior, sample, next, report);
  }

 private:
  JML_INLINE const Rule& rule() const { return *this; }
};

template <OnePassRule Rule>
struct MethodOf<Rule> {
  using type = OnePass<Rule>;
};

}  // namespace jml
