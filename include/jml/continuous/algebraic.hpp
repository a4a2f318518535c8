// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The state-dependent algebraic Riccati filter (McCaffrey, Harrison, Banks 1998, eqs. (8)-(9)) and the
/// steady RNLS filter: no P to carry, at every estimate the gain is that of the steady state there,
///   ẋ = f(x) + G w̄ + V Dᵀ R⁻¹ (y - m(x)),   0 = A V + V Bᵀ + G Q Gᵀ - V Dᵀ R⁻¹ E V,
/// with the slots of Table 1 at x and G(x). Sddre{} is the report's filter; Rnls{} has a nonsymmetric V.
///
/// The state moves little from one solution to the next, so each one starts from the last
/// (riccati/algebraic.hpp).
#pragma once

#include <jml/continuous/continuous.hpp>
#include <jml/riccati/algebraic.hpp>

namespace jml {

/// How often the algebraic equation is solved.
enum class GainUpdate : std::uint8_t {
  every_stage,   ///< at each stage of each Runge-Kutta substep: order 4 in the step
  every_sample,  ///< once, at the start of the interval, and the gain held over it
};

struct AlgebraicOptions {
  int substeps = 1;  ///< Runge-Kutta steps over an interval
  GainUpdate gain = GainUpdate::every_stage;
};

/// What an interval of an algebraic filter reports.
template <typename Scalar, int n, int p>
struct AlgebraicReport {
  Status status = Status::ok;  ///< accepted_critical where one of the equations was
  Verdict gate = Verdict::off;
  Vector<Scalar, p> innovation =
      kernel::zeros<Vector<Scalar, p>>();  ///< at the start; of a sample: at its time
  Matrix<Scalar, n, p> gain = kernel::zeros<Matrix<Scalar, n, p>>();  ///< likewise
  Scalar residual = 0, error = 0;  ///< the worst of the solutions: relative residual, claimed relative error
  int solutions = 0, cold = 0;     ///< of the algebraic equation; how many of them a warm start did not serve
};

/// A filter whose gain solves the algebraic Riccati equation at the estimate.
///
///     jml::AlgebraicFilter filter{jml::Sddre{}, Oscillator{}, x0};
///     const auto report = filter.step(sensor, y, dt);   // y held over dt, or a jml::Line, or a function of
///     time
///
/// A sensor of samples (noise_covariance R) is used with the density R dt: f moves x over dt, and the sample
/// corrects it with K = V Dᵀ (R + E V Dᵀ)⁻¹, the same filter to O(dt) and bounded for every dt.
/// Where no stabilising V exists (its status says why), where dt is too long for the explicit step, and for
/// every input that is refused, x, V and time stay as they were. Fixed size, no heap, no exceptions.
template <typename Rule, typename D, typename Scalar = double>
class AlgebraicFilter {
  using Traits = DynamicsTraits<D>;
  static_assert(detail::require_continuous<D>());
  static_assert(OnePassRule<Rule>,
                "jml: an iterated rule has no meaning in continuous time: take Sddre, Rnls or Ekf");

 public:
  static constexpr int states = Traits::states;
  using State = Vector<Scalar, states>;
  using Square = Matrix<Scalar, states, states>;
  using Control = Argument<Scalar, Traits::controls>;
  using At = StepContext<Scalar, Traits::controls>;
  template <typename S>
  using Report = AlgebraicReport<Scalar, states, measurements_of<S>>;
  template <typename S>
  using Measurement = Argument<Scalar, measurements_of<S>>;

  /// A state that is not finite is refused by every step, until reset().
  AlgebraicFilter(Rule rule, D dynamics, const Argument<Scalar, states>& x, const AlgebraicOptions& options = {},
                  double time = 0)
      : rule_(std::move(rule)), dynamics_(std::move(dynamics)), process_noise_(dynamics_), options_(options) {
    reset(x, time);
  }

  /// Innovation gate for samples, with S = R + E V Dᵀ; off by default.
  Gate gate;

  /// Starts again from another state; the next solution is a cold one.
  Status reset(const Argument<Scalar, states>& x, double time) {
    x_ = x;
    time_ = time;
    kernel::set_zero(V_);
    warm_ = false;
    status_ = !std::isfinite(time)      ? Status::invalid_time_step
              : !all_finite(x)          ? Status::invalid_state
              : !process_noise_.valid() ? Status::invalid_disturbance_covariance
              : options_.substeps < 1   ? Status::invalid_option
                                        : Status::ok;
    return status_;
  }

