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
  using Scalar = typename Step::X::Scalar;
  typename Step::Z z;   // the answer
  typename Step::Z at;  // where the slots are evaluated: z, or the start of the last sweep
  typename Step::Visit visit;
  Status status = Status::not_converged;
  Solver solver = Solver::none;
  int iterations = 0;
  Scalar residual = 0, cost = 0;
};

/// The models at root.z, on the rare way back.
template <typename Step>
[[gnu::noinline]] Root<Step> revisit(const Step& step, Root<Step> root) {
  (void)step.visit(root.z, root.visit);
  return root;
}

/// Iterates from `start` until the residual is below the tolerance. Everything goes by value, to live in
/// registers.
template <bool picard, typename Rule, typename Step, typename Scalar>
[[gnu::always_inline]] inline Root<Step> iterate(const Rule& rule, const Step& step,
                                                 const typename Step::X& prediction, Scalar tolerance,
                                                 const Root<Step>& start) {
  using Z = typename Step::Z;
  const IterationOptions& options = rule.options;
  Anderson<Scalar, Z::RowsAtCompileTime> anderson;
  Z weights, plain;
  Step::join(step.inverse_scale, step.inverse_scale, weights);
  kernel::assign(plain, start.z);
  Root<Step> root = start;
  root.solver = picard ? Solver::picard : Solver::anderson;
  root.residual = step.scaled(root.visit.residual);
  bool settled = false;
  while (true) {
    if ((root.residual <= tolerance || settled) && !options.accept_at_limit) {
      root.status = step.verdict(root.z, root.visit, root.residual, tolerance);
      if (root.status == Status::ok || (settled && usable(root.status))) break;
    }
    root.status = Status::not_converged;
    if (root.iterations == options.max_iterations) break;
    bool regular;
    if constexpr (picard) {
      const typename Step::X x_s = Step::smoothed(root.z), x_1 = Step::next(root.z);
      regular = step.template sweep<true>(
          root.z, root.visit,
          dynamics_slot<Rule::Inner::A>(rule.inner, step.dynamics_model, x_s, step.prior.x, step.at),
          sensor_slot<Rule::Inner::E>(rule.inner, step.sensor, x_1, prediction, step.at_y), plain);
    } else {
      regular = step.template sweep<false>(root.z, root.visit, root.visit.f_x, root.visit.m_x, plain);
    }
    if (!regular) break;
    ++root.iterations;
    if (options.accept_at_limit && root.iterations == options.max_iterations) {
      if (all_finite(plain)) root.status = Status::accepted_at_limit;
      break;
    }
    settled = step.moved(plain, root.z) <= tolerance;  // no sweep will move it any more
    if constexpr (picard)
      kernel::assign(root.z, plain);
    else
      kernel::assign(root.z, anderson.propose(root.z, plain, weights));
    if (!step.visit(root.z, root.visit)) {  // undefined there: once more from the unaccelerated point
      kernel::assign(root.z, plain);
      root = revisit(step, root);
      anderson.restart();
      if (!all_finite(root.visit.residual)) break;
    }
    root.residual = step.scaled(root.visit.residual);
  }
  kernel::assign(root.at, root.z);
  if (root.status == Status::accepted_at_limit) kernel::assign(root.z, plain);
  return root;
}

/// (9) as printed, out of the way of the default.
template <typename Rule, typename Step, typename Scalar>
[[gnu::noinline]] Root<Step> iterate_as_printed(const Rule& rule, const Step& step,
                                                const typename Step::X& prediction, Scalar tolerance,
                                                const Root<Step>& start) {
  return iterate<true>(rule, step, prediction, tolerance, start);
}

/// Newton on the two lines from root.z; judges what it reached.
template <typename Step, typename Scalar>
[[gnu::noinline]] Root<Step> polish(const Step& step, Scalar tolerance, int max_newton, Root<Step> root) {
  root.status = Status::not_converged;
  const SolverReport newton = damped_newton(step, root.z, tolerance, max_newton);
  root.iterations += newton.iterations;
  root.at = root.z;
  if (!step.visit(root.z, root.visit)) return root;
  root.residual = step.scaled(root.visit.residual);
  root.status = step.verdict(root.z, root.visit, root.residual, tolerance);
  return root;
}

