// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filter in continuous time: a rule of Table 1 over ẋ = f(x) + G w, moved from sample to sample by an
/// integrator (Rusnak 2018, eqs. (17)-(19)), or, with discrete measurements, between them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/continuous_in_space.hpp>
#include <jml/continuous/integrator.hpp>
#include <jml/continuous/signal.hpp>
#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass.hpp>

namespace jml {

template <typename Rule>
struct Factored;  // filter/factored.hpp

namespace detail {

/// P ← what of it is not below zero, where an integrator's error has made a direction of variance zero
/// negative: no entry changes by more than 1e-6 (float: 1e-3) of √(P_ii P_jj). False where that is not
/// enough.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE bool cut_to_covariance(Matrix<Scalar, n, n>& P) {
  constexpr Scalar share = std::is_same_v<Scalar, float> ? Scalar(1e-3) : Scalar(1e-6);
  if (!all_finite(P) || !diagonal_is<Definite::positive_or_zero>(P)) return false;
  const Matrix<Scalar, n, n> L = kernel::SemidefiniteFactor<Scalar, n>(P).L;
  const Matrix<Scalar, n, n> kept = L * kernel::transposed(L);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const Scalar size = std::sqrt(P(i, i)) * std::sqrt(P(j, j));
      if (!(std::abs(kept(i, j) - P(i, j)) <= share * size)) return false;
    }
  }
  P = kept;
  return true;
}

/// A SDC matrix is about a point, which need not be in the chart of a step.
template <typename Rule, typename D>
consteval bool require_jacobians_in_space() {
  if constexpr (!is_flat<D>) {
    static_assert(
        !Rule::uses_sdc,
        "jml: over states in a space (`Space`, `tangent`) a continuous filter takes Ekf, or another "
        "rule of Jacobians alone");
    return !Rule::uses_sdc;
  }
  return true;
}

}  // namespace detail

/// What an interval under a measurement that is there all the time reports; innovation and gain are those of
/// its start, K = P Dᵀ R⁻¹ in units of x per y and s. There is no innovation matrix and no gate.
template <typename Scalar, int n, int p>
struct FlowReport : StepReport<Scalar, n, p> {
  long steps = 0;        ///< of the integrator
  long evaluations = 0;  ///< of the differential equations
};

/// The continuous method of a rule and an integrator.
///
///     jml::Filter filter{jml::Continuous{jml::Rnls{}, jml::DavisonMaki{}}, Oscillator{}, estimate};
///     const auto report = filter.step(sensor, y, dt);                  // y held over dt
///     const auto report = filter.step(sensor, jml::Line{y0, y1}, dt);  // y interpolated over dt
///
/// Rule: Kalman (Kalman-Bucy), Ekf, Sddre, Rnls. Integrator: RungeKutta4, DavisonMaki
/// (riccati/davison_maki.hpp) or Cvode (continuous/cvode.hpp). A sensor that has noise_spectral_density()
/// measures all the time; one that has noise_covariance() gives samples: step() then propagates over dt and
/// corrects with the sample at its end by the difference recursion, refused as a whole; update() serves these
/// alone. Refused beside bad input: riccati_escape, covariance_lost; step_too_long (RungeKutta4), step_limit
/// (DavisonMaki, Cvode), accuracy_not_met and integrator_failed (Cvode). No heap, but Cvode's. Over states in
/// a space, with Ekf alone: continuous/continuous_in_space.hpp.
template <typename Rule, typename IntegratorType = RungeKutta4>
class Continuous {
  static_assert(OnePassRule<Rule>,
                "jml: an iterated rule has no meaning in continuous time: take Ekf, Sddre, Rnls or Kalman");

