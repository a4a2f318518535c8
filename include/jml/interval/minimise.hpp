// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Gauss-Newton with Levenberg-Marquardt damping on the criterion J of an interval, by interval/sweep.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/interval/freeze.hpp>
#include <jml/interval/way_down.hpp>

namespace jml {

/// How J is minimised.
struct BatchOptions {
  int max_iterations = 100;  ///< backward passes, rejected ones included
  /// Stop where the next step would be this long: root mean square over the unknowns, in their posterior
  /// standard deviations. 0 asks for the default, 1e-10 (float: 1e-4).
  double tolerance = 0;
  Loss loss{};  ///< of the measurements
  /// Newton's method: the second derivatives of f and m, in place of Gauss-Newton's model without them, where
  /// that model has a minimum and lowers J. A pass costs more, and far fewer are needed.
  bool newton = true;
  bool accept_at_limit = false;  ///< max_iterations reached is accepted_at_limit and no refusal

  /// In their range.
  [[nodiscard]] bool valid() const {
    return max_iterations > 0 && tolerance >= 0 && tolerance < 1 && loss.valid();
  }
};

/// How a minimisation ended.
template <typename Scalar>
struct BatchReport {
  /// ok: the tolerance is met. accepted_at_rounding: J and its gradient are at the rounding of the states,
  /// above the tolerance. not_converged: out of iterations, or no step lowers J. no_minimum: saddles alone.
  Status status = Status::ok;
  int iterations = 0;  ///< backward passes
  int agreed = 1;      ///< of Start::several: how many starts led to this J, to 1e-6 of it
  int node = -1;       ///< sensor_not_finite: the first node of which a measurement is no number
  Scalar cost = std::numeric_limits<Scalar>::quiet_NaN();  ///< J; NaN where there is none
  /// |∇J| over the whitened unknowns (x_0 in units of P_0^½, w in units of Q^½), 2-norm, at the answer.
  /// Infinite where the model is so unstable over the interval that rounding alone makes it so.
  Scalar gradient = std::numeric_limits<Scalar>::quiet_NaN();
  /// Root mean square of the next step, in posterior standard deviations.
  Scalar step = std::numeric_limits<Scalar>::quiet_NaN();
};

namespace detail {

/// J is a quadratic function: a second sweep that still moves x has to do with rounding alone.
template <typename D, typename List>
inline constexpr bool all_linear = false;
template <typename D, typename... S>
inline constexpr bool all_linear<D, Sensors<S...>> =
    DynamicsTraits<D>::linear && (SensorTraits<S>::linear && ...);

/// |δ|² of the whitened step between the nominal and the trial, which damping alone asks for: a sum in every
/// forward pass costs a tenth of it at n = 2.
template <typename Store>
[[nodiscard]] JML_RARE auto squared_step(Store& store) {
  const auto now = static_cast<std::size_t>(store.now()), next = static_cast<std::size_t>(store.next());
  auto sum = kernel::squared_norm(store.prior().law);
  for (int j = 1; j <= store.last(); ++j) {
    const auto& b = store.node(j).b;
    for (int i = 0; i < static_cast<int>(b[now].size()); ++i)
      sum += (b[next](i) - b[now](i)) * (b[next](i) - b[now](i));
  }
  return sum;
}

/// From the nominal of `store`; `feasible`: it is a trajectory of the model, else a sequence of states.
/// `once`: G, Q, R are frozen already and stay so; else they are frozen at the nominal, until they no longer
/// change with the answer. The nominal ends as the best trajectory found: on any failure it is where it was,
/// or has a lower J.
template <typename Store>
BatchReport<typename Store::Number> minimise(Store& store, const BatchOptions& options, bool feasible,
                                             bool once) {
  using Scalar = typename Store::Number;
  using D = typename Store::Dynamics;
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  const Scalar tolerance = options.tolerance > 0 ? static_cast<Scalar>(options.tolerance)
                                                 : std::max(Scalar(1e-10), Scalar(1e3) * epsilon);
  BatchReport<Scalar> report;
  Sweep<Store> sweep(store, options.loss);
  PassSums<Scalar> sums;
  Scalar change = 0;
  if (!once) report.status = freeze(store, change);
  if (report.status != Status::ok) return report;

  const auto unknowns = static_cast<Scalar>(states_of<D> + store.last() * DynamicsTraits<D>::disturbances);
  constexpr Scalar none = std::numeric_limits<Scalar>::infinity();
  Scalar damping = 0, growth = 4, scale = 1, before = none, bent_decrease = none;
  bool infeasible = !feasible, known = false;
  int saddles = 0;
  int accepted = 0;  // trajectories taken in place of the one before
  Scalar cost_before = std::numeric_limits<Scalar>::quiet_NaN();
  bool in_two = false, exact = false;    // the digits of Scalar do not suffice; they do
  bool newton = false, defined = false;  // defined: some trial has a finite J
  bool slowly = false;                   // Gauss-Newton in twice the digits does not get on
  // In charts the models move with the answer many times: between two of these it need not be closer than
  // they are.
  Scalar loose = InCharts<Store> && !once ? Scalar(1e-2) : Scalar(0);
  // |δ|² C ≈ δᵀCδ: a damping that matters is of the size of C.
  const auto begin_damping = [&] {
    const Scalar step = squared_step(store);
    scale = Scalar(1) + (step > Scalar(0) ? Scalar(2) * sums.decrease / step : Scalar(0));
    if (!std::isfinite(scale)) scale = 1;
    return Scalar(0.1) * scale + Scalar(1);
  };
  report.status = Status::not_converged;
  constexpr int most = std::numeric_limits<int>::max() - 20;  // room for passes beyond the limit
  int limit = std::min(options.max_iterations, most);
  while (report.iterations < limit) {
    ++report.iterations;
    const bool full = (!in_two || slowly) && newton && !infeasible &&
                      sweep.template backward<Curvature::full>(false, damping, sums);
    bool valid = full || (in_two ? sweep.backward_in_two(infeasible, damping, sums)
                                 : sweep.backward(infeasible, damping, sums));
    const bool quiet = valid && epsilon * sums.noise <= most_noise<Scalar>;
    exact = exact || (quiet && infeasible && !in_two);  // the pass from a guess counts closely
    if (!full && !in_two && !quiet && !exact) {
      if (valid && !infeasible) {
        PassSums<Scalar> closely;
        exact = sweep.backward(true, Scalar(0), closely) && epsilon * closely.noise <= most_noise<Scalar>;
      }
      valid = exact ? sweep.backward(false, damping, sums) : sweep.backward_in_two(infeasible, damping, sums);
      in_two = valid && !exact;
    }
    if (!valid) {
      if (!infeasible) {
        // This trajectory cannot be linearised. The one before it could, and is still there.
        const Status why = sweep.diagnose();
        if (accepted > 0) {
          store.flip_back();
          report.cost = cost_before;
          --accepted;
        }
        report.status = once && options.accept_at_limit && accepted > 0 ? Status::accepted_at_limit : why;
        return report;
      }
      // The guess is no place to linearise at: begin at the prediction instead.
      report.cost = sweep.predict();
      if (!std::isfinite(report.cost)) return report.status = sweep.diagnose(), report;
      store.flip();
      infeasible = false;
      known = true;
      continue;
    }
    const bool judged = !(full && in_two);  // a pass whose digits suffice says where it ends
    if (!infeasible) {
      if (!known) report.cost = sums.cost;
      known = true;
      report.step = std::sqrt(Scalar(2) * sums.decrease / unknowns);
      const Scalar floor = Scalar(64) * epsilon * (std::abs(report.cost) + Scalar(1));
      const bool met = judged && damping == Scalar(0) && report.step <= std::max(tolerance, loose);
      if (!judged) bent_decrease = sums.decrease;
      const bool slow = in_two && newton && !all_linear<D, typename Store::List> && bent_decrease > floor;
      const bool at_rounding =
          judged && sums.decrease <= floor && sums.decrease > before / Scalar(4) && !slow;
      if (met || at_rounding) {
        if constexpr (!all_linear<D, typename Store::List>) {
          const bool minimum = full && damping == Scalar(0);  // as the pass just made has shown
          if (!minimum && leave_saddle(sweep, store, report.cost)) {
            if (++saddles > 4) return report.status = Status::no_minimum, report;
            limit = std::max(limit, report.iterations + 20);
            before = none;
            damping = 0;
            newton = false;
            continue;
          }
        }
        report.status = met ? Status::ok : Status::accepted_at_rounding;
        if (once) return report;
        if (const Status status = freeze(store, change); status != Status::ok)
          return report.status = status, report;
        if (!(change > tolerance) && (report.step <= tolerance || at_rounding))
          return report.gradient = sweep.gradient(), report;
        loose = std::min(loose, change / Scalar(20));
        infeasible = true;
        before = none;
        report.status = Status::not_converged;
        continue;
      }
    }
    const Scalar cost = sweep.forward(infeasible);
    defined = defined || std::isfinite(cost);
    // J is right to `rounding` by its own sum, and to less where an ε of some y is a share of its deviation:
    // a step that promises no more than that is taken for what the linearised problem says it is.
    constexpr Scalar share =
        all_linear<D, typename Store::List> || std::is_same_v<Scalar, float> ? Scalar(1e-3) : Scalar(1e-6);
    const Scalar rounding = Scalar(16) * epsilon * std::abs(report.cost) * std::sqrt(unknowns);
    const Scalar noise = share * (Scalar(1) + std::abs(report.cost));
    if (infeasible) {
      report.cost = std::isfinite(cost) ? cost : sweep.predict();
      if (!std::isfinite(report.cost)) return report.status = sweep.diagnose(), report;
      store.flip();
      infeasible = false;
      known = true;
      newton = options.newton;
    } else if (cost <= report.cost + rounding ||
               (sums.decrease <= noise && cost <= report.cost + noise && damping == Scalar(0))) {
      const Scalar damped = damping > Scalar(0) ? damping * squared_step(store) : Scalar(0);
      const Scalar model = sums.decrease + damped / Scalar(2);
      constexpr Scalar few = all_linear<D, typename Store::List> ? Scalar(1) : Scalar(16);
      const Scalar ratio = model <= few * rounding ? Scalar(1) : (report.cost - cost) / model;
      slowly = in_two && !full && !all_linear<D, typename Store::List> && sums.decrease > before / Scalar(64);
      before = judged ? sums.decrease : none;
      if (ratio > Scalar(0.75))
        damping /= Scalar(10);
      else if (ratio < Scalar(0.25))
        damping = damping > Scalar(0) ? damping * Scalar(2) : begin_damping();
      if (damping < Scalar(0.01)) damping = 0;  // C ≥ 1: this is nothing
      store.flip();                             // of three trajectories next() is now another
      cost_before = report.cost;
      report.cost = cost;
      growth = 4;
      newton = options.newton && ratio > Scalar(0.25);  // near enough for its model
      ++accepted;
      if constexpr (all_linear<D, typename Store::List>) {
        const bool left =
            std::sqrt(Scalar(2) * sums.decrease / unknowns) > std::max(tolerance, Scalar(1e3) * epsilon);
        if (once && left && report.iterations >= 2 && limit - options.max_iterations < 6 && limit < most)
          ++limit;
        in_two = in_two || (left && report.iterations >= 2 && options.loss.kind == Loss::Kind::none);
      }
    } else if (full) {
      newton = false;
    } else {
      damping = damping > Scalar(0) ? damping * growth : begin_damping();
      if (damping > Scalar(1e15) * scale) break;
      growth *= 4;
    }
  }
  if (report.status == Status::not_converged && known && !once) {
    // The gradient of the answer, not of the step before it.
    report.gradient = sweep.gradient();
    if (in_two ? sweep.backward_in_two(false, Scalar(0), sums) : sweep.backward(false, Scalar(0), sums))
      report.step = std::sqrt(Scalar(2) * sums.decrease / unknowns);
  }
  if (report.status == Status::not_converged && options.accept_at_limit && (accepted > 0 || defined) &&
      report.iterations >= limit) {
    report.status = once && accepted == 0 ? Status::accepted_at_prediction : Status::accepted_at_limit;
  }
  return report;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
