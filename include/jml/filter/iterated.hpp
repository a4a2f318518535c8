// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The exact step: iterated JML (Rusnak 2015, eqs. (9), (13)) and the measurement-iterated EKF.
///
/// The root z = (x_{i/i+1}, x̂_{i+1}) of the two ground-truth lines (filter/joint_step.hpp) is sought from
/// (x̂_i, f(x̂_i)) by a bounded iteration; where it fails, the net takes over: the whitened least-squares
/// problem (11), then damped Newton on the lines with the true, nonsymmetric P. N, P and K are formed once,
/// at the root.
#pragma once

#include <jml/filter/joint_step.hpp>
#include <jml/solve/anderson.hpp>
#include <jml/solve/levenberg_marquardt.hpp>
#include <jml/solve/newton.hpp>

namespace jml {

/// The first attempt at the root. Measured on generated hard steps: tests/filter/iterated_hard_test.cpp.
enum class Iteration : std::uint8_t {
  anderson,  ///< Anderson depth 2 on the Gauss-Newton sweep; first derivatives only
  newton,    ///< damped Newton on the two lines; second derivatives by nested dual numbers
  picard,    ///< (9) swept as printed: the reference, a contraction only where a step is weakly nonlinear
  none,      ///< the net alone
};

/// Bounds of the iteration.
struct IterationOptions {
  Iteration method = Iteration::anderson;
  int max_iterations = 40;  ///< of the first attempt; ≥ 1
  double tolerance = 0;  ///< largest residual of the two lines over the state scale; 0: 1e-12 (float: 1e-5)
  bool accept_at_limit = false;  ///< take the last sweep as it is: a fixed number of sweeps per step, no net
  bool use_net = true;           ///< call the net where the first attempt failed
  int max_newton = 30;           ///< Newton steps of the net's second half
};

/// A rule whose step is implicit. Inner: the one-pass rule that supplies the slots; Net: the least-squares
/// solver below.
template <typename Inner_, typename Net_ = LevenbergMarquardt>
struct Iterated {
  using Inner = Inner_;
  using Net = Net_;
  static constexpr bool symmetric = Inner::symmetric;
  [[no_unique_address]] Inner inner{};
  IterationOptions options{};
  [[no_unique_address]] Net net{};
};

/// The exact recursive-iterative JML estimator, eq. (9).
template <typename Reference = AboutOrigin, typename Net = LevenbergMarquardt>
struct IteratedJml : Iterated<Jml<Reference>, Net> {
  IteratedJml() = default;
  explicit IteratedJml(const IterationOptions& iteration)
      : Iterated<Jml<Reference>, Net>{{}, iteration, {}} {}
  explicit IteratedJml(const Reference& reference, const IterationOptions& iteration = {},
                       const Net& solver = {})
      : Iterated<Jml<Reference>, Net>{Jml<Reference>(reference), iteration, solver} {}
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
  typename Rule::Net;
};

namespace detail {

template <typename Scalar>
constexpr Scalar default_tolerance() {
  return std::is_same_v<Scalar, float> ? Scalar(1e-5) : Scalar(1e-12);
}

inline bool valid(const IterationOptions& o) {
  return o.max_iterations >= 1 && o.max_newton >= 0 && o.tolerance >= 0 && o.tolerance < 1;
}

/// A root, or the last sweep taken for one, and the models there.
template <typename Step>
struct Root {
  typename Step::Z z;   // the answer
  typename Step::Z at;  // where the slots are evaluated: z, or the start of the last sweep
  typename Step::Visit visit;
  Status status = Status::not_converged;
};

/// Iterates from z until the residual is below the tolerance.
template <typename Rule, typename Step, typename Report, typename Scalar>
void iterate(const Rule& rule, const Step& step, const typename Step::X& prediction, Scalar tolerance,
             Report& report, Root<Step>& root) {
  using Z = typename Step::Z;
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime);
  const IterationOptions& options = rule.options;
  const bool picard = options.method == Iteration::picard;
  Z weights;
  weights << step.scale.cwiseAbs2().cwiseInverse(), step.scale.cwiseAbs2().cwiseInverse();
  Anderson<Scalar, 2 * n> anderson(weights);
  Z& z = root.z;
  Z plain = z;  // the last unaccelerated point
  bool accelerated = false;
  Matrix<Scalar, Step::p, Step::p> S;
  for (int i = 0;; ++i) {
    if (!step.visit(z, root.visit)) {
      if (!accelerated) return;
      accelerated = false;
      anderson.restart();
      z = plain;
      if (!step.visit(z, root.visit)) return;
    }
    root.at = z;
    report.residual = step.scaled(root.visit.residual, z);
    if (report.residual <= tolerance && !options.accept_at_limit &&
        step.verdict(z, root.visit, report.residual, tolerance) == Status::ok) {
      root.status = Status::ok;
      return;
    }
    if (i == options.max_iterations) return;
    Z next;
    bool regular;
    if (picard) {
      const typename Step::X x_s = z.template head<n>(), x_1 = z.template tail<n>();
      regular = step.template sweep<true>(
          z, root.visit,
          dynamics_slot<Rule::Inner::A>(rule.inner, step.dynamics_model, x_s, step.prior.x, step.at),
          sensor_slot<Rule::Inner::E>(rule.inner, step.sensor, x_1, prediction, step.at_y), next, S);
    } else {
      regular = step.template sweep<false>(z, root.visit, root.visit.f_x, root.visit.m_x, next, S);
    }
    if (!regular) return;
    ++report.iterations;
    if (options.accept_at_limit && i + 1 == options.max_iterations) {
      z = next;
      root.status = Status::accepted_at_limit;
      return;
    }
    if (step.scaled(next - z, z) <= tolerance) {  // settled: no sweep will move it any more
      root.status = step.verdict(z, root.visit, report.residual, tolerance);
      if (usable(root.status)) return;
    }
    plain = next;
    z = picard ? next : anderson.propose(z, next);
    accelerated = !picard;
    if (!all_finite(z)) {
      if (!all_finite(plain)) return;
      z = plain;
    }
  }
}

/// Newton on the two lines from z; judges what it reached.
template <typename Step, typename Report, typename Scalar>
[[gnu::noinline]] void polish(const Step& step, Scalar tolerance, int max_newton, Report& report,
                              Root<Step>& root) {
  root.status = Status::not_converged;
  const SolverReport newton = damped_newton(step, root.z, tolerance, max_newton);
  report.iterations += newton.iterations;
  root.at = root.z;
  if (!step.visit(root.z, root.visit)) return;
  report.residual = step.scaled(root.visit.residual, root.z);
  root.status = step.verdict(root.z, root.visit, report.residual, tolerance);
}

/// The root of one step: first attempt, then the net. `symmetric_prior`: the cost (11) must not have grown.
template <typename Rule, typename Step, typename Report>
void solve_joint_step(const Rule& rule, const Step& step, const typename Step::X& prediction,
                      bool symmetric_prior, Report& report, Root<Step>& root) {
  using Scalar = typename Step::X::Scalar;
  using Z = typename Step::Z;
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime);
  const IterationOptions& options = rule.options;
  const Scalar tolerance = options.tolerance > 0 ? Scalar(options.tolerance) : default_tolerance<Scalar>();
  const Scalar start_cost = step.cost_at_start(prediction);
  Z start;
  start << step.prior.x, prediction;
  const auto judged = [&] {
    if (!usable(root.status)) return false;
    report.cost = step.cost_at_root(root.visit);
    if (!symmetric_prior || root.status == Status::accepted_at_limit) return true;
    const Scalar slack = Scalar(1e3) * std::numeric_limits<Scalar>::epsilon();
    return !(report.cost > start_cost * (Scalar(1) + slack) + slack);
  };

