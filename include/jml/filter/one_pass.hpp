// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A rule of Table 1 as a method: eqs. (7), (14), (16), (17) in one pass, with every refusal named.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass_again.hpp>
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

/// Where a rule's P is a covariance, the sizes of what N came from; else nothing.
template <typename Rule, typename Scalar, int n>
using SizesOf = std::conditional_t<Rule::symmetric, Vector<Scalar, n>, NoSizes>;

/// update() of x̄, N into the caller's x and P, which are touched on refusal too. A measurement that the gate
/// rejects leaves the prediction in them. `sizes`: of what N came from, see predict_into(); `known`: see
/// has_digits(). False where the answer is none, or its digits do not suffice: again() says why, or does it
/// over. (Nothing here is handed to a function out of line, but by value, so that all of it lives in
/// registers.)
template <typename Rule, typename S, typename Scalar, int n, int p, typename Sizes, typename At,
          typename Known, typename Observer = Unobserved>
[[nodiscard]] JML_INLINE inline bool update_into(const Rule& rule, const S& s,
                                                 const Vector<Scalar, n>& prediction,
                                                 const Matrix<Scalar, n, n>& N, const Sizes& sizes,
                                                 const Vector<Scalar, p>& y, const At& at, const Gate& gate,
                                                 StepReport<Scalar, n, p>& report, Vector<Scalar, n>& x,
                                                 Matrix<Scalar, n, n>& P, const Known& known,
                                                 const Observer& observer = {}) {
  const Matrix<Scalar, p, p> R = noise_covariance(s, prediction, at);
  if (!is_noise_covariance(R)) return false;
  // Locals, stored into the report when done: a value just stored in pieces is slow to load back as a whole.
  const Vector<Scalar, p> innovation = measurement_residual(s, y, measurement(s, prediction, at));
  const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(rule, s, prediction, prediction, at);
  Matrix<Scalar, p, p> S_matrix;
  Matrix<Scalar, n, p> gain;
  Scalar condition = 0;
  bool regular = false;
  if constexpr (same_slot<Rule::D, Rule::E>) {
    regular = correct_riccati<Rule::symmetric>(N, slot_d, slot_d, R, S_matrix, gain, P, condition);
  } else {
    const Matrix<Scalar, p, n> slot_e = sensor_slot<Rule::E>(rule, s, prediction, prediction, at);
    regular = correct_riccati<Rule::symmetric>(N, slot_d, slot_e, R, S_matrix, gain, P, condition);
  }
  kernel::assign(report.innovation, innovation);
  kernel::assign(report.innovation_matrix, S_matrix);
  if (!regular) return false;
  kernel::assign(report.gain, gain);
  if (!gate.off()) {
    const bool finite =
        all_finite(S_matrix) && all_finite(innovation) && all_finite(N) && all_finite(prediction);
    if (!gate.valid() || !finite || !judge(gate, report)) return false;
    if (report.gate == Verdict::rejected) {
      kernel::assign(x, prediction);
      kernel::assign(P, N);
      return has_digits<Rule>(N, N, sizes, Scalar(1), report.rounding, known);
    }
  }
  observer.correction(prediction, slot_d, R, innovation);
  kernel::add_product<1>(prediction, gain, innovation, x);  // x⁺ = x̄ + K (y - m(x̄))
  bool fine = true;
  if constexpr (Rule::symmetric && SensorTraits<S>::linear) {  // the rounding of H x̄ against √R
    const Vector<Scalar, p> terms = innovation_sizes(slot_d, prediction, y);
    for (int i = 0; i < p; ++i) fine &= terms(i) <= finest_innovation<Scalar> * R(i, i);
    if (fine && !is_diagonal(R)) {
      const Vector<Scalar, p> alone = conditional_variances<Scalar, p>(R);
      for (int i = 0; i < p; ++i) fine &= terms(i) <= finest_innovation<Scalar> * alone(i);
    }
  }
  const bool held = has_digits<Rule>(P, N, sizes, condition, report.rounding, known);
  if constexpr (Rule::symmetric) kernel::mirror(P);
  return held && fine && all_finite(x);
}

