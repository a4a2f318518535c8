// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The exact step: iterated JML (Rusnak 2015, eqs. (9), (13)) and the measurement-iterated EKF.
///
/// The root z = (x_{i/i+1}, x̂_{i+1}) of the two ground-truth lines (iterated/joint_step.hpp) is sought from
/// (x̂_i, f(x̂_i)) by a bounded iteration; where it fails, the fallback solver takes over: the whitened least-squares
/// problem (11), then damped Newton on the lines with the true, nonsymmetric P. N, P and K are formed once,
/// at the root.
#pragma once

#include <jml/iterated/joint_solve.hpp>
#include <jml/solve/levenberg_marquardt.hpp>

namespace jml {

/// A rule whose step is implicit. Inner: the one-pass rule that supplies the slots; Fallback: the least-squares
/// solver below.
template <typename Inner_, typename Fallback_ = LevenbergMarquardt>
struct Iterated {
  using Inner = Inner_;
  using Fallback = Fallback_;
  static constexpr bool symmetric = Inner::symmetric;
  [[no_unique_address]] Inner inner{};
  IterationOptions options{};
  [[no_unique_address]] Fallback fallback{};
};

/// The exact recursive-iterative JML estimator, eq. (9).
template <typename Reference = AboutOrigin, typename Fallback = LevenbergMarquardt>
struct IteratedJml : Iterated<Jml<Reference>, Fallback> {
  IteratedJml()
    requires(std::is_empty_v<Reference>)
  = default;
  explicit IteratedJml(const IterationOptions& iteration)
    requires(std::is_empty_v<Reference>)
      : Iterated<Jml<Reference>, Fallback>{{}, iteration, {}} {}
  explicit IteratedJml(const Reference& reference, const IterationOptions& iteration = {},
                       const Fallback& solver = {})
      : Iterated<Jml<Reference>, Fallback>{Jml<Reference>(reference), iteration, solver} {}
};
IteratedJml(const IterationOptions&) -> IteratedJml<>;

/// The measurement-iterated EKF: predict once, then iterate the correction alone. The paper's comparison.
struct Iekf : Iterated<Ekf<>> {
  Iekf() = default;
  explicit Iekf(const IterationOptions& iteration) : Iterated<Ekf<>>{{}, iteration, {}} {}
  static constexpr bool measurement_only = true;
};

template <typename Rule>
concept IteratedRule = requires {
  typename Rule::Inner;
  typename Rule::Fallback;
};

namespace detail {

/// The implicit step of `d` and `s` from `prior` into `report`, `x` and `P`, which are touched on refusal
/// too.
template <typename Rule, typename D, typename S, typename Scalar, int n, int p, typename At,
          typename SensorAt>
void joint_step_into(const Rule& rule, const D& d, const ProcessNoise<Scalar, D>& process_noise, const S& s,
                     const Estimate<Scalar, n>& prior, const Vector<Scalar, p>& y, const At& at,
                     const SensorAt& at_y, const Gate& gate, StepReport<Scalar, n, p>& report,
                     Vector<Scalar, n>& x, Matrix<Scalar, n, n>& P) {
  using Inner = typename Rule::Inner;
  const auto answer = [&report](Status status) { report.status = status; };
  if (!valid(rule.options) || !gate.valid()) return answer(Status::invalid_option);
  if (const Status status = check_context(at); status != Status::ok) return answer(status);
  if (!all_finite(y)) return answer(Status::invalid_measurement);
  if (!all_finite(prior.x)) return answer(Status::invalid_state);
  const Vector<Scalar, n> prediction = predicted_state(d, prior.x, at);
  if (!all_finite(prediction)) return answer(Status::dynamics_not_finite);
  const Matrix<Scalar, p, p> R = noise_covariance(s, prediction, at_y);
  if (!is_noise_covariance(R)) return answer(Status::invalid_noise_covariance);

  const bool noise_valid = process_noise.with(d, prior.x, at, [&](const Matrix<Scalar, n, n>& noise) {
    using Step = JointStep<D, S, Scalar, n, At, SensorAt>;
    Step step{d, s, prior, noise, y, at, at_y, R, {}, kernel::zeros<Vector<Scalar, n>>(), {}, {}};
    if (!step.R_factor.factor(R)) return answer(Status::invalid_noise_covariance);
    if constexpr (has_disturbance_mean<D, Vector<Scalar, n>, At>())
      step.mean_effect = prediction - dynamics(d, prior.x, at);
    step.set_scale(prediction);
    Root<Step> start;

    // The prediction's innovation, its matrix, and the gate on it.
    Step::join(prior.x, prediction, start.z);
    if (!step.visit(start.z, start.visit)) {
      if (!all_finite(prior.P)) return answer(Status::invalid_covariance);
      return answer(all_finite(start.visit.f_x) ? Status::sensor_not_finite : Status::dynamics_not_finite);
    }
    kernel::assign(report.innovation, start.visit.innovation);
    {
      Matrix<Scalar, n, p> Nm;
      kernel::add_product<1>(start.visit.Cm, start.visit.f_x, start.visit.Pfm, Nm);
      kernel::add_product<1>(R, start.visit.m_x, Nm, report.innovation_matrix);
    }
    if (!judge(gate, report)) return answer(Status::innovation_indefinite);
    if (report.gate == Verdict::rejected) {
      report.status = predict_into(rule.inner, d, process_noise, prior, at, x, P);
      if (report.status == Status::ok && !(all_finite(x) && is_valid<Inner::symmetric>(P)))
        report.status = diagnose(prior, x, P);
      return;
    }

    const bool symmetric_prior = Inner::symmetric || is_symmetric(prior.P);
    const Root<Step> root = solve_joint_step(rule, step, prediction, symmetric_prior, start);
    report.solver = root.solver;
    report.iterations = root.iterations;
    report.residual = root.residual;
    report.cost = root.cost;
    if (!usable(root.status)) return answer(root.status);

    // N, P and K once, with the slots at the root.
    const Vector<Scalar, n> x_s = Step::smoothed(root.at), x_1 = Step::next(root.at);
    const auto slot = [&]<Slot which>() -> Matrix<Scalar, n, n> {
      if constexpr (which == Slot::jacobian)
        return root.visit.f_x;
      else
        return dynamics_slot<which>(rule.inner, d, x_s, prior.x, at);
    };
    const auto sensor_slot_at_root = [&]<Slot which>() -> Matrix<Scalar, p, n> {
      if constexpr (which == Slot::jacobian)
        return root.visit.m_x;
      else
        return sensor_slot<which>(rule.inner, s, x_1, prediction, at_y);
    };
    const Matrix<Scalar, n, n> A = slot.template operator()<Inner::A>();
    Matrix<Scalar, n, n> AP, N;
    kernel::product(A, prior.P, AP);
    if constexpr (Inner::symmetric)
      kernel::add_symmetric_product<1>(noise, AP, A, N);
    else
      kernel::add_product_transposed<1>(noise, AP, slot.template operator()<Inner::B>(), N);
    Matrix<Scalar, p, p> S_root;
    const bool regular = correct_riccati<Inner::symmetric>(
        N, sensor_slot_at_root.template operator()<Inner::D>(),
        sensor_slot_at_root.template operator()<Inner::E>(), R, S_root, report.gain, P);
    if (!regular) return answer(all_finite(S_root) ? Status::singular_innovation : Status::sensor_not_finite);
    kernel::assign(x, Step::next(root.z));
    kernel::assign(report.smoothed, Step::smoothed(root.z));
    if (!is_valid<Inner::symmetric>(N, P) || !all_finite(x)) return answer(Status::covariance_lost);
    report.status = root.status;
  });
  if (!noise_valid) return answer(Status::invalid_disturbance_covariance);
}

}  // namespace detail

/// A prediction has no measurement to iterate on: it is the inner rule's.
template <IteratedRule Rule, typename D, typename Scalar, int n>
[[nodiscard]] PredictResult<Scalar, n> predict(
    const Rule& rule, const D& d, const detail::ProcessNoise<Scalar, D>& process_noise,
    const Estimate<Scalar, n>& prior,
    const StepContext<Scalar, DynamicsTraits<D>::controls>& at = no_context<Scalar, D>()) {
  return predict(rule.inner, d, process_noise, prior, at);
}
template <IteratedRule Rule, typename D, typename Scalar, int n>
[[nodiscard]] PredictResult<Scalar, n> predict(
    const Rule& rule, const D& d, const Estimate<Scalar, n>& prior,
    const StepContext<Scalar, DynamicsTraits<D>::controls>& at = no_context<Scalar, D>()) {
  return predict(rule.inner, d, prior, at);
}

/// Corrects an estimate with a measurement of the same instant: the step's equations without motion.
template <IteratedRule Rule, typename S, typename Scalar, int n, int controls = 0>
[[nodiscard]] StepResult<Scalar, n, measurements_of<S>> update(const Rule& rule, const S& s,
                                                               const Estimate<Scalar, n>& prior,
                                                               const Vector<Scalar, measurements_of<S>>& y,
                                                               const StepContext<Scalar, controls>& at = {},
                                                               const Gate& gate = {}) {
  static_assert(detail::require_sensor<S>());
  StepResult<Scalar, n, measurements_of<S>> out;
  const Stay<n> stay;
  detail::joint_step_into(rule, stay, detail::ProcessNoise<Scalar, Stay<n>>(stay), s, prior, y,
                          StepContext<Scalar>{}, at, gate, out.report, out.estimate.x, out.estimate.P);
  if (!usable(out.report.status)) out.estimate = prior;
  return out;
}

/// step() with the process noise kept by the caller; x and P are touched on refusal too.
template <IteratedRule Rule, typename D, typename S, typename Scalar, int n, int p, typename At>
void step_into(const Rule& rule, const D& d, const detail::ProcessNoise<Scalar, D>& process_noise, const S& s,
               const Estimate<Scalar, n>& prior, const Vector<Scalar, p>& y, const At& at, const Gate& gate,
               StepReport<Scalar, n, p>& report, Vector<Scalar, n>& x, Matrix<Scalar, n, n>& P) {
  static_assert(detail::require_discrete<D>() && detail::require_sensor<S>());
  static_assert(states_of<D> == n, "jml: the estimate has not as many states as the dynamics");
  if constexpr (requires { Rule::measurement_only; }) {
    const auto predicted = predict(rule.inner, d, process_noise, prior, at);
    report.status = predicted.status;
    if (report.status != Status::ok) return;
    const auto result = update(rule, s, predicted.estimate, y, detail::at_sample(at), gate);
    report = result.report;
    x = result.estimate.x;
    P = result.estimate.P;
  } else {
    detail::joint_step_into(rule, d, process_noise, s, prior, y, at, detail::at_sample(at), gate, report, x,
                            P);
  }
}

/// One exact step, eq. (9): the estimate of x_i is revised together with that of x_{i+1}.
template <IteratedRule Rule, typename D, typename S, typename Scalar, int n>
[[nodiscard]] StepResult<Scalar, n, measurements_of<S>> step(
    const Rule& rule, const D& d, const S& s, const Estimate<Scalar, n>& prior,
    const Vector<Scalar, measurements_of<S>>& y,
    const StepContext<Scalar, DynamicsTraits<D>::controls>& at = no_context<Scalar, D>(), const Gate& gate = {}) {
  StepResult<Scalar, n, measurements_of<S>> out;
  step_into(rule, d, detail::ProcessNoise<Scalar, D>(d), s, prior, y, at, gate, out.report, out.estimate.x,
            out.estimate.P);
  if (!usable(out.report.status)) out.estimate = prior;
  return out;
}

}  // namespace jml
