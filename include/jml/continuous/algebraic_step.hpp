// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One interval of the state-dependent algebraic Riccati filter: solutions along a Runge-Kutta step, or one
/// for a sample. The equations: continuous/algebraic.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/signal.hpp>
#include <jml/filter/report.hpp>
#include <jml/riccati/algebraic.hpp>
#include <jml/riccati/difference.hpp>
#include <jml/riccati/differential.hpp>
#include <jml/solve/runge_kutta.hpp>

namespace jml {

/// How often the algebraic equation is solved.
enum class GainUpdate : std::uint8_t {
  every_stage,   ///< at each stage of each Runge-Kutta substep: order 4 in the step
  every_sample,  ///< once, at the start of the interval, and the gain held over it
};
/// For saving, image/parts.hpp.
constexpr GainUpdate last_value(GainUpdate) { return GainUpdate::every_sample; }

/// How the interval of an algebraic filter is made.
struct AlgebraicOptions {
  int substeps = 1;                           ///< Runge-Kutta steps over an interval
  GainUpdate gain = GainUpdate::every_stage;  ///< how often V is solved for

  /// Four solutions a substep are counted by an int.
  [[nodiscard]] bool valid() const {
    return substeps >= 1 && substeps <= std::numeric_limits<int>::max() / 4;
  }
};

}  // namespace jml

namespace jml::detail {

/// One interval under way: moves `belief`, which is touched on refusal too.
template <typename Method, typename Belief, typename At>
struct AlgebraicStep {
  const Method& method;
  Belief& belief;
  const At& at;

  using X = decltype(Belief::x);
  using Square = decltype(Belief::P);
  using Scalar = typename Belief::Scalar;
  static constexpr int n = static_cast<int>(X::RowsAtCompileTime);
  using Rule = std::remove_cvref_t<decltype(Method::rule)>;

  /// V at the coefficients, from the last one where there is one. S = Dᵀ R⁻¹ E.
  template <typename Coefficients, typename Out>
  Status solve(const Coefficients& c, const Square& S, Out& report) {
    const AlgebraicRiccati<Scalar, n, n> equation{c.A, kernel::transposed(c.B), c.noise, S};
    const auto solution =
        belief.warm ? solve_algebraic_riccati(equation, belief.P) : solve_algebraic_riccati(equation);
    ++report.solutions;
    report.cold += !solution.warm;
    if (!usable(solution.status)) return solution.status;
    report.residual = std::max(report.residual, solution.residual);
    report.error = std::max(report.error, solution.error);
    belief.P = solution.X;
    belief.warm = true;
    return solution.status;
  }

  /// Runge-Kutta over dt with the measurement there all the time.
  template <typename Model, typename S, typename Signal, typename Out>
  void flow(const Model& model, const S& sensor, const Signal& signal, Out& report) {
    constexpr int p = SensorTraits<S>::measurements;
    using D = std::remove_cvref_t<decltype(model.dynamics)>;
    using F = Flow<Rule, D, S, Scalar, Signal>;
    F equations(method.rule, model.dynamics, model.noise, sensor, signal, at.control);
    report.status = equations.prepare(at.time, belief.x);
    if (report.status != Status::ok) return;
    const int substeps = method.options.substeps;
    const Scalar h = at.dt / Scalar(substeps);
    if (!(h > Scalar(0))) return;
    Status answer = Status::ok;  // or accepted_critical
    Matrix<Scalar, n, p> gain = kernel::zeros<Matrix<Scalar, n, p>>();
    for (int step = 0; step < substeps; ++step) {
      const double start = at.time + static_cast<double>(h) * step;
      const Status status = explicit_step(
          RungeKutta4{}, belief.x, h, belief.x, [&](int stage, Scalar after, const X& here, X& slope) {
            const double time = start + static_cast<double>(after);
            const bool first = step == 0 && stage == 0;
            typename F::Coefficients c;
            X drift;
            Vector<Scalar, p> innovation;
            slope = here;
            if (const Status bad = equations.coefficients(time, here, c, drift, innovation);
                bad != Status::ok)
              return bad;
            if (first || method.options.gain == GainUpdate::every_stage) {
              if (!all_finite(innovation))
                return all_finite(equations.measured_at(time)) ? Status::sensor_not_finite
                                                               : Status::invalid_measurement;
              if (!all_finite(drift) || !all_finite(c.A) || !all_finite(c.B))
                return Status::dynamics_not_finite;
              if (!all_finite(c.W) || !all_finite(c.E)) return Status::sensor_not_finite;
              const Status solved = solve(c, c.W * c.E, report);
              if (!usable(solved)) return solved;
              if (solved != Status::ok) answer = solved;
              gain = belief.P * c.W;  // K = V Dᵀ R⁻¹
            }
            if (first) {
              report.gain = gain;
              report.innovation = innovation;
            }
            if (stage == 0) {  // explicit steps are stable while h times the rates of E K is below 2.78
              const Matrix<Scalar, p, p> feedback = c.E * gain * equations.R();
              const Matrix<Scalar, p, p> room =
                  Scalar(2.78) * equations.R() - h * kernel::symmetric_part(feedback);
              if (!is_definite<Definite::positive>(room)) return Status::step_too_long;
            }
            slope = drift + gain * innovation;
            return Status::ok;
          });
      if (status != Status::ok) {
        report.status = status;
        return;
      }
    }
    report.status = all_finite(belief.x) ? answer : Status::dynamics_not_finite;
  }