template <typename Rule, typename Model, typename Belief, typename At, typename Observer = Unobserved>
[[nodiscard]] Status one_pass_predict(const Rule& rule, const Model& model, const Belief& prior, const At& at,
                                      Belief& next, const Observer& observer = {}) {
  using Scalar = typename Belief::Scalar;
  const auto in_two = [&] {
    StepReport<Scalar, Belief::states, 1> report;
    commit(next, plain_in_two<true>(rule, model, prior, at, Unobserved{}, at, report));
    return report.status;
  };
  if constexpr (Rule::symmetric) {
    if (is_extended(prior)) return in_two();
  }
  Scalar rounding = 0;
  SizesOf<Rule, Scalar, Belief::states> sizes;
  const Status status =
      predict_into(rule, model.dynamics, model.noise, prior, at, next.x, next.P, sizes, observer);
  if (status != Status::ok) return status;
  const bool held =
      has_digits<Rule>(next.P, next.P, sizes, Scalar(1), rounding, KnownMove{rule, model, prior, at});
  if (held && all_finite(next.x) && all_finite(prior.x)) return Status::ok;
  if constexpr (Rule::symmetric)
    return in_two();
  else
    return diagnose_prediction(rule, model, prior, next.x, next.P, at);
}

template <typename Rule, typename Belief, typename Sample, typename Report, typename Observer = Unobserved>
void one_pass_correct(const Rule& rule, const Belief& prior, const Sample& sample, Belief& next,
                      Report& report, const Observer& observer = {}) {
  using Scalar = typename Belief::Scalar;
  const Vector<Scalar, Belief::states> sizes = kernel::diagonal(prior.P);
  const bool done =
      !is_extended(prior) && update_into(rule, sample.sensor, prior.x, prior.P, sizes, sample.y, sample.at,
                                         sample.gate, report, next.x, next.P, KnownStay{}, observer);
  if (!done) commit(next, again<false>(rule, Unobserved{}, prior, sample.at, sample, sample.at, report));
}

/// One step by `rule` in the digits of Scalar, with what an observer asks: predict over at.dt, correct with
/// the measurement of its end. False where the answer is none, or needs more digits: one_pass_step() then.
template <typename Rule, typename Model, typename Belief, typename Sample, typename Report,
          typename Observer = Unobserved>
[[nodiscard]] JML_INLINE inline bool one_pass_attempt(const Rule& rule, const Model& model,
                                                      const Belief& prior, const Sample& sample, Belief& next,
                                                      Report& report, const Observer& observer = {}) {
  using Scalar = typename Belief::Scalar;
  constexpr int n = Belief::states;
  if (is_extended(prior)) return false;
  Vector<Scalar, n> prediction;
  Matrix<Scalar, n, n> N;
  SizesOf<Rule, Scalar, n> sizes;
  if (predict_into(rule, model.dynamics, model.noise, prior, sample.at, prediction, N, sizes, observer) !=
      Status::ok)
    return false;
  const KnownMove known{rule, model, prior, sample.at};
  bool done = false;
  if constexpr (n <= 3) {  // apart from the belief, in registers
    Vector<Scalar, n> x;
    Matrix<Scalar, n, n> P;
    kernel::assign(x, prior.x);
    kernel::assign(P, prior.P);
    done = update_into(rule, sample.sensor, prediction, N, sizes, sample.y, end_of(sample.at), sample.gate,
                       report, x, P, known, observer);
    kernel::assign(next.x, x);
    kernel::assign(next.P, P);
  } else {
    done = update_into(rule, sample.sensor, prediction, N, sizes, sample.y, end_of(sample.at), sample.gate,
                       report, next.x, next.P, known, observer);
  }
  return done;
}

/// What follows where it was not enough.
template <typename Rule, typename Model, typename Belief, typename Sample, typename Report>
JML_INLINE inline void one_pass_again(const Rule& rule, const Model& model, const Belief& prior,
                                      const Sample& sample, Belief& next, Report& report) {
  commit(next, again<true>(rule, model, prior, sample.at, sample, end_of(sample.at), report));
}

/// The same, however many digits it takes.
template <typename Rule, typename Model, typename Belief, typename Sample, typename Report,
          typename Observer = Unobserved>
void one_pass_step(const Rule& rule, const Model& model, const Belief& prior, const Sample& sample,
                   Belief& next, Report& report, const Observer& observer = {}) {
  const Report fresh = report;
  if (one_pass_attempt(rule, model, prior, sample, next, report, observer)) return;
  report = fresh;
  one_pass_again(rule, model, prior, sample, next, report);
}

}  // namespace detail