 public:
  /// What filter/method.hpp asks of a method.
  /// @{
  static constexpr bool optimal_on_linear = true, symmetric = Rule::symmetric;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = Estimate<Scalar, states_of<D>>;
  /// The dynamics, and what the integrator keeps for one filter.
  template <typename Scalar, typename D>
  struct Model : NoisyDynamics<Scalar, D> {
    /// Of a method, which says how to integrate.
    Model(const D& model, const Continuous& method)
        : NoisyDynamics<Scalar, D>(model), engine(method.integrator) {}
    [[no_unique_address]] EngineOf<IntegratorType, Scalar, states_of<D>> engine;  ///< of the integrator

    /// Forgets what led here.
    void restart() {
      if constexpr (requires { engine.restart(); }) engine.restart();
    }
  };
  template <typename Scalar, typename D, typename S>
  using Report =
      std::conditional_t<detail::measures_always<S, Vector<Scalar, states_of<D>>,
                                                 StepContext<Scalar, DynamicsTraits<D>::controls>>(),
                         FlowReport<Scalar, states_of<D>, SensorTraits<S>::measurements>,
                         StepReport<Scalar, states_of<D>, SensorTraits<S>::measurements>>;

  /// `row`: of Table 1; `by`: the integrator.
  explicit Continuous(Rule row = {}, IntegratorType by = {})
      : rule(std::move(row)), integrator(std::move(by)) {}

  [[no_unique_address]] Rule rule;                  ///< of Table 1
  [[no_unique_address]] IntegratorType integrator;  ///< read when a filter is made

  template <typename D>
  static consteval bool accepts() {
    return detail::require_continuous<D>() && detail::require_jacobians_in_space<Rule, D>() &&
           detail::require_linear_if_kalman<Rule, DynamicsTraits<D>>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return detail::require_sensor<S>() && detail::require_linear_if_kalman<Rule, SensorTraits<S>>();
  }

  /// As of the rule in discrete time.
  template <typename Model, typename Start, typename Belief>
  [[nodiscard]] Status start(const Model& model, const Start& given, Belief& belief) const {
    return one_pass().start(model, given, belief);
  }

