// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The exact step: iterated JML (Rusnak 2015, eqs. (9), (13)) and the measurement-iterated EKF.
///
/// The root z = (x_{i/i+1}, x̂_{i+1}) of the two ground-truth lines (iterated/joint_step.hpp) is sought from
/// (x̂_i, f(x̂_i)) by a bounded iteration; where it fails, the fallback solver takes over: the whitened
/// least-squares problem (11), then damped Newton on the lines with the true, nonsymmetric P. N, P and K are
/// formed once, at the root. A symmetric rule does the step again in twice the digits
/// (iterated/step_again.hpp) where its own do not suffice.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass.hpp>
#include <jml/iterated/joint_form.hpp>
#include <jml/iterated/step_again.hpp>
#include <jml/iterated/whole_step.hpp>

namespace jml {

/// The method of an iterated rule. A prediction has no measurement to iterate on: it is the inner rule's. A
/// correction alone is the step's equations without motion. Refused: what OnePass of the inner rule refuses;
/// not_converged, and no_minimum where the root found is a saddle or a maximum.
template <IteratedRule Rule_>
struct ExactStep : Rule_ {
  /// What filter/method.hpp asks of a method.
  /// @{
  using Rule = Rule_;
  static constexpr bool optimal_on_linear = true, iterates = true;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = typename OnePass<typename Rule::Inner>::template Belief<Scalar, D>;
  template <typename Scalar, typename D, typename S>
  using Report = IteratedReport<Scalar, states_of<D>, measurements_of<S>>;

  ExactStep() = default;
  /// A rule stands for its method.
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
  template <typename Model, typename Belief, typename At>
  [[nodiscard]] Status predict(const Model& model, const Belief& prior, const At& at, Belief& next) const {
    return one_pass().predict(model, prior, at, next);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct([[maybe_unused]] const Model& model, const Belief& prior, const Sample& sample, Belief& next,
               Report& report) const {
    const auto degrees = report.degrees;
    const auto digits = correct_here(prior, sample, next, report);
    if constexpr (Rule::symmetric) {
      if (digits == detail::Digits::too_few)
        report.status = detail::step_in_two<detail::Motion::none>(rule(), Unobserved{}, prior, sample.at,
                                                                  sample, sample.at, next, report);
    }
    if constexpr (Rule::symmetric && detail::is_affine<Model>() && is_linear_sensor<Sample>())
      keep_digits<Sample::measurements>(prior, degrees, report, [&](auto& exact) {
        one_pass().correct(model, prior, sample, next, exact);
      });
  }
  /// @}
  /// One exact step, eq. (9): the estimate of x_i is revised together with that of x_{i+1}.
  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
            Report& report) const {
    const auto end = end_of(sample.at);
    const auto degrees = report.degrees;
    constexpr bool once = requires { Rule::measurement_only; };
    detail::Digits digits = detail::Digits::too_few;
    if constexpr (once) {
      Belief predicted;
      report.status = predict(model, prior, sample.at, predicted);
      if (report.status == Status::ok)
        digits =
            correct_here(predicted, jml::Sample{sample.sensor, sample.y, end, sample.gate}, next, report);
      else if (report.status != Status::covariance_lost)
        return;
    } else {
      typename Belief::Scalar spread = 0;
      digits = detail::joint_step_into(rule(), model.dynamics, model.noise, sample.sensor, prior, sample.y,
                                       sample.at, end, sample.gate, report, next.x, next.P, spread);
      detail::note_spread(next, spread);
    }
    if constexpr (Rule::symmetric) {
      constexpr auto motion = once ? detail::Motion::before : detail::Motion::joint;
      if (digits == detail::Digits::too_few)
        report.status =
            detail::step_in_two<motion>(rule(), model, prior, sample.at, sample, end, next, report);
    }
    if constexpr (Rule::symmetric && detail::is_affine<Model>() && is_linear_sensor<Sample>())
      keep_digits<Sample::measurements>(
          prior, degrees, report, [&](auto& exact) { one_pass().step(model, prior, sample, next, exact); });
  }

  /// Of a step in charts with disturbances: to the lowest minimum of its criterion, see whole_step.hpp.
  template <typename Model, typename Belief, typename Sample, typename At>
  [[nodiscard]] bool seek(const Model& model, const Belief& prior, const Sample& sample, At& at, bool begun,
                          bool widely, int& iterations) const {
    return detail::seek_minimum_of_whole(rule(), model.dynamics, prior.P, sample, at, begun, widely,
                                         iterations);
  }

 private:
  const Rule& rule() const { return *this; }
  OnePass<typename Rule::Inner> one_pass() const { return {rule().inner}; }

  template <typename Sample>
  static consteval bool is_linear_sensor() {
    return detail::exact_sensor<std::remove_cvref_t<decltype(Sample::sensor)>,
                                std::remove_cvref_t<decltype(Sample::y)>>();
  }
  /// Where x of some state is known better than Scalar can say, filter/known_states.hpp, the digits of a
  /// linear step are those of the inner rule, whose step it is. `degrees`: of the report before the step.
  template <int p, typename Belief, typename Report, typename Exactly>
  JML_INLINE static void keep_digits(const Belief& prior, std::int16_t degrees, Report& report,
                                     const Exactly& exactly) {
    if (!usable(report.status) || !detail::has_known_states(prior)) return;
    const auto status = report.status;
    StepReport<typename Belief::Scalar, Belief::states, p> exact;
    exact.degrees = degrees;
    exactly(exact);
    static_cast<decltype(exact)&>(report) = exact;
    if (exact.status == Status::ok) report.status = status;
  }

  template <typename Belief, typename Sample, typename Report>
  detail::Digits correct_here(const Belief& prior, const Sample& sample, Belief& next, Report& report) const {
    using Scalar = typename Belief::Scalar;
    constexpr int n = Belief::states;
    const NoisyDynamics<Scalar, Stay<n>> stay{Stay<n>{}};
    Scalar spread = 0;
    const detail::Digits digits = detail::joint_step_into(rule(), stay.dynamics, stay.noise, sample.sensor,
                                                          prior, sample.y, StepContext<Scalar>{}, sample.at,
                                                          sample.gate, report, next.x, next.P, spread);
    detail::note_spread(next, spread);
    return digits;
  }
};

template <typename Rule>
struct PartsOf<ExactStep<Rule>> : PartsOfBase<ExactStep<Rule>, Rule> {};

template <IteratedRule Rule>
struct MethodOf<Rule> {
  using type = ExactStep<Rule>;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
