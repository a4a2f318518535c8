// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The state-dependent algebraic Riccati filter (McCaffrey, Harrison, Banks 1998, eqs. (8)-(9)) and the
/// steady RNLS filter: no P to carry, at every estimate the gain is that of the steady state there,
///   ẋ = f(x) + G w̄ + V Dᵀ R⁻¹ (y - m(x)),   0 = A V + V Bᵀ + G Q Gᵀ - V Dᵀ R⁻¹ E V,
/// with the slots of Table 1 at x and G(x). Sddre{} is the report's filter; Rnls{} has a nonsymmetric V.
///
/// The state moves little from one solution to the next, so each one starts from the last
/// (riccati/algebraic.hpp).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/algebraic_step.hpp>
#include <jml/filter/filter.hpp>
#include <jml/filter/method.hpp>

namespace jml {

/// What an interval of an algebraic filter reports; innovation and gain at the start, of a sample at its
/// time. status: accepted_critical where one of the equations was.
template <typename Scalar, int n, int p>
struct AlgebraicReport : StepReport<Scalar, n, p> {
  Scalar residual = 0;  ///< largest relative residual of the solutions
  Scalar error = 0;     ///< largest relative error that a solution claims
  int solutions = 0;    ///< solutions of the algebraic equation
  int cold = 0;         ///< how many of them a warm start did not serve
};

/// A state, and the last solution of the algebraic equation.
template <typename Scalar_, int n>
struct AlgebraicBelief {
  using Scalar = Scalar_;                                          ///< of x and P
  Vector<Scalar, n> x = kernel::zeros<Vector<Scalar, n>>();        ///< n, units of the model
  Matrix<Scalar, n, n> P = kernel::zeros<Matrix<Scalar, n, n>>();  ///< V; zero before the first
  bool warm = false;                                               ///< there is one
};

/// The method whose gain solves the algebraic Riccati equation at the estimate.
///
///     jml::Filter filter{jml::Algebraic{jml::Sddre{}}, Oscillator{}, x0};
///     const auto report = filter.step(sensor, y, dt);   // y held over dt, a jml::Line or a function of time
///
/// A sensor of samples (noise_covariance R) is used with the density R dt: f moves x over dt, and the sample
/// corrects it with K = V Dᵀ (R + E V Dᵀ)⁻¹, the same filter to O(dt) and bounded for every dt. predict()
/// moves x by f alone; update() corrects with the gain of the last V, and is refused (invalid_time_step)
/// before there is one, as a density needs a dt. Where no stabilising V exists (its status says why), where
/// dt is too long for the explicit step, and for every input that is refused, x, V and time stay as they
/// were. Fixed size, no heap, no exceptions.
template <typename Rule>
class Algebraic {
  static_assert(OnePassRule<Rule>,
                "jml: an iterated rule has no meaning in continuous time: take Sddre, Rnls or Ekf");

 public:
  /// What filter/method.hpp asks of a method.
  /// @{
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = AlgebraicBelief<Scalar, states_of<D>>;
  template <typename Scalar, typename D>
  using Start = Argument<Scalar, states_of<D>>;
  template <typename Scalar, typename D, typename S>
  using Report = AlgebraicReport<Scalar, states_of<D>, measurements_of<S>>;

  /// `row`: of Table 1; `how`: substeps and how often V is solved for.
  explicit Algebraic(Rule row = {}, const AlgebraicOptions& how = {}) : rule(std::move(row)), options(how) {}

  [[no_unique_address]] Rule rule;  ///< of Table 1
  AlgebraicOptions options;         ///< invalid_option: fewer than one substep

  template <typename D>
  static consteval bool accepts() {
    return detail::require_continuous<D>() && detail::require_flat<D>();
  }

  /// A state that is not finite is refused. The first solution is a cold one.
  template <typename Model, typename Start, typename Scalar, int n>
  [[nodiscard]] Status start(const Model& model, const Start& x, AlgebraicBelief<Scalar, n>& belief) const {
    belief = {};
    if constexpr (std::is_convertible_v<const Start&, Argument<Scalar, n>>) {
      const Argument<Scalar, n> state = x;
      belief.x = state;
    } else {
      static_assert(!sizeof(Start*),
                    "jml: an algebraic filter starts at a state, a jml::Vector of `states` entries");
    }
    return !all_finite(belief.x) ? Status::invalid_state
           : !options.valid()    ? Status::invalid_option
                                 : model.status();
  }

  template <typename Model, typename Belief, typename At>
  [[nodiscard]] Status predict(const Model& model, const Belief& prior, const At& at, Belief& next) const {
    next = prior;
    if (!options.valid()) return Status::invalid_option;
    using X = decltype(next.x);
    using Scalar = typename X::Scalar;
    const Scalar h = at.dt / Scalar(options.substeps);
    for (int i = 0; i < options.substeps; ++i) {
      const double start = at.time + static_cast<double>(h) * i;
      (void)explicit_step(RungeKutta4{}, next.x, h, next.x, [&](int, Scalar after, const X& x, X& slope) {
        slope =
            predicted_state(model.dynamics, x, At{start + static_cast<double>(after), Scalar(0), at.control});
        return Status::ok;
      });
    }
    return all_finite(next.x) ? Status::ok : Status::dynamics_not_finite;
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(const Model&, const Belief& prior, const Sample& sample, Belief& next, Report& report) const {
    next = prior;
    if (!all_finite(sample.y)) {
      report.status = Status::invalid_measurement;
    } else if (!prior.warm) {
      report.status = Status::invalid_time_step;
    } else {
      detail::AlgebraicStep step{*this, next, sample.at};
      step.correct(sample, report);
    }
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
            Report& report) const {
    using S = std::remove_cvref_t<decltype(sample.sensor)>;
    using At = std::remove_cvref_t<decltype(sample.at)>;
    using Scalar = typename Belief::Scalar;
    constexpr int p = Sample::measurements;
    if (!options.valid()) {
      report.status = Status::invalid_option;
      return;
    }
    if constexpr (detail::measures_always<S, decltype(prior.x), At>()) {
      next = prior;
      detail::AlgebraicStep step{*this, next, sample.at};
      detail::with_signal<p, Scalar>(
          sample.sensor, sample.y, sample.at.time, static_cast<double>(sample.at.dt),
          [&](const auto& signal) { step.flow(model, sample.sensor, signal, report); },
          [&] { report.status = Status::invalid_measurement; });
    } else {
      if (!all_finite(sample.y)) {
        report.status = Status::invalid_measurement;
      } else if (!(sample.at.dt > Scalar(0))) {
        report.status = Status::invalid_time_step;  // R dt would be no density
      } else if (report.status = predict(model, prior, sample.at, next); report.status == Status::ok) {
        const At end = end_of(sample.at);
        detail::AlgebraicStep step{*this, next, end};
        step.sample(model, jml::Sample{sample.sensor, sample.y, end, sample.gate}, report);
        if (report.gate == Verdict::rejected) {  // the prediction, and nothing of the measurement
          next.P = prior.P;
          next.warm = prior.warm;
        }
      }
    }
  }
  /// @}
};

template <typename Rule>
struct PartsOf<Algebraic<Rule>> {
  static auto each(auto& method, auto&& f) { return f(method.rule, method.options); }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