  /// A solution at the predicted state, and the correction with the sample.
  template <typename Model, typename Sample, typename Out>
  void sample(const Model& model, const Sample& y, Out& report) {
    constexpr int p = Sample::measurements;
    const auto refuse = [&](Status status) { report.status = status; };
    const X& x = belief.x;
    const Matrix<Scalar, p, p> R = noise_covariance(y.sensor, x, at);
    if (!is_noise_covariance(R)) return refuse(Status::invalid_noise_covariance);
    kernel::SymmetricFactor<Scalar, p> weight;
    if (!weight.factor(R)) return refuse(Status::invalid_noise_covariance);
    RiccatiCoefficients<Scalar, n, p> c;
    const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(method.rule, y.sensor, x, x, at);
    c.E = sensor_slot<Rule::E>(method.rule, y.sensor, x, x, at);
    c.A = dynamics_slot<Rule::A>(method.rule, model.dynamics, x, x, at);
    c.B = dynamics_slot<Rule::B>(method.rule, model.dynamics, x, x, at);
    if (!all_finite(c.A) || !all_finite(c.B)) return refuse(Status::dynamics_not_finite);
    if (!all_finite(slot_d) || !all_finite(c.E)) return refuse(Status::sensor_not_finite);
    if (!model.noise.with(model.dynamics, x, at, [&](const Square& noise) { c.noise = noise; }))
      return refuse(Status::invalid_disturbance_covariance);
    Matrix<Scalar, p, n> weighted;  // (R dt)⁻¹ E
    for (int j = 0; j < n; ++j)
      kernel::set_column(weighted, j, weight.solve(kernel::column_of(c.E, j)) / at.dt);
    const Status solved = solve(c, kernel::transposed(slot_d) * weighted, report);
    if (!usable(solved)) return refuse(solved);
    correct(y, report);
    if (report.status == Status::ok) report.status = solved;
  }

  /// K = V Dᵀ (R + E V Dᵀ)⁻¹ with the last V.
  template <typename Sample, typename Out>
  void correct(const Sample& y, Out& report) {
    constexpr int p = Sample::measurements;
    const auto refuse = [&](Status status) { report.status = status; };
    X& x = belief.x;
    const Matrix<Scalar, p, p> R = noise_covariance(y.sensor, x, at);
    if (!is_noise_covariance(R)) return refuse(Status::invalid_noise_covariance);
    const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(method.rule, y.sensor, x, x, at);
    const Matrix<Scalar, p, n> slot_e = sensor_slot<Rule::E>(method.rule, y.sensor, x, x, at);
    report.innovation = measurement_residual(y.sensor, y.y, measurement(y.sensor, x, at));
    if (!all_finite(slot_d) || !all_finite(slot_e) || !all_finite(report.innovation))
      return refuse(Status::sensor_not_finite);
    const Matrix<Scalar, n, p> VD = belief.P * kernel::transposed(slot_d);
    report.innovation_matrix = R + slot_e * VD;
    kernel::GeneralFactor<Scalar, p> factor;
    if (!factor.factor(report.innovation_matrix, noise_units(R))) return refuse(Status::singular_innovation);
    factor.right_solve(VD, report.gain);  // K = V Dᵀ (R + E V Dᵀ)⁻¹
    if (!y.gate.valid()) return refuse(Status::invalid_option);
    if (!judge(y.gate, report)) return refuse(Status::innovation_indefinite);
    if (report.gate == Verdict::rejected) return;
    x += report.gain * report.innovation;
    if (!all_finite(x)) refuse(Status::sensor_not_finite);
  }
};
template <typename Method, typename Belief, typename At>
AlgebraicStep(const Method&, Belief&, const At&) -> AlgebraicStep<Method, Belief, At>;

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
