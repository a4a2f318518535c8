// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The factored form of a symmetric rule: P = U D Uᵀ, positive by construction, for problems whose condition
/// the plain form cannot hold.
///
/// Bierman and Thornton (ud_factors.hpp) in the digits of Scalar, with a bound on what rounding may have made
/// of P in its worst direction. Where that is more than 8 √ε, the step is done over again in twice the digits
/// (extended_step.hpp), and the belief keeps them as long as it needs them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored_turn.hpp>
#include <jml/filter/one_pass.hpp>

namespace jml {

/// The factored form of a symmetric one-pass rule: `jml::Filter safe{jml::Factored{jml::Ekf{}}, d, start};`
///
/// x and P as of the rule, P = U D Uᵀ. In double P is right to 1e-5 in every direction, and x to 1e-6 of a
/// standard deviation and 64 ε of the largest state, up to a condition of the correlations of 1e20 and far
/// beyond; where the digits of Scalar do not suffice a step is done again in twice as many, which takes some
/// 50 times as long, and the report says `redone`. Beside what the rule takes:
///   R of any rank: a row of variance 0 is a constraint. Of what is known exactly already it is skipped, and
///                  refused (contradiction) where it says something else
///   P_0            an Estimate, with infinite variances of states of which nothing is known (and zeros
///                  beside them), or a FactoredEstimate; singular or not
/// Refuses what the rule refuses; covariance_lost where even twice the digits do not suffice.
template <typename Rule_>
struct Factored {
  static_assert(OnePassRule<Rule_>,
                "jml: Factored{…} takes Kalman, Ekf, Sddre, a symmetric iterated rule, FixedLag, or "
                "Continuous{rule, RungeKutta4{}}");
  static_assert(
      Rule_::symmetric,
      "jml: a factored form belongs to the symmetric rules Kalman, Ekf and Sddre: P of another rule "
      "is no covariance and has no factors U D Uᵀ");
  /// What filter/method.hpp asks of a method.
  /// @{
  using Rule = Rule_;
  static constexpr bool symmetric = true, optimal_on_linear = true;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = FactoredBelief<Scalar, states_of<D>>;
  template <typename Scalar, typename D>
  using Model = detail::FactoredDynamics<Scalar, D>;
  template <typename Scalar, typename D, typename S>
  using Report = FactoredReport<Scalar, states_of<D>, measurements_of<S>>;

  constexpr Factored() = default;
  constexpr explicit Factored(const Rule& of) : rule(of) {}  ///< the plain form

  [[no_unique_address]] Rule rule;  ///< the plain form

  template <typename D>
  static consteval bool accepts() {
    return OnePass<Rule>::template accepts<D>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return OnePass<Rule>::template accepts_sensor<S>();
  }

  template <typename Model, typename Scalar, int m, int n>
  [[nodiscard]] Status start(const Model& model, const Estimate<Scalar, m>& given,
                             FactoredBelief<Scalar, n>& belief) const {
    static_assert(m == n, "jml: the estimate has not as many states as the dynamics");
    if (!all_finite(given.x)) return Status::invalid_state;
    Matrix<Scalar, n, n> known = given.P;
    bool valid = true;
    for (int i = 0; i < n; ++i) {
      if (given.P(i, i) != std::numeric_limits<Scalar>::infinity()) continue;
      for (int j = 0; j < n; ++j) valid = valid && (i == j || (given.P(i, j) == 0 && given.P(j, i) == 0));
      known(i, i) = Scalar(1);
    }
    if (!valid || !is_covariance(known)) return Status::invalid_covariance;
    detail::ExtendedMemory<Scalar, n, 0, 0> memory;
    detail::ExtendedStep<Scalar> two(memory);
    if (!two.load(given.P.data())) return Status::invalid_covariance;
    two.load_state(given.x.data(), nullptr);
    const Status status = detail::store_extended(two, belief);
    return status == Status::ok ? model.status() : Status::invalid_covariance;
  }
  template <typename Model, typename Scalar, int m, int n>
  [[nodiscard]] Status start(const Model& model, const FactoredEstimate<Scalar, m>& given,
                             FactoredBelief<Scalar, n>& belief) const {
    static_assert(m == n, "jml: the estimate has not as many states as the dynamics");
    if (!all_finite(given.x)) return Status::invalid_state;
    Matrix<Scalar, n, n> U = kernel::identity<Matrix<Scalar, n, n>>();
    bool valid = true;
    for (int j = 0; j < n; ++j) {
      valid = valid && given.D(j) >= Scalar(0) && given.U(j, j) == Scalar(1);
      for (int i = 0; i < j; ++i) U(i, j) = given.U(i, j);
    }
    if (!valid || !all_finite(U)) return Status::invalid_covariance;
    detail::ExtendedMemory<Scalar, n, 0, 0> memory;
    detail::ExtendedStep<Scalar> two(memory);
    two.load(U.data(), given.D.data(), nullptr, nullptr);
    two.load_state(given.x.data(), nullptr);
    const Status status = detail::store_extended(two, belief);
    return status == Status::ok ? model.status() : Status::invalid_covariance;
  }