  /// Moves the estimate over dt. y: a Vector of p, or a number (p = 1), held; a Line; a function of the
  /// absolute time; for a sensor of samples the sample at the end of dt. dt: s, zero or positive.
  template <typename S, typename Signal>
  [[nodiscard]] Report<S> step(const S& sensor, const Signal& y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    static_assert(detail::require_sensor<S>());
    constexpr int p = measurements_of<S>;
    Report<S> report;
    report.status = status_;
    if (status_ != Status::ok) return report;
    report.status = detail::check_context(At{time_, dt, control});
    if (report.status != Status::ok) return report;
    State x = x_;
    Square V = V_;
    bool warm = warm_;
    Move move{*this, dt, control, x, V, warm};
    if constexpr (detail::measures_always<S, State, At>()) {
      detail::with_signal<p, Scalar>(
          sensor, y, time_, static_cast<double>(dt),
          [&](const auto& signal) { move.flow(sensor, signal, report); },
          [&] { report.status = Status::invalid_measurement; });
    } else {
      move.sample(sensor, detail::as_measurement<p, Scalar>(y), report);
    }
    if (!usable(report.status)) return report;
    x_ = x;
    V_ = V;
    warm_ = warm;
    time_ += static_cast<double>(dt);
    return report;
  }

  [[nodiscard]] Status status() const { return status_; }
  [[nodiscard]] const State& x() const { return x_; }
  [[nodiscard]] const Square& V() const { return V_; }  ///< of the last solution; zero before the first
  [[nodiscard]] double time() const { return time_; }   ///< s
  [[nodiscard]] const D& dynamics() const { return dynamics_; }
  [[nodiscard]] const Rule& rule() const { return rule_; }

 private:
  /// One interval under way.
  struct Move {
    const AlgebraicFilter& filter;
    Scalar dt;
    const Control& control;
    State& x;
    Square& V;
    bool& warm;

    /// V at the coefficients, from the last one where there is one.
    template <typename Coefficients, typename Out>
    Status solve(const Coefficients& at, const Square& S, Out& report) {
      AlgebraicRiccati<Scalar, states, states> equation{at.A, kernel::transposed(at.B), at.noise, S};
      const auto solution = warm ? solve_algebraic_riccati(equation, V) : solve_algebraic_riccati(equation);
      ++report.solutions;
      report.cold += !solution.warm;
      if (!usable(solution.status)) return solution.status;
      report.residual = std::max(report.residual, solution.residual);
      report.error = std::max(report.error, solution.error);
      V = solution.X;
      warm = true;
      return solution.status;
    }

    /// Runge-Kutta over dt with the measurement there all the time.
    template <typename S, typename Signal>
    void flow(const S& sensor, const Signal& signal, Report<S>& report) {
      constexpr int p = measurements_of<S>;
      using F = Flow<Rule, D, S, Scalar, Signal>;
      F equations(filter.rule_, filter.dynamics_, filter.process_noise_, sensor, signal, control);
      const auto refuse = [&](Status status) { report.status = status; };
      if (const Status status = equations.prepare(filter.time_, x); status != Status::ok)
        return refuse(status);
      const int substeps = filter.options_.substeps;
      const Scalar h = dt / Scalar(substeps);
      if (!(h > Scalar(0))) return;
      const Scalar node[4] = {0, h / 2, h / 2, h}, weight[4] = {h / 6, h / 3, h / 3, h / 6};
      Matrix<Scalar, states, p> gain = kernel::zeros<Matrix<Scalar, states, p>>();
      for (int i = 0; i < 4 * substeps; ++i) {
        const int stage = i % 4;
        const bool first = i == 0;
        const double time =
            filter.time_ + static_cast<double>(h) * (i / 4) + static_cast<double>(node[stage]);
        if (stage == 0) sum = x;
        const State here = stage == 0 ? x : State(x + node[stage] * slope);
        typename F::Coefficients at;
        State drift;
        Vector<Scalar, p> innovation;
        Status status = equations.coefficients(time, here, at, drift, innovation);
        if (status != Status::ok) return refuse(status);
        if (first || filter.options_.gain == GainUpdate::every_stage) {
          if (!all_finite(innovation)) {
            return refuse(all_finite(equations.measured_at(time)) ? Status::sensor_not_finite
                                                                  : Status::invalid_measurement);
          }
          if (!all_finite(drift) || !all_finite(at.A) || !all_finite(at.B))
            return refuse(Status::dynamics_not_finite);
          if (!all_finite(at.W) || !all_finite(at.E)) return refuse(Status::sensor_not_finite);
          status = solve(at, at.W * at.E, report);
          if (!usable(status)) return refuse(status);
          if (status != Status::ok) report.status = status;
          gain = V * at.W;
        }
        if (first) {
          report.gain = gain;
          report.innovation = innovation;
        }
        if (stage == 0) {  // explicit steps are stable while h times the rates of E K is below 2.78
          const Matrix<Scalar, p, p> feedback = at.E * gain * equations.R();
          const Matrix<Scalar, p, p> room =
              Scalar(2.78) * equations.R() - h * kernel::symmetric_part(feedback);
          if (!is_definite<Definite::positive>(room)) return refuse(Status::step_too_long);
        }
        slope = drift + gain * innovation;
        sum += weight[stage] * slope;
        if (stage == 3) x = sum;
      }
      if (!all_finite(x)) refuse(Status::dynamics_not_finite);
    }