  root.z = start;
  if (options.method == Iteration::newton) {
    report.solver = Solver::newton;
    polish(step, tolerance, options.max_iterations, report, root);
  } else if (options.method != Iteration::none) {
    report.solver = options.method == Iteration::picard ? Solver::picard : Solver::anderson;
    iterate(rule, step, prediction, tolerance, report, root);
  }
  if (judged()) return;
  root.status = Status::not_converged;
  if (!options.use_net || options.accept_at_limit) return;

  report.solver = Rule::Net::solver;
  const WhitenedStep<Step, Scalar, n> whitened(step);
  Vector<Scalar, 2 * n> u = Vector<Scalar, 2 * n>::Zero();
  const SolverReport least_squares = rule.net.minimize(whitened, u);
  report.iterations += least_squares.iterations;
  root.z = whitened.point(u);
  if (!all_finite(root.z)) root.z = start;
  polish(step, tolerance, options.max_newton, report, root);
  if (!judged()) root.status = Status::not_converged;
}

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
  if (const Status status = check_instant(at); status != Status::ok) return answer(status);
  if (!all_finite(y)) return answer(Status::invalid_measurement);
  if (!all_finite(prior.x)) return answer(Status::invalid_state);
  const Vector<Scalar, n> prediction = predicted_state(d, prior.x, at);
  if (!all_finite(prediction)) return answer(Status::dynamics_not_finite);
  const Matrix<Scalar, p, p> R = noise_covariance(s, prediction, at_y);
  if (!is_noise_covariance(R)) return answer(Status::invalid_noise_covariance);

  const bool noise_valid = process_noise.with(d, prior.x, at, [&](const Matrix<Scalar, n, n>& noise) {
    using Step = JointStep<D, S, Scalar, n, At, SensorAt>;
    Step step{d, s, prior, noise, y, at, at_y, R, {}, Vector<Scalar, n>::Zero(), {}};
    if (!step.R_factor.factor(R)) return answer(Status::invalid_noise_covariance);
    if constexpr (has_disturbance_mean<D, Vector<Scalar, n>, At>())
      step.push = prediction - dynamics(d, prior.x, at);
    step.set_scale(prediction);
    Root<Step> root;

    // The prediction's innovation, its matrix, and the gate on it.
    root.z << prior.x, prediction;
    if (!step.visit(root.z, root.visit)) {
      if (!all_finite(prior.P)) return answer(Status::invalid_covariance);
      return answer(all_finite(root.visit.f_x) ? Status::sensor_not_finite : Status::dynamics_not_finite);
    }
    report.innovation = root.visit.misfit;
    {
      Matrix<Scalar, n, p> Nm;
      kernel::add_product<1>(root.visit.Cm, root.visit.f_x, root.visit.Pfm, Nm);
      kernel::add_product<1>(R, root.visit.m_x, Nm, report.innovation_matrix);
    }
    if (!judge(gate, report)) return answer(Status::innovation_indefinite);
    if (report.gate == Verdict::rejected) {
      report.status = predict_into(rule.inner, d, process_noise, prior, at, x, P);
      if (report.status == Status::ok && !(all_finite(x) && all_finite(P))) report.status = blame(prior);
      return;
    }

    const bool symmetric_prior = Inner::symmetric || is_symmetric(prior.P);
    solve_joint_step(rule, step, prediction, symmetric_prior, report, root);
    if (!usable(root.status)) return answer(root.status);

    // N, P and K once, with the slots at the root.
    const Vector<Scalar, n> x_s = root.at.template head<n>(), x_1 = root.at.template tail<n>();
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
    x = root.z.template tail<n>();
    report.smoothed = root.z.template head<n>();
    if (!is_sound<Inner::symmetric>(P) || !all_finite(x)) return answer(Status::covariance_lost);
    report.status = root.status;
  });
  if (!noise_valid) return answer(Status::invalid_disturbance_covariance);
}

}  // namespace detail

