// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The exact step: iterated JML (Rusnak 2015, eqs. (9), (13)) and the measurement-iterated EKF.
///
/// The root z = (x_{i/i+1}, x̂_{i+1}) of the two ground-truth lines (iterated/joint_step.hpp) is sought from
/// (x̂_i, f(x̂_i)) by a bounded iteration; where it fails, the fallback solver takes over: the whitened
/// least-squares problem (11), then damped Newton on the lines with the true, nonsymmetric P. N, P and K are
/// formed once, at the root.
#pragma once

#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass.hpp>
#include <jml/iterated/joint_solve.hpp>
#include <jml/solve/levenberg_marquardt.hpp>

namespace jml {

/// A rule whose step is implicit. Inner: the one-pass rule that supplies the slots; Fallback: the
/// least-squares solver below.
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

/// What an exact step reports.
template <typename Scalar, int n, int p>
struct IteratedReport : StepReport<Scalar, n, p> {
  Solver solver = Solver::none;
  int iterations = 0;  ///< sweeps or steps of all solvers together
  /// Of the two ground-truth lines over the state scale; accepted_at_limit: before the last sweep.
  Scalar residual = 0;
  Scalar cost = 0;  ///< one-step criterion (11) at the root; may be negative where sym(P) is indefinite
  /// x_{i/i+1}: the previous state, seen from here; of a correction alone x itself.
  Vector<Scalar, n> smoothed = kernel::zeros<Vector<Scalar, n>>();
};

namespace detail {

/// The implicit step of `d` and `s` from `prior` into `report`, `x` and `P`, which are touched on refusal
/// too.
template <typename Rule, typename D, typename S, typename Scalar, int n, int p, typename At,
          typename SensorAt>
void joint_step_into(const Rule& rule, const D& d, const ProcessNoise<Scalar, D>& process_noise, const S& s,
                     const Estimate<Scalar, n>& prior, const Vector<Scalar, p>& y, const At& at,
                     const SensorAt& at_y, const Gate& gate, IteratedReport<Scalar, n, p>& report,
                     Vector<Scalar, n>& x, Matrix<Scalar, n, n>& P) {
  using Inner = typename Rule::Inner;
  const auto answer = [&report](Status status) { report.status = status; };
  if (!valid(rule.options) || !gate.valid()) return answer(Status::invalid_option);
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
      kernel::add_product<1>(start.visit.Cm, start.visit.f_x, start.visit.Pfm, Nm);  // N m_xᵀ
      kernel::add_product<1>(R, start.visit.m_x, Nm, report.innovation_matrix);      // S = R + m_x N m_xᵀ
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
    const auto slot = [&]<auto which>() -> Matrix<Scalar, n, n> {
      if constexpr (same_slot<which, Slot::jacobian>)
        return root.visit.f_x;
      else
        return dynamics_slot<which>(rule.inner, d, x_s, prior.x, at);
    };
    const auto sensor_slot_at_root = [&]<auto which>() -> Matrix<Scalar, p, n> {
      if constexpr (same_slot<which, Slot::jacobian>)
        return root.visit.m_x;
      else
        return sensor_slot<which>(rule.inner, s, x_1, prediction, at_y);
    };
    const Matrix<Scalar, n, n> A = slot.template operator()<Inner::A>();
    Matrix<Scalar, n, n> AP, N;
    kernel::product(A, prior.P, AP);  // A P
    if constexpr (Inner::symmetric) {
      kernel::add_symmetric_product<1>(noise, AP, A, N);  // N = A P Aᵀ + G Q Gᵀ
    } else {
      // N = A P Bᵀ + G Q Gᵀ
      kernel::add_product_transposed<1>(noise, AP, slot.template operator()<Inner::B>(), N);
    }
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

/// The method of an iterated rule. A prediction has no measurement to iterate on: it is the inner rule's. A
/// correction alone is the step's equations without motion.
template <IteratedRule Rule_>
struct ExactStep : Rule_ {
  using Rule = Rule_;
  static constexpr bool optimal_on_linear = true;
  template <typename Scalar, typename D>
  using Belief = Estimate<Scalar, states_of<D>>;
  template <typename Scalar, typename D, typename S>
  using Report = IteratedReport<Scalar, states_of<D>, measurements_of<S>>;

  ExactStep() = default;
  ExactStep(const Rule& rule) : Rule(rule) {}  // NOLINT(google-explicit-constructor): the same thing

  template <typename D>
  static consteval bool accepts() {
    return detail::require_discrete<D>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return detail::require_sensor<S>();
  }

  template <typename Model, typename Start, typename Belief>
  [[nodiscard]] Status start(const Model& model, const Start& given, Belief& belief) const {
    return one_pass().start(model, given, belief);
  }
  template <typename Model, typename Scalar, int n, typename At>
  [[nodiscard]] Status predict(const Model& model, const Estimate<Scalar, n>& prior, const At& at,
                               Estimate<Scalar, n>& next) const {
    return one_pass().predict(model, prior, at, next);
  }
  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  void correct(const Model&, const Estimate<Scalar, n>& prior, const Sample& sample,
               Estimate<Scalar, n>& next, Report& report) const {
    const NoisyDynamics<Scalar, Stay<n>> stay{Stay<n>{}};
    detail::joint_step_into(rule(), stay.dynamics, stay.noise, sample.sensor, prior, sample.y,
                            StepContext<Scalar>{}, sample.at, sample.gate, report, next.x, next.P);
  }
  /// One exact step, eq. (9): the estimate of x_i is revised together with that of x_{i+1}.
  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  void step(const Model& model, const Estimate<Scalar, n>& prior, const Sample& sample,
            Estimate<Scalar, n>& next, Report& report) const {
    if constexpr (requires { Rule::measurement_only; }) {
      Estimate<Scalar, n> predicted;
      report.status = predict(model, prior, sample.at, predicted);
      if (report.status != Status::ok) return;
      const auto at = end_of(sample.at);
      correct(model, predicted, jml::Sample{sample.sensor, sample.y, at, sample.gate}, next, report);
    } else {
      detail::joint_step_into(rule(), model.dynamics, model.noise, sample.sensor, prior, sample.y, sample.at,
                              end_of(sample.at), sample.gate, report, next.x, next.P);
    }
  }

 private:
  const Rule& rule() const { return *this; }
  OnePass<typename Rule::Inner> one_pass() const { return {rule().inner}; }
};

template <IteratedRule Rule>
struct MethodOf<Rule> {
  using type = ExactStep<Rule>;
};

}  // namespace jml
