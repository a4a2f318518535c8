// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The bounded-noise estimator: disturbances and noise of which only bounds are known.
///
/// x⁺ = f(x) + G (w̄ + w), |w| ≤ ū; y = m(x) + v, |v| ≤ b, by component. All that is known of x is a box: the
/// states that can be reached, met with those that can have been measured. Were the density uniform in it,
/// its centre would be the conditional mean, eq. (2.31), and (d - c)²/12 the variance of its error, (2.34).
/// Source: bounded-noise dissertation, chapters II and III.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/guaranteed_box.hpp>
#include <jml/bounded/linearised_box.hpp>
#include <jml/bounded/paved_box.hpp>
#include <jml/filter/filter.hpp>
#include <jml/filter/method.hpp>

namespace jml {

/// How a box moves: Linearised (the source's), Guaranteed, or Paved, a union of boxes.
template <typename Rule>
concept BoxRule = requires { typename Rule::template Memory<double, 1>; };

/// A box, and what a rule remembers beside it.
template <typename Scalar_, int n, typename Memory>
struct BoxBelief {
  using Scalar = Scalar_;               ///< of the box
  Box<Scalar, n> box;                   ///< the states that are possible
  [[no_unique_address]] Memory memory;  ///< of the rule

  /// Centre of the box, the conditional mean (2.31). NaN where a bound is missing.
  [[nodiscard]] Vector<Scalar, n> x() const { return box.centre(); }
  /// Of a union of boxes: its parts, as long as the belief stays as it is.
  [[nodiscard]] auto parts() const
    requires requires(const Memory& m, const Box<Scalar_, n>& b) { m.parts(b); }
  {
    return memory.parts(box);
  }
};

/// The method of a box.
///
///     jml::Filter filter{jml::Guaranteed{}, Pendulum{}, jml::Box{lower, upper}};
///     const auto report = filter.step(AngleSensor{}, y);      // filter.box(), filter.x() its centre
///
/// The model states disturbance_bound() and noise_bound(). Without a box, jml::Filter{jml::Guaranteed{},
/// Pendulum{}}, the first measurements make it, eqs. (2.13) and (2.16): a state without a bound is infinite
/// on that side, and no step is possible until it is measured with update(). A measurement that contradicts
/// the bounds is reported and not used: report.violation, and the predicted box stays. Refused beside bad
/// input: invalid_box, state_unbounded, invalid_disturbance_bound, invalid_noise_bound.
template <BoxRule Rule_>
struct BoundedNoise : Rule_ {
  /// What filter/method.hpp asks of a method.
  /// @{
  using Rule = Rule_;
  static constexpr bool begins_as_prior = true;
  template <typename Scalar, typename D>
  using Model = PlainDynamics<D>;
  template <typename Scalar, typename D>
  using Belief = BoxBelief<Scalar, states_of<D>, typename Rule::template Memory<Scalar, states_of<D>>>;
  template <typename Scalar, typename D>
  using Start = Box<Scalar, states_of<D>>;
  template <typename Scalar, typename D, typename S>
  using Report = BoundedReport<Scalar, measurements_of<S>>;

  constexpr BoundedNoise() = default;
  /// A rule stands for its method.
  constexpr BoundedNoise(const Rule& rule) : Rule(rule) {}  // NOLINT(google-explicit-constructor): the same

  template <typename D>
  static consteval bool accepts() {
    return detail::require_discrete<D>() && detail::require_flat<D>();
  }

  /// invalid_box: a NaN, or a lower bound above its upper one.
  template <typename Model, typename Scalar, int m, typename Belief>
  [[nodiscard]] Status start(const Model&, const Box<Scalar, m>& box, Belief& belief) const {
    static_assert(requires { belief.box = box; }, "jml: the box has not as many states as the dynamics");
    belief = {};
    belief.box = box;
    return box.valid() ? Status::ok : Status::invalid_box;
  }
  template <typename Model, typename Belief>
  [[nodiscard]] Status start(const Model&, Belief& belief) const {
    belief = {};
    return Status::ok;
  }

  template <typename Model, typename Belief, typename At>
  [[nodiscard]] JML_INLINE Status predict(const Model& model, const Belief& /*prior*/, const At& at,
                                          Belief& next) const {
    return Rule::move(model.dynamics, next.box, next.memory, at);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  JML_INLINE void correct(const Model&, const Belief& /*prior*/, const Sample& sample, Belief& next,
                          Report& report) const {
    cut(sample.sensor, sample.y, sample.at, next, report);
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  JML_INLINE void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
                       Report& report) const {
    report.status = predict(model, prior, sample.at, next);
    if (report.status == Status::ok) cut(sample.sensor, sample.y, end_of(sample.at), next, report);
  }
  /// @}

 private:
  /// A measurement that contradicts leaves the belief as it was.
  template <typename S, typename Y, typename At, typename Belief, typename Report>
  JML_INLINE static void cut(const S& sensor, const Y& y, const At& at, Belief& belief, Report& report) {
    if (!all_finite(y)) {
      report.status = Status::invalid_measurement;
    } else if constexpr (Rule::contradiction_changes_nothing) {
      Rule::cut(sensor, belief.box, belief.memory, y, at, report);
    } else {
      const Belief before = belief;
      Rule::cut(sensor, belief.box, belief.memory, y, at, report);
      if (report.status == Status::accepted_without_measurement) belief = before;
    }
  }
};

template <typename Rule>
struct PartsOf<BoundedNoise<Rule>> : PartsOfBase<BoundedNoise<Rule>, Rule> {};

template <BoxRule Rule>
struct MethodOf<Rule> {
  using type = BoundedNoise<Rule>;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