  /// Ṗ = A P + P Bᵀ + G Q Gᵀ over at.dt.
  template <typename Model, typename Scalar, int n, typename At>
  [[nodiscard]] Status predict(Model& model, const Estimate<Scalar, n>& prior, const At& at,
                               Estimate<Scalar, n>& next) const {
    FlowRecord<Scalar, n, 0> record;
    return flow(model, detail::NoSensor{}, detail::NoSignal{}, prior, at, next, record);
  }
  /// A sample, by the difference recursion.
  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
               Report& report) const {
    one_pass().correct(model, prior, sample, next, report);
  }
  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  void step(Model& model, const Estimate<Scalar, n>& prior, const Sample& sample, Estimate<Scalar, n>& next,
            Report& report) const {
    using S = std::remove_cvref_t<decltype(sample.sensor)>;
    using At = std::remove_cvref_t<decltype(sample.at)>;
    constexpr int p = Sample::measurements;
    if constexpr (detail::measures_always<S, Vector<Scalar, n>, At>()) {
      detail::with_signal<p, Scalar>(
          sample.sensor, sample.y, sample.at.time, static_cast<double>(sample.at.dt),
          [&](const auto& signal) {
            FlowRecord<Scalar, n, p> record;
            report.status = flow(model, sample.sensor, signal, prior, sample.at, next, record);
            if (report.status != Status::ok) return;
            report.innovation = record.innovation;
            report.gain = record.gain;
            report.steps = record.steps;
            report.evaluations = record.evaluations;
          },
          [&] { report.status = Status::invalid_measurement; });
    } else {
      Estimate<Scalar, n> predicted;
      report.status = predict(model, prior, sample.at, predicted);
      if (report.status != Status::ok) return;
      const At end = end_of(sample.at);
      correct(model, predicted, jml::Sample{sample.sensor, sample.y, end, sample.gate}, next, report);
    }
  }
  /// @}

 private:
  template <typename>
  friend struct Factored;
  template <typename, typename, typename>
  friend struct detail::ContinuousInSpace;
  OnePass<Rule> one_pass() const { return {rule}; }
  /// P is finite and, of a symmetric rule, a covariance.
  template <typename Scalar, int n>
  JML_INLINE static bool holds(Matrix<Scalar, n, n>& P) {
    if constexpr (Rule::symmetric)
      return detail::pivots_of(P, kernel::diagonal(P)).positive || detail::cut_to_covariance(P);
    else
      return all_finite(P);
  }

  template <typename Model, typename S, typename Signal, typename Scalar, int n, typename At, typename Record>
  JML_INLINE inline Status flow(Model& model, const S& sensor, const Signal& signal,
                                const Estimate<Scalar, n>& prior, const At& at, Estimate<Scalar, n>& next,
                                Record& record) const {
    Vector<Scalar, n> x;  // apart, so that they live in registers
    Matrix<Scalar, n, n> P;
    kernel::assign(x, prior.x);
    kernel::assign(P, prior.P);
    if (at.dt == Scalar(0)) {
      next = prior;
      return Status::ok;
    }
    using D = std::remove_cvref_t<decltype(model.dynamics)>;
    using F = Flow<Rule, D, S, Scalar, Signal>;
    static_assert(
        Integrator<IntegratorType, F>,
        "jml: an integrator of a continuous filter is RungeKutta4, DavisonMaki, Cvode, or a type with an "
        "advance() as jml::Integrator says");
    F flow(rule, model.dynamics, model.noise, sensor, signal, F::given(at));
    if (const Status status = flow.prepare(at.time, prior.x); status != Status::ok) return status;
    const Status status = advance(model.engine, flow, at.time, at.dt, x, P, record);
    if (status == Status::dynamics_not_finite || (status == Status::ok && !(holds(P) && all_finite(x))))
      return diagnose(model, sensor, signal, prior, at, all_finite(x));
    kernel::assign(next.x, x);
    kernel::assign(next.P, P);
    return status;
  }

  /// Why an interval ended in numbers that are no estimate, in the order in which they came. A flow of its
  /// own: the address of the other one must not leave its function, or its members live in memory.
  template <typename Model, typename S, typename Signal, typename Scalar, int n, typename At>
  JML_NOINLINE Status diagnose(const Model& model, const S& sensor, const Signal& signal,
                               const Estimate<Scalar, n>& prior, const At& at, bool x_finite) const {
    using D = std::remove_cvref_t<decltype(model.dynamics)>;
    using F = Flow<Rule, D, S, Scalar, Signal>;
    F flow(rule, model.dynamics, model.noise, sensor, signal, F::given(at));
    typename F::X slope_x;
    typename F::Square slope_P;
    typename F::Report record;
    if constexpr (F::measured) {
      if (!all_finite(flow.measured_at(at.time)) ||
          !all_finite(flow.measured_at(at.time + static_cast<double>(at.dt))))
        return Status::invalid_measurement;
    }
    if (const Status status = flow.prepare(at.time, prior.x); status != Status::ok) return status;
    if (!all_finite(predicted_state(model.dynamics, prior.x, flow.at(at.time))))
      return Status::dynamics_not_finite;
    const Status status = flow.derivative(at.time, prior.x, prior.P, slope_x, slope_P, &record);
    if (status != Status::ok) return status;
    if constexpr (F::measured) {
      if (!all_finite(record.innovation) || !all_finite(record.gain)) return Status::sensor_not_finite;
      typename F::Coefficients coefficients;
      Vector<Scalar, F::p> innovation;
      if (flow.coefficients(at.time, prior.x, coefficients, slope_x, innovation) == Status::ok &&
          !all_finite(coefficients.E))
        return Status::sensor_not_finite;
    }
    if (!all_finite(slope_P)) return Status::dynamics_not_finite;
    return Rule::symmetric || !x_finite ? Status::covariance_lost : Status::riccati_escape;
  }
};

/// The integrator is read when a filter is made.
template <typename Rule, typename Integrator>
struct PartsOf<Continuous<Rule, Integrator>> {
  static auto each(auto& method, auto&& f) { return f(method.rule); }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
