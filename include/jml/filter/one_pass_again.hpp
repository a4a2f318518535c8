// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What follows where a step of a one-pass rule gave no answer: the reason, or, where only digits were
/// missing, the step done over again in twice as many. Out of the way of the usual one.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/dense_rounding.hpp>
#include <jml/filter/filter_core.hpp>
#include <jml/filter/general_step.hpp>
#include <jml/filter/known_states.hpp>
#include <jml/filter/step_in_two.hpp>
#include <jml/filter/watched.hpp>

namespace jml::detail {

/// Why a prediction from `prior` to x, N is not one, of inputs that gave x.
template <typename Rule, typename Model, typename Scalar, int n, typename At>
JML_RARE Status diagnose_prediction(const Rule& rule, const Model& model, const Estimate<Scalar, n>& prior,
                                    const Vector<Scalar, n>& x, const Matrix<Scalar, n, n>& N, const At& at) {
  if (!all_finite(prior.x)) return Status::invalid_state;
  if (!all_finite(prior.P)) return Status::invalid_covariance;
  if (!all_finite(x)) return Status::dynamics_not_finite;
  if (all_finite(N)) return Status::covariance_lost;
  const auto finite = [&]<auto slot>() {
    const Vector<Scalar, n>& point = Rule::evaluated_at == EvaluatedAt::estimate ? prior.x : x;
    return all_finite(dynamics_slot<slot>(rule, model.dynamics, point, prior.x, at));
  };
  const bool model_finite = finite.template operator()<Rule::A>() && finite.template operator()<Rule::B>();
  return model_finite ? Status::covariance_lost : Status::dynamics_not_finite;
}

/// How fine a measurement is for the digits of x.
enum class Fineness : std::uint8_t {
  coarse,    ///< an ε of H x is less than 1e-7 of its deviation
  fine,      ///< more, but moves no state by more than 8 ε of itself
  too_fine,  ///< more: x has to have more digits
};
/// Of a linear m; a difference from a nonlinear one is what its sensor says it is.
template <typename Rule, typename Sample, typename At, typename Scalar, int n, typename Report>
[[nodiscard]] Fineness fineness(const Rule& rule, const Sample& sample, const At& at,
                                const Vector<Scalar, n>& prior, const ExtendedStep<Scalar>& two,
                                const Report& report) {
  constexpr int p = Sample::measurements;
  using S = std::remove_cvref_t<decltype(sample.sensor)>;
  if constexpr (SensorTraits<S>::linear) {
    const Vector<Scalar, p> R = conditional_variances(noise_covariance(sample.sensor, prior, at));
    const Matrix<Scalar, p, n> H = sensor_slot<Rule::D>(rule, sample.sensor, prior, prior, at);
    const Vector<Scalar, p> terms = innovation_sizes(H, prior, sample.y);
    Fineness out = Fineness::coarse;
    for (int j = 0; j < n; ++j) {
      Scalar moved = 0;
      for (int i = 0; i < p; ++i) {
        if (terms(i) <= finest_innovation<Scalar> * R(i)) continue;
        moved += std::abs(report.gain(j, i)) * std::sqrt(terms(i));
        out = out == Fineness::coarse ? Fineness::fine : out;
      }
      if (!(moved <= Scalar(8) * std::abs(in_two<Scalar>(two.x(j)).high))) out = Fineness::too_fine;
    }
    return out;
  } else {
    return Fineness::coarse;
  }
}

/// A prediction over `at` (where `moves`) and the correction with a sample (Unobserved: none) at `at_y`, from
/// `prior` in twice the digits; by value, so that the estimate of the usual way stays in registers. P⁺ is
/// rounded to an n×n matrix again. covariance_lost where that matrix cannot hold it: rounding could change it
/// by more than an eighth of `worst_error` in some direction, and does by more than 8e-4.
template <bool moves, typename Rule, typename Model, typename Belief, typename At, typename Sample,
          typename AtY, typename Report>
[[nodiscard]] JML_RARE Belief plain_in_two(const Rule& rule, const Model& model, const Belief& prior,
                                           const At& at, const Sample& sample, const AtY& at_y,
                                           Report& report) {
  using Scalar = typename Belief::Scalar;
  constexpr int n = Belief::states, q = disturbances_in<moves, Model>(), p = measurements_in<Sample>();
  ExtendedMemory<Scalar, n, q, p> memory;
  ExtendedStep<Scalar> two(memory);
  report.redone = true;
  constexpr bool affine = !moves || is_affine<Model>();
  bool fine = false, exact = affine && is_exact(prior);
  if constexpr (requires { prior.fine; }) fine = prior.fine;
  const auto begin = [&]() -> Status {
    if (!all_finite(prior.x)) return Status::invalid_state;
    if (!all_finite(prior.P)) return Status::invalid_covariance;
    const Scalar *x_low = nullptr, *P_low = nullptr;
    if (is_extended(prior)) {
      if constexpr (requires { prior.P_low; }) {
        x_low = prior.x_low.data();
        P_low = prior.low_of_P();
      }
    }
    if (!two.load(prior.P.data(), P_low)) return Status::covariance_lost;  // indefinite already
    two.load_state(prior.x.data(), x_low);
    if constexpr (moves) return predict_in_two(rule, model, prior.x, at, two);
    return Status::ok;
  };
  report.status = begin();
  if (report.status != Status::ok) return prior;
  if constexpr (p > 0) {
    RowsFound<Scalar, p> rows;
    report.gate = Verdict::off;
    correct_in_two<false>(rule, sample, at_y, two, report, rows);
    if (report.status == Status::ok && report.gate == Verdict::rejected) report.status = begin();
    if (report.status != Status::ok) return prior;
    const Fineness found = fineness(rule, sample, at_y, prior.x, two, report);
    if (found == Fineness::too_fine && !exact) return report.status = Status::accuracy_not_met, prior;
    fine = fine || found != Fineness::coarse;
  }
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  const Scalar now = two.magnification_of_now(), spread = now * now;
  report.rounding = epsilon * spread;
  // Where states combine exactly, a deviation is zero to the rounding of what it came from: no more than 64 ε
  // of what is left.
  const bool combines = two.combines();
  const Scalar most = (combines ? Scalar(64) * epsilon : plain_error<Scalar>) / extended_epsilon<Scalar>;
  if (!two.finite() || two.underflows() || !(two.magnification() <= most))
    return report.status = Status::covariance_lost, prior;
  Belief next = prior;
  bool extended = fine || combines || report.rounding > plain_error<Scalar> / Scalar(100);
  if (!(report.rounding <= worst_error<Scalar> / Scalar(8))) {  // it could be lost: is it?
    report.rounding = dense_rounding<n>(two);
    const bool kept = !combines && extended_epsilon<Scalar> * spread <= plain_error<Scalar>;
    if (!kept || !(report.rounding <= Scalar(8e-4))) return report.status = Status::covariance_lost, prior;
  }
  for (int i = 0; i < n; ++i) {
    next.x(i) = in_two<Scalar>(two.x(i)).high;
    for (int j = 0; j <= i; ++j) {
      next.P(i, j) = next.P(j, i) = in_two<Scalar>(two.P(i, j)).high;
    }
  }
  if (!all_finite(next.P)) return report.status = Status::covariance_lost, prior;  // an overflow
  for (int i = 0; i < n && affine; ++i)
    extended = extended || low_digits_tell(in_two<Scalar>(two.x(i)).low, next.P(i, i)) ||
               (next.P(i, i) > Scalar(0) && low_digits_tell(epsilon * next.x(i), next.P(i, i)));
  if constexpr (requires { next.P_low; }) {
    next.extended = extended;
    next.exact = extended && exact;
    next.fine = fine;
    for (int i = 0; i < n && extended; ++i) {
      next.x_low(i) = in_two<Scalar>(two.x(i)).low;
      for (int j = 0; j <= i; ++j) next.P_low(i, j) = next.P_low(j, i) = in_two<Scalar>(two.P(i, j)).low;
    }
  }
  note_spread(next, spread);
  return next;
}

/// The same step of a nonsymmetric rule in twice the digits, from a prediction x̄, N, or from `prior` over
/// `at`.
template <bool moves, typename Rule, typename Model, typename Belief, typename At, typename Sample,
          typename AtY, typename Report>
[[nodiscard]] JML_RARE Belief general_in_two(const Rule& rule, const Model& model, const Belief& prior,
                                             const At& at, const Sample& sample, const AtY& at_y,
                                             Report& report) {
  using Scalar = typename Belief::Scalar;
  constexpr int n = Belief::states, p = Sample::measurements;
  GeneralMemory<Scalar, n, p> memory;
  GeneralStep<Scalar> two(memory);
  two.load(prior.P.data());
  Vector<Scalar, n> x = prior.x;
  report.redone = true;
  const auto answer = [&](Status status) {
    report.status = status;
    return prior;
  };
  if constexpr (moves) {
    const auto& d = model.dynamics;
    x = predicted_state(d, prior.x, at);
    const Vector<Scalar, n>& point = Rule::evaluated_at == EvaluatedAt::estimate ? prior.x : x;
    const Matrix<Scalar, n, n> A = dynamics_slot<Rule::A>(rule, d, point, prior.x, at);
    const Matrix<Scalar, n, n> B = dynamics_slot<Rule::B>(rule, d, point, prior.x, at);
    Matrix<Scalar, n, n> C = kernel::zeros<Matrix<Scalar, n, n>>();
    if (!model.noise.with(d, prior.x, at, [&C](const auto& noise) { C = noise; }))
      return answer(Status::invalid_disturbance_covariance);
    two.move(A.data(), B.data(), C.data());
  }
  Matrix<Scalar, n, n> N;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) N(i, j) = two.N(i, j);
  }
  if (!all_finite(x) || !all_finite(N)) {
    if constexpr (moves)
      return answer(diagnose_prediction(rule, model, prior, x, N, at));
    else
      return answer(all_finite(x) ? Status::invalid_covariance : Status::invalid_state);
  }
  const auto& s = sample.sensor;
  const Matrix<Scalar, p, p> R = noise_covariance(s, x, at_y);
  const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(rule, s, x, x, at_y);
  const Matrix<Scalar, p, n> slot_e = sensor_slot<Rule::E>(rule, s, x, x, at_y);
  report.innovation = measurement_residual(s, sample.y, measurement(s, x, at_y));
  if (!is_noise_covariance(R)) return answer(Status::invalid_noise_covariance);
  if (!all_finite(sample.y)) return answer(Status::invalid_measurement);
  if (!all_finite(report.innovation) || !all_finite(slot_d) || !all_finite(slot_e))
    return answer(Status::sensor_not_finite);
  if (!sample.gate.valid()) return answer(Status::invalid_option);
  if (!two.correct(slot_d.data(), slot_e.data(), R.data(), x.data(), report.innovation.data()))
    return answer(Status::singular_innovation);
  Belief next = prior;
  for (int i = 0; i < n; ++i) {
    next.x(i) = two.x(i);
    for (int j = 0; j < n; ++j) next.P(i, j) = two.P(i, j);
    for (int l = 0; l < p; ++l) report.gain(i, l) = two.K(i, l);
  }
  report.innovation_matrix = R + slot_e * N * kernel::transposed(slot_d);  // S = R + E N Dᵀ
  if (!judge(sample.gate, report)) return answer(Status::innovation_indefinite);
  if (report.gate == Verdict::rejected) {
    next.x = x;
    next.P = N;
  }
  report.rounding = extended_epsilon<Scalar> * largest_loss(N, next.P);
  const bool held = report.rounding <= worst_error<Scalar>;
  if (!held || !all_finite(next.P) || !all_finite(next.x)) return answer(Status::covariance_lost);
  report.status = Status::ok;
  return next;
}

/// After a step that failed (where `moves`; else a correction): says why in the report, or, where only digits
/// were missing, answers the step done in twice as many.
template <bool moves, typename Rule, typename Model, typename Belief, typename At, typename Sample,
          typename AtY, typename Report>
[[nodiscard]] JML_INLINE inline Belief again(const Rule& rule, const Model& model, const Belief& prior,
                                             const At& at, const Sample& sample, const AtY& at_y,
                                             Report& report) {
  if constexpr (Rule::symmetric)
    return plain_in_two<moves>(rule, model, prior, at, sample, at_y, report);
  else
    return general_in_two<moves>(rule, model, prior, at, sample, at_y, report);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