    /// f over dt, then the correction with the sample.
    template <typename S>
    void sample(const S& sensor, const Measurement<S>& y, Report<S>& report) {
      constexpr int p = measurements_of<S>;
      const auto refuse = [&](Status status) { report.status = status; };
      if (!all_finite(y)) return refuse(Status::invalid_measurement);
      if (!(dt > Scalar(0))) return refuse(Status::invalid_time_step);  // R dt would be no density
      const int substeps = filter.options_.substeps;
      const Scalar h = dt / Scalar(substeps);
      for (int i = 0; i < substeps; ++i) {
        const double start = filter.time_ + static_cast<double>(h) * i;
        const auto f = [&](const State& z, double ahead) -> State {
          return predicted_state(filter.dynamics_, z, At{start + ahead, Scalar(0), control});
        };
        const double half = static_cast<double>(h) / 2;
        const State k1 = f(x, 0), k2 = f(x + (h / 2) * k1, half), k3 = f(x + (h / 2) * k2, half);
        const State k4 = f(x + h * k3, 2 * half);
        x += (h / Scalar(6)) * (k1 + Scalar(2) * (k2 + k3) + k4);
      }
      if (!all_finite(x)) return refuse(Status::dynamics_not_finite);
      const At end{filter.time_ + static_cast<double>(dt), dt, control};
      const Matrix<Scalar, p, p> R = noise_covariance(sensor, x, end);
      if (!is_noise_covariance(R)) return refuse(Status::invalid_noise_covariance);
      kernel::SymmetricFactor<Scalar, p> weight;
      if (!weight.factor(R)) return refuse(Status::invalid_noise_covariance);
      RiccatiCoefficients<Scalar, states, p> at;
      const Matrix<Scalar, p, states> slot_d = sensor_slot<Rule::D>(filter.rule_, sensor, x, x, end);
      at.E = sensor_slot<Rule::E>(filter.rule_, sensor, x, x, end);
      at.A = dynamics_slot<Rule::A>(filter.rule_, filter.dynamics_, x, x, end);
      at.B = dynamics_slot<Rule::B>(filter.rule_, filter.dynamics_, x, x, end);
      const Vector<Scalar, p> innovation = measurement_residual(sensor, y, measurement(sensor, x, end));
      if (!all_finite(at.A) || !all_finite(at.B)) return refuse(Status::dynamics_not_finite);
      if (!all_finite(slot_d) || !all_finite(at.E) || !all_finite(innovation))
        return refuse(Status::sensor_not_finite);
      if (!filter.process_noise_.with(filter.dynamics_, x, end,
                                      [&](const Square& noise) { at.noise = noise; }))
        return refuse(Status::invalid_disturbance_covariance);
      Matrix<Scalar, p, states> weighted;  // (R dt)⁻¹ E
      for (int j = 0; j < states; ++j)
        kernel::set_column(weighted, j, weight.solve(kernel::column_of(at.E, j)) / dt);
      const Status status = solve(at, kernel::transposed(slot_d) * weighted, report);
      if (!usable(status)) return refuse(status);
      report.status = status;
      const Matrix<Scalar, states, p> VD = V * kernel::transposed(slot_d);
      const Matrix<Scalar, p, p> S_matrix = R + at.E * VD;
      kernel::GeneralFactor<Scalar, p> factor;
      if (!factor.factor(S_matrix, detail::noise_units(R))) return refuse(Status::singular_innovation);
      factor.right_solve(VD, report.gain);
      report.innovation = innovation;
      StepReport<Scalar, states, p> judged;
      judged.innovation = innovation;
      judged.innovation_matrix = S_matrix;
      if (!gate_allows(judged, report)) return;
      x += report.gain * innovation;
      if (!all_finite(x)) refuse(Status::sensor_not_finite);
    }

    template <int p, typename Out>
    bool gate_allows(StepReport<Scalar, states, p>& judged, Out& report) {
      if (!filter.gate.valid()) {
        report.status = Status::invalid_option;
        return false;
      }
      if (!judge(filter.gate, judged)) {
        report.status = Status::innovation_indefinite;
        return false;
      }
      report.gate = judged.gate;
      return judged.gate != Verdict::rejected;
    }

    State slope = kernel::zeros<State>(), sum = kernel::zeros<State>();
  };

  [[no_unique_address]] Rule rule_;
  [[no_unique_address]] D dynamics_;
  detail::ProcessNoise<Scalar, D> process_noise_;
  AlgebraicOptions options_;
  State x_;
  Square V_ = kernel::zeros<Square>();
  bool warm_ = false;
  double time_ = 0;
  Status status_ = Status::ok;
};

template <typename Rule, typename D, typename Scalar, int n>
AlgebraicFilter(Rule, D, const Vector<Scalar, n>&, const AlgebraicOptions& = {}, double = 0)
    -> AlgebraicFilter<Rule, D, Scalar>;

}  // namespace jml
