// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The minimum of J within bounds, by rounds of the method of multipliers (interval/bounds.hpp), each a
/// minimisation by interval/minimise.hpp.
///
/// A round leaves 1/(1 + ρ h) of the error of a multiplier, h the variance of its number given all data and
/// the other bounds that act. ρ = strength / P_ii, P of the filter linearised about the nominal, so that
/// nothing depends on units; strength grows where a round does too little.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/bounds.hpp>
#include <jml/interval/minimise.hpp>

namespace jml::detail {

/// What the bounds say of the nominal of an AugmentedStore.
template <typename Scalar>
struct BoundCheck {
  Scalar outside = 0;    // how far the farthest number is, in deviations
  Scalar moved = 0;      // the largest |Δμ| / ρ: the same, and how far one at a bound is from it
  bool blocked = false;  // one is outside that nothing can move
  bool crossed = false;  // one is outside by whatever it be
  bool acting = false;   // some multiplier is not zero

  /// One number: its weight, and by how much it is off, rounding aside.
  void note(Scalar weight, Scalar strength, Scalar out, Scalar change, Scalar rounding) {
    crossed = crossed || out > Scalar(0);
    if (!(weight > Scalar(0))) {
      blocked = blocked || out > Scalar(256) * rounding;
      return;
    }
    const Scalar deviation = std::sqrt(strength / weight);
    outside = std::max(outside, (out - rounding) / deviation);
    moved = std::max(moved, (change - rounding) / deviation);
  }
  /// m numbers; μ ← ρ e where `renew`.
  template <int m, typename Number>
  void look(Multipliers<Scalar, m>& at, const Vector<Scalar, m>& lower, const Vector<Scalar, m>& upper,
            const Number& number, Scalar strength, bool renew) {
    for (int i = 0; i < m; ++i) {
      const Scalar v = number(i), e = at.excess(i, v, lower(i), upper(i)), weight = at.weight(i);
      const Scalar rounding = Scalar(16) * std::numeric_limits<Scalar>::epsilon() * std::abs(v);
      const Scalar change = weight > Scalar(0) ? std::abs(e - at.value(i) / weight) : Scalar(0);
      note(weight, strength, std::abs(v - within(v, lower(i), upper(i))), change, rounding);
      if (renew) at.value(i) = weight * e;
      acting = acting || std::abs(at.value(i)) > Scalar(0);
    }
  }
};

/// `renew`: with new multipliers.
template <typename View, typename Scalar>
[[nodiscard]] BoundCheck<Scalar> check_bounds(View& view, Scalar strength, bool renew) {
  BoundCheck<Scalar> check;
  const auto now = static_cast<std::size_t>(view.now());
  const auto& bounds = view.bounds();
  for (int j = 0; j <= view.last(); ++j) {
    auto& at = view.multipliers(j);
    const auto& node = view.node(j);
    check.look(at.x, bounds.lower, bounds.upper, [&](int i) { return node.x[now](i); }, strength, renew);
    if constexpr (View::q > 0) {
      if (j == 0) continue;
      const auto w = Vector<Scalar, View::q>(at.root * node.b[now]);
      check.look(at.w, bounds.w_lower, bounds.w_upper, [&](int i) { return w(i); }, strength, renew);
    }
  }
  return check;
}

/// ρ of a number whose variance is known, and of others of its kind the least.
template <typename Scalar>
[[nodiscard]] Scalar weight_of(Scalar variance, Scalar least, Scalar lower, Scalar upper, Scalar value,
                               Scalar strength) {
  if (std::isinf(lower) && std::isinf(upper)) return Scalar(0);
  if (std::isinf(variance)) variance = least;
  if (std::isinf(variance)) variance = (upper - lower) * (upper - lower);
  if (std::isinf(variance)) variance = Scalar(1) + value * value;
  const Scalar rounding = Scalar(64) * std::numeric_limits<Scalar>::epsilon() * value;
  return variance > rounding * rounding ? strength / variance : Scalar(0);
}

/// Every ρ, by the filter that is linearised about the nominal; `roots`: and every w = L b.
template <typename View, typename Scalar>
JML_NOINLINE void weigh_bounds(View& view, const Loss& loss, Scalar strength, bool roots) {
  constexpr int n = View::n;
  const auto now = static_cast<std::size_t>(view.now());
  const auto& bounds = view.bounds();
  auto& inside = view.inside();
  Vector<Scalar, n> least = kernel::filled<Vector<Scalar, n>>(std::numeric_limits<Scalar>::infinity());
  FactoredBelief<Scalar, n> belief;
  commit(belief, inside.start());
  for (int j = 0; j <= view.last(); ++j) {
    if (roots) view.take_root(j);
    if (j > 0) static_cast<void>(linearised_step(inside, j, belief));
    static_cast<void>(linearised_correction(inside, j, loss, belief));
    auto& at = view.multipliers(j);
    for (int i = 0; i < n; ++i) {
      at.x.weight(i) = belief.variances(i);
      if (belief.variances(i) > Scalar(0)) least(i) = std::min(least(i), belief.variances(i));
    }
    for (int k = 0; k < View::q && j > 0; ++k) {
      Scalar variance = 0;
      for (int c = 0; c < View::q; ++c) variance += at.root(k, c) * at.root(k, c);
      at.w.weight(k) =
          weight_of(variance, variance, bounds.w_lower(k), bounds.w_upper(k), Scalar(0), strength);
    }
  }
  for (int j = 0; j <= view.last(); ++j) {
    auto& of = view.multipliers(j).x;
    for (int i = 0; i < n; ++i) {
      of.weight(i) = weight_of(of.weight(i), least(i), bounds.lower(i), bounds.upper(i),
                               view.node(j).x[now](i), strength);
      if (!(of.weight(i) > Scalar(0))) of.value(i) = Scalar(0);
    }
  }
}

/// Minimises J within the bounds of `view` from its nominal and its multipliers, which become those of the
/// answer; as minimise() but for `most`, how many backward passes there may be where a bound acts. The
/// nominal keeps within the bounds to the tolerance, in deviations. no_feasible_point: no trajectory does.
template <typename View>
[[nodiscard]] BatchReport<typename View::Number> minimise_within(View& view, const BatchOptions& given,
                                                                 bool feasible, bool once, int most) {
  using Scalar = typename View::Number;
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  const Scalar first = 100, middle = Scalar(1) / std::sqrt(epsilon),
               last = middle * std::sqrt(middle);  // of the strength
  const Scalar tolerance =
      std::max(static_cast<Scalar>(given.tolerance), std::max(Scalar(1e-9), Scalar(1e3) * epsilon));
  BatchOptions options = given;
  constexpr bool linear = all_linear<typename View::Dynamics, typename View::Sensors>;
  options.newton = given.newton && !linear;
  BatchReport<Scalar> report;
  int passes = 0;
  if (!feasible) {
    const auto now = static_cast<std::size_t>(view.now());
    for (int j = 0; j <= view.last(); ++j) clip(view.bounds(), view.node(j).x[now]);
  } else if (!check_bounds(view, first, false).acting) {
    for (int j = 0; j <= view.last(); ++j) view.forget_weights(j);
    report = minimise(view, options, feasible, once);
    if (!usable(report.status) || !check_bounds(view, first, false).crossed) return report;
    passes = report.iterations;
    // A bent J may be crossed far away: back to where it was begun.
    if constexpr (!linear && requires { view.inside().restore(); }) view.inside().restore();
  }
  Scalar strength = first, moved = std::numeric_limits<Scalar>::infinity(), outside = moved;
  int stuck = 0;
  for (int round = 0; round < 30 && passes < most; ++round) {
    weigh_bounds(view, given.loss, strength, !once);
    options.max_iterations = most - passes;
    report = minimise(view, options, feasible, once);
    passes += report.iterations;
    report.iterations = passes;
    if (!usable(report.status)) return report;
    feasible = true;
    const BoundCheck<Scalar> check = check_bounds(view, strength, true);
    if (check.blocked) return report.status = Status::no_feasible_point, report;
    if (check.moved <= tolerance) return report;
    stuck = check.outside > tolerance && check.outside > outside / Scalar(2) ? stuck + 1 : 0;
    if (stuck > 1 && strength > middle) return report.status = Status::no_feasible_point, report;
    if (check.moved > moved / Scalar(16) || round == 0) strength = std::min(strength * Scalar(16), last);
    moved = check.moved;
    outside = check.outside;
  }
  report.status =
      given.accept_at_limit && moved <= Scalar(1e-3) ? Status::accepted_at_limit : Status::not_converged;
  return report;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
