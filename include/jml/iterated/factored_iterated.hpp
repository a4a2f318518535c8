// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The factored form of the symmetric iterated rules: `jml::Factored{jml::Iekf{}}`.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored.hpp>
#include <jml/iterated/factored_step.hpp>
#include <jml/iterated/iterated.hpp>

namespace jml {

/// The factored form of a symmetric iterated rule: Iekf, Iterated<Ekf<>>, Iterated<Sddre<>>. The belief, its
/// start and its prediction are those of the inner rule's factored form; P = U D Uᵀ.
///
/// The root is found as by the rule itself, and one more sweep from it goes through the factors; where the
/// digits of Scalar do not suffice for that, all sweeps do, in twice as many (report.redone). On a linear
/// model it is Factored{Kalman{}}. R of any rank, and infinite variances in P_0, as in Factored of a one-pass
/// rule. Beside what that refuses: not_converged.
template <IteratedRule Rule_>
struct Factored<Rule_> {
  static_assert(Rule_::symmetric,
                "jml: a factored form belongs to the symmetric iterated rules Iekf, Iterated<Ekf<>> and "
                "Iterated<Sddre<>>: P of IteratedJml is no covariance and has no factors U D Uᵀ");
  /// What filter/method.hpp asks of a method.
  /// @{
  using Rule = Rule_;
  using OnePassForm = Factored<typename Rule::Inner>;
  static constexpr bool symmetric = true, optimal_on_linear = true, iterates = true;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = FactoredBelief<Scalar, states_of<D>>;
  template <typename Scalar, typename D>
  using Model = detail::FactoredDynamics<Scalar, D>;
  template <typename Scalar, typename D, typename S>
  using Report = FactoredIteratedReport<Scalar, states_of<D>, measurements_of<S>>;

  constexpr Factored() = default;
  constexpr explicit Factored(const Rule& of) : rule(of) {}  ///< the plain form

  [[no_unique_address]] Rule rule;  ///< the plain form, with its options

  template <typename D>
  static consteval bool accepts() {
    return ExactStep<Rule>::template accepts<D>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return ExactStep<Rule>::template accepts_sensor<S>();
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
  void correct(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
               Report& report) const {
    detail::factored_exact_step<detail::Motion::none>(rule, model, prior, sample.at, sample, sample.at, next,
                                                      report);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
            Report& report) const {
    constexpr bool once = requires { Rule::measurement_only; };
    constexpr auto motion = once ? detail::Motion::before : detail::Motion::joint;
    detail::factored_exact_step<motion>(rule, model, prior, sample.at, sample, end_of(sample.at), next,
                                        report);
  }
  /// @}

  /// As of ExactStep.
  template <typename Model, typename Belief, typename Sample, typename At>
  [[nodiscard]] bool seek(const Model& model, const Belief& prior, const Sample& sample, At& at, bool begun,
                          bool widely, int& iterations) const {
    return detail::seek_minimum_of_whole(rule, model.dynamics, prior.P(), sample, at, begun, widely,
                                         iterations);
  }

 private:
  OnePassForm one_pass() const { return OnePassForm{rule.inner}; }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