  template <typename Model, typename Scalar, int n, typename At>
  [[nodiscard]] Status predict(const Model& model, const FactoredBelief<Scalar, n>& prior, const At& at,
                               FactoredBelief<Scalar, n>& next) const {
    Status status = Status::ok;
    if (!prior.extended) {
      Vector<Scalar, n> sizes;
      status = detail::factored_prediction(rule, model, prior, at, next, sizes);
      if (status != Status::ok || detail::settle(next, sizes)) return status;
    }
    FactoredReport<Scalar, n, 1> report;
    detail::factored_in_two<true>(rule, model, prior, at, Unobserved{}, at, next, report);
    return report.status;
  }

  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  void correct(const Model& model, const FactoredBelief<Scalar, n>& prior, const Sample& sample,
               FactoredBelief<Scalar, n>& next, Report& report) const {
    if (!sample.gate.valid()) {
      report.status = Status::invalid_option;
      return;
    }
    if (!prior.extended) {
      detail::commit(next, prior);
      if (correct_here(prior, sample, sample.at, prior.variances, next, report)) return;
    }
    detail::factored_in_two<false>(rule, model, prior, sample.at, sample, sample.at, next, report);
  }

  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  void step(const Model& model, const FactoredBelief<Scalar, n>& prior, const Sample& sample,
            FactoredBelief<Scalar, n>& next, Report& report) const {
    if (!sample.gate.valid()) {
      report.status = Status::invalid_option;
      return;
    }
    const auto end = end_of(sample.at);
    if (!prior.extended) {
      Vector<Scalar, n> sizes;
      report.status = detail::factored_prediction(rule, model, prior, sample.at, next, sizes);
      if (report.status != Status::ok) return;
      if (sample.gate.off()) {
        if (correct_here(next, sample, end, sizes, next, report)) return;
      } else {
        FactoredBelief<Scalar, n> predicted;
        detail::commit(predicted, next);
        predicted.extended = false;
        if (correct_here(predicted, sample, end, sizes, next, report)) return;
      }
    }
    detail::factored_in_two<true>(rule, model, prior, sample.at, sample, end, next, report);
  }
  /// @}

 private:
  /// In the digits of Scalar, `next` being `predicted`; false where they do not suffice.
  template <typename Scalar, int n, typename Sample, typename At, typename Report>
  [[nodiscard]] JML_INLINE bool correct_here(const FactoredBelief<Scalar, n>& predicted, const Sample& sample,
                                             const At& at, const Vector<Scalar, n>& sizes,
                                             FactoredBelief<Scalar, n>& next, Report& report) const {
    using Found = detail::FastCorrection;
    const Found found = detail::factored_correction(rule, sample.sensor, sample.y, at, next, report);
    if (found == Found::refused) return true;
    if (found == Found::short_of_digits) return false;
    if (!sample.gate.off()) {
      if (!report.rows.judge(sample.gate, report)) return false;
      if (report.gate == Verdict::rejected) detail::commit(next, predicted);
    }
    return detail::settle(next, sizes);
  }
};

template <typename Rule>
struct PartsOf<Factored<Rule>> {
  static auto each(auto& method, auto&& f) { return f(method.rule); }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