/// The net: the whitened problem (11) from a = b = 0, then Newton with the true P.
template <typename Rule, typename Step, typename Scalar>
[[gnu::noinline]] Root<Step> fall_into_net(const Rule& rule, const Step& step,
                                           const typename Step::X& prediction, Scalar tolerance,
                                           Root<Step> root) {
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime);
  const WhitenedStep<Step, Scalar, n> whitened(step);
  Vector<Scalar, 2 * n> u = Vector<Scalar, 2 * n>::Zero();
  const SolverReport least_squares = rule.net.minimize(whitened, u);
  root.solver = Rule::Net::solver;
  root.iterations += least_squares.iterations;
  root.z = whitened.point(u);
  if (!all_finite(root.z)) Step::join(step.prior.x, prediction, root.z);
  return polish(step, tolerance, rule.options.max_newton, root);
}

/// The root of one step from `start`, (x̂, f(x̂)) already visited: first attempt, then the net.
/// `symmetric_prior`: the cost (11) must not be larger than at the start.
template <typename Rule, typename Step>
[[gnu::noinline]] Root<Step> solve_joint_step(const Rule& rule, const Step& step,
                                              const typename Step::X& prediction, bool symmetric_prior,
                                              const Root<Step>& start) {
  using Scalar = typename Step::X::Scalar;
  const IterationOptions& options = rule.options;
  const Scalar tolerance = options.tolerance > 0 ? Scalar(options.tolerance) : default_tolerance<Scalar>();
  const Scalar start_cost = start.visit.misfit.dot(start.visit.nu) / Scalar(2);  // (11) at x_s = x̂, w = 0
  const auto judge_cost = [&](Root<Step>& root) __attribute__((always_inline)) {
    root.cost = std::numeric_limits<Scalar>::quiet_NaN();
    if (!usable(root.status) || root.status == Status::accepted_at_limit)
      return;  // no root, no one-step cost
    root.cost = step.cost_at_root(root.visit);
    const Scalar slack = Scalar(1e3) * std::numeric_limits<Scalar>::epsilon();
    if (symmetric_prior && root.cost > start_cost * (Scalar(1) + slack) + slack)
      root.status = Status::not_converged;
  };

  Root<Step> root = start;
  switch (options.method) {
    case Iteration::anderson:
      root = iterate<false>(rule, step, prediction, tolerance, start);
      break;
    case Iteration::picard:
      root = iterate_as_printed(rule, step, prediction, tolerance, start);
      break;
    case Iteration::newton:
      root = polish(step, tolerance, options.max_iterations, start);
      root.solver = Solver::newton;
      break;
    case Iteration::none:
      break;
  }
  judge_cost(root);
  if (!usable(root.status) && options.use_net && !options.accept_at_limit) {
    root = fall_into_net(rule, step, prediction, tolerance, root);
    judge_cost(root);
  }
  return root;
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
    Step step{d, s, prior, noise, y, at, at_y, R, {}, Vector<Scalar, n>::Zero(), {}, {}};
    if (!step.R_factor.factor(R)) return answer(Status::invalid_noise_covariance);
    if constexpr (has_disturbance_mean<D, Vector<Scalar, n>, At>())
      step.push = prediction - dynamics(d, prior.x, at);
    step.set_scale(prediction);
    Root<Step> start;

    // The prediction's innovation, its matrix, and the gate on it.
    Step::join(prior.x, prediction, start.z);
    if (!step.visit(start.z, start.visit)) {
      if (!all_finite(prior.P)) return answer(Status::invalid_covariance);
      return answer(all_finite(start.visit.f_x) ? Status::sensor_not_finite : Status::dynamics_not_finite);
    }
    kernel::assign(report.innovation, start.visit.misfit);
    {
      Matrix<Scalar, n, p> Nm;
      kernel::add_product<1>(start.visit.Cm, start.visit.f_x, start.visit.Pfm, Nm);
      kernel::add_product<1>(R, start.visit.m_x, Nm, report.innovation_matrix);
    }
    if (!judge(gate, report)) return answer(Status::innovation_indefinite);
    if (report.gate == Verdict::rejected) {
      report.status = predict_into(rule.inner, d, process_noise, prior, at, x, P);
      if (report.status == Status::ok && !(all_finite(x) && all_finite(P))) report.status = blame(prior);
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