/// The method of a one-pass rule: Kalman, Ekf, Sddre, Jml, or one of your own.
///
/// predict: x̄ = f(x̂) + G w̄, N = A P Bᵀ + G Q Gᵀ. Refused: invalid_state and invalid_covariance (a prior that
/// is not finite), dynamics_not_finite, invalid_disturbance_covariance (of a varying Q or G).
/// correct: x⁺ = x̄ + K (y - m(x̄)), P⁺ = N - K E N. Refused: invalid_measurement, invalid_noise_covariance,
/// invalid_option (of the gate), sensor_not_finite, singular_innovation, innovation_indefinite.
///
/// Of a symmetric rule a step whose digits do not suffice is done over again in twice as many (redone), and
/// the belief keeps them while it needs them. Of a linear model P is right to 1e-3 in every direction, and x
/// to 1e-6 of a deviation and 64 ε of the largest state; covariance_lost where no n×n matrix of Scalar holds
/// such a P, accuracy_not_met where x never had the digits that a measurement asks for. In float P to 1e-3
/// and x to 2e-4 deviations, as found. Of another rule: report.rounding, and covariance_lost where 1e-3 of an
/// entry is lost even so. That the prior P is a covariance is trusted; start() asks it once.
template <OnePassRule Rule_>
struct OnePass : Rule_ {
  /// What filter/method.hpp asks of a method.
  /// @{
  using Rule = Rule_;
  static constexpr bool optimal_on_linear = true;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = std::conditional_t<Rule::symmetric, WatchedEstimate<Scalar, states_of<D>>,
                                    Estimate<Scalar, states_of<D>>>;

  constexpr OnePass() = default;
  /// A rule stands for its method.
  constexpr OnePass(const Rule& rule) : Rule(rule) {}  // NOLINT(google-explicit-constructor): the same thing

  template <typename D>
  static consteval bool accepts() {
    return detail::require_discrete<D>() && detail::require_linear_if_kalman<Rule, DynamicsTraits<D>>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return detail::require_sensor<S>() && detail::require_linear_if_kalman<Rule, SensorTraits<S>>();
  }

  /// P: symmetric positive semidefinite; of a nonsymmetric rule, whose later P are no covariances, its
  /// symmetric part. Zero means x is known exactly.
  template <typename Model, typename Scalar, int m, typename Belief>
  [[nodiscard]] Status start(const Model& model, const Estimate<Scalar, m>& given, Belief& belief) const {
    static_assert(m == Belief::states, "jml: the estimate has not as many states as the dynamics");
    belief = Belief(given);
    if constexpr (requires { belief.exact; }) {
      belief.exact = true;
      kernel::set_zero(belief.x_low);  // what it lacked before
      belief.extended = detail::is_affine<Model>() && detail::better_known_than_rounding(given.x, given.P);
    }
    const Status status = check_estimate(rule(), given);
    return status == Status::ok ? model.status() : status;
  }

  template <typename Model, typename Belief, typename At>
  [[nodiscard]] Status predict(const Model& model, const Belief& prior, const At& at, Belief& next) const {
    return detail::one_pass_predict(rule(), model, prior, at, next);
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(const Model&, const Belief& prior, const Sample& sample, Belief& next, Report& report) const {
    detail::one_pass_correct(rule(), prior, sample, next, report);
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
            Report& report) const {
    detail::one_pass_step(rule(), model, prior, sample, next, report);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  [[nodiscard]] JML_INLINE bool attempt(const Model& model, const Belief& prior, const Sample& sample,
                                        Belief& next, Report& report) const {
    return detail::one_pass_attempt(rule(), model, prior, sample, next, report);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  void again(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
             Report& report) const {
    detail::one_pass_again(rule(), model, prior, sample, next, report);
  }
  /// @}

 private:
  JML_INLINE const Rule& rule() const { return *this; }
};

template <typename Rule>
struct PartsOf<OnePass<Rule>> : PartsOfBase<OnePass<Rule>, Rule> {};

template <OnePassRule Rule>
struct MethodOf<Rule> {
  using type = OnePass<Rule>;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