/// A prediction has no measurement to iterate on: it is the inner rule's.
template <IteratedRule Rule, typename D, typename Scalar, int n>
[[nodiscard]] PredictResult<Scalar, n> predict(const Rule& rule, const D& d,
                                               const detail::ProcessNoise<Scalar, D>& process_noise,
                                               const Estimate<Scalar, n>& prior,
                                               const Instant<Scalar, DynamicsTraits<D>::controls>& at = {}) {
  return predict(rule.inner, d, process_noise, prior, at);
}
template <IteratedRule Rule, typename D, typename Scalar, int n>
[[nodiscard]] PredictResult<Scalar, n> predict(const Rule& rule, const D& d, const Estimate<Scalar, n>& prior,
                                               const Instant<Scalar, DynamicsTraits<D>::controls>& at = {}) {
  return predict(rule.inner, d, prior, at);
}

/// Corrects an estimate with a measurement of the same instant: the step's equations without motion.
template <IteratedRule Rule, typename S, typename Scalar, int n, int controls = 0>
[[nodiscard]] StepResult<Scalar, n, measurements_of<S>> update(const Rule& rule, const S& s,
                                                               const Estimate<Scalar, n>& prior,
                                                               const Vector<Scalar, measurements_of<S>>& y,
                                                               const Instant<Scalar, controls>& at = {},
                                                               const Gate& gate = {}) {
  static_assert(detail::require_sensor<S>());
  StepResult<Scalar, n, measurements_of<S>> out;
  const Stay<n> stay;
  detail::joint_step_into(rule, stay, detail::ProcessNoise<Scalar, Stay<n>>(stay), s, prior, y,
                          Instant<Scalar>{}, at, gate, out.report, out.estimate.x, out.estimate.P);
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
    const Vector<Scalar, measurements_of<S>>& y, const Instant<Scalar, DynamicsTraits<D>::controls>& at = {},
    const Gate& gate = {}) {
  StepResult<Scalar, n, measurements_of<S>> out;
  step_into(rule, d, detail::ProcessNoise<Scalar, D>(d), s, prior, y, at, gate, out.report, out.estimate.x,
            out.estimate.P);
  if (!usable(out.report.status)) out.estimate = prior;
  return out;
}

}  // namespace jml
