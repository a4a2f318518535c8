// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An exact step done over again in twice the digits, for the plain and for the factored belief.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored.hpp>
#include <jml/iterated/root_in_two.hpp>

namespace jml::detail {

/// No x_s to linearise at.
template <Motion motion, typename Model>
consteval bool linear_motion() {
  if constexpr (motion == Motion::joint)
    return DynamicsTraits<std::remove_cvref_t<decltype(Model::dynamics)>>::linear;
  else
    return true;
}

/// Of the standard deviations: less is no movement.
template <typename Scalar>
constexpr Scalar still_in_two(const IterationOptions& options) {
  if (options.tolerance > 0) return Scalar(options.tolerance);
  return std::is_same_v<Scalar, float> ? Scalar(1e-4) : Scalar(1e-9);
}

/// Sweeps from `z` until nothing moves; `at`: where the slots are to be evaluated. Half the way back where
/// the criterion (11) has grown.
template <typename Sweeps, typename T, typename Report>
[[nodiscard]] Status find_root_in_two(Sweeps& sweeps, T* z, T* at, Report& report,
                                      typename Sweeps::Sweep& last) {
  using Scalar = typename Sweeps::Scalar;
  constexpr int size = Sweeps::size;
  const IterationOptions& options = sweeps.rule.options;
  const Scalar still = still_in_two<Scalar>(options);
  T base[size];
  Scalar lowest = std::numeric_limits<Scalar>::infinity();
  for (int k = 1; k <= options.max_iterations; ++k) {
    ++report.iterations;
    const Status status = sweeps.sweep(z, last);
    if (status != Status::ok && k == 1) return status;
    const Scalar slack = Scalar(1e-3) * lowest + Scalar(100) * last.floor * last.floor;
    if (!options.accept_at_limit && k > 1 && (status != Status::ok || !(last.cost <= lowest + slack))) {
      for (int i = 0; i < size; ++i) z[i] = base[i] + (z[i] - base[i]) * T(Scalar(0.5));
      continue;
    }
    if (status != Status::ok) return status;
    lowest = last.cost < lowest ? last.cost : lowest;
    for (int i = 0; i < size; ++i) {
      base[i] = at[i] = z[i];
      z[i] = last.z[i];
    }
    if (options.accept_at_limit) continue;
    const Scalar rounding = Scalar(8) * last.floor;
    const bool done =
        sweeps.regular ? last.moved <= std::max(still, rounding) : last.moved <= still && last.still;
    if (!done) continue;
    for (int i = 0; i < size; ++i) at[i] = z[i];
    return Status::ok;
  }
  return options.accept_at_limit ? Status::accepted_at_limit : Status::not_converged;
}

/// ok: the models' own rounding moves x by less than 1e-6 of a standard deviation (float: 2.5e-3) in any
/// direction. accepted_at_rounding: it does, but each state by less than 1e-3 of its deviation or 64 ε of its
/// size. Else not_converged: nobody could tell the root from its neighbours.
template <typename Sweep, typename Scalar, int n, int p>
[[nodiscard]] Status judge_rounding(const Sweep& last, const Vector<Scalar, n>& x,
                                    const Vector<Scalar, n>& variances, const Matrix<Scalar, n, p>& gain) {
  if (last.floor <= iterated_error<Scalar>) return Status::ok;
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  for (int i = 0; i < n; ++i) {
    Scalar error = 0;
    for (int k = 0; k < p; ++k) error += epsilon * std::abs(gain(i, k)) * last.terms(k);
    const Scalar deviation = std::sqrt(variances(i));
    error = std::min(error + last.motion_floor * deviation, last.floor * deviation);
    if (!(error <= std::max(Scalar(1e-3) * deviation, Scalar(64) * epsilon * std::abs(x(i)))))
      return Status::not_converged;
  }
  return Status::accepted_at_rounding;
}

/// x and P of `two` as a dense belief; covariance_lost where a matrix of Scalar cannot hold this P.
template <typename Scalar, typename Belief, typename Report>
  requires requires(Belief& belief) { belief.P(0, 0) = Scalar(0); }
[[nodiscard]] Status store_in_two(const ExtendedStep<Scalar>& two, Belief& next, Report& report) {
  const Scalar now = two.magnification_of_now(), spread = now * now;
  report.rounding = std::numeric_limits<Scalar>::epsilon() * spread;
  if (!two.finite() || !(report.rounding <= iterated_error<Scalar>) ||
      !(two.magnification() <= iterated_error<Scalar> / extended_epsilon<Scalar>))
    return Status::covariance_lost;
  for (int i = 0; i < Belief::states; ++i) {
    next.x(i) = in_two<Scalar>(two.x(i)).high;
    for (int j = 0; j <= i; ++j) next.P(i, j) = next.P(j, i) = in_two<Scalar>(two.P(i, j)).high;
  }
  note_spread(next, spread);
  return Status::ok;
}
template <typename Scalar, int n, typename Report>
[[nodiscard]] Status store_in_two(const ExtendedStep<Scalar>& two, FactoredBelief<Scalar, n>& next, Report&) {
  return store_extended(two, next);
}

/// A step (Motion::none: a correction) from `prior` in twice the digits. A usable status in the report says
/// that next.x and report.smoothed are the root in the digits of Scalar, where the sweeps then begin; where
/// they lead nowhere from there they begin at the prediction.
template <Motion motion, typename Rule, typename Model, typename Prior, typename At, typename Sample,
          typename AtY, typename Report>
JML_NOINLINE Status step_in_two(const Rule& rule, const Model& model, const Prior& prior, const At& at,
                                const Sample& sample, const AtY& at_y, Prior& next, Report& report) {
  using Sweeps = SweepsInTwo<motion, Rule, Model, Prior, At, Sample, AtY>;
  using Scalar = typename Prior::Scalar;
  using T = Extended<Scalar>;
  constexpr int n = Sweeps::n, p = Sweeps::p, size = Sweeps::size, first = Sweeps::first;
  constexpr bool joint = motion == Motion::joint;
  const bool has_root = usable(report.status);
  report.redone = true;
  report.gate = Verdict::off;
  ExtendedMemory<Scalar, n, Sweeps::q, p> memory;
  ExtendedStep<Scalar> two(memory);
  Sweeps sweeps{rule, model, prior, at, sample, at_y, {}, {}, false, {}};

  // The step linearised at the prediction: its innovation, and the gate on it.
  const auto predict = [&](const auto& by) -> Status {
    if (!load_prior(two, prior)) return Status::invalid_covariance;
    if constexpr (motion != Motion::none) return predict_in_two(by, model, prior.x, at, two);
    return Status::ok;
  };
  const auto linearised = [&] {
    if constexpr (joint)
      return Ekf<>{};
    else
      return rule.inner;
  }();
  if (const Status status = predict(linearised); status != Status::ok) return status;
  T start[size], z[size], slots_at[size];
  for (int i = 0; i < n; ++i) {
    if constexpr (joint) start[i] = prior_state(prior, i);
    start[first + i] = two.x(i);
  }
  const Vector<Scalar, n> prediction = Sweeps::half(start + first);
  sweeps.R = noise_covariance(sample.sensor, prediction, at_y);
  RowsFound<Scalar, p> own_rows;
  auto& rows = [&]() -> auto& {
    if constexpr (requires { report.rows; })
      return report.rows;
    else
      return own_rows;
  }();
  rows = {};
  report.status = Status::ok;
  correct_in_two(Ekf<>{}, sample, at_y, two, report, rows);
  if (report.status != Status::ok) return report.status;
  if (report.gate == Verdict::rejected) {
    const Status status = predict(rule.inner);
    return status == Status::ok ? store_in_two(two, next, report) : status;
  }
  sweeps.regular = diagonal_is<Definite::positive>(sweeps.R) && sweeps.R_factor.factor(sweeps.R);

  constexpr bool linear = Sweeps::exact && linear_motion<motion, Model>();
  Status root = Status::ok;
  if constexpr (linear) {  // one sweep is exact; only x_s is not known yet
    report.cost = rows.nis() / Scalar(2);
    report.iterations = 1;
    if constexpr (joint) {
      typename Sweeps::Sweep last;
      if (const Status status = sweeps.sweep(start, last); status != Status::ok) return status;
      report.smoothed = Sweeps::half(last.z);
    }
    if (rule.options.accept_at_limit) root = Status::accepted_at_limit;
  } else {
    typename Sweeps::Sweep last;
    if (const Status status = sweeps.sweep(start, last); status != Status::ok) return status;
    const Scalar start_cost = last.cost;
    const auto seek = [&] {
      root = find_root_in_two(sweeps, z, slots_at, report, last);
      const Scalar slack = Scalar(1e-3) * start_cost + Scalar(100) * last.floor * last.floor;
      if (root == Status::ok && !(last.cost <= start_cost + slack)) root = Status::not_converged;
      return root;
    };
    // A prediction that is stationary need be no minimum: begin beside it, where a sweep leads away from
    // another.
    const bool stationary = last.moved <= Scalar(1e-3);
    const auto beside = [&](T* x) {
      Vector<Scalar, n> variances;
      two.variances(variances.data());
      for (int i = 0; i < n; ++i) {
        const Scalar step = Scalar(0.1) * std::sqrt(variances(i)) / Scalar(i % 2 == 0 ? 1 + i : -1 - i);
        if (std::isfinite(step)) x[i] = x[i] + T(step);
      }
    };
    const auto from_prediction = [&] {
      std::copy(start, start + size, z);
      if (!stationary || predict(linearised) != Status::ok) return;
      beside(z + first);
      if (joint && load_prior(two, prior)) beside(z);
    };
    if (has_root && !rule.options.accept_at_limit) {
      for (int i = 0; i < n; ++i) {
        if constexpr (joint) z[i] = T(report.smoothed(i));
        z[first + i] = T(next.x(i));
      }
      if (seek() != Status::ok) {
        from_prediction();
        (void)seek();
      }
    } else {
      from_prediction();
      (void)seek();
    }
    if (!usable(root)) return root;
    report.residual = last.moved;
    report.cost = root == Status::ok && sweeps.regular ? last.cost : std::numeric_limits<Scalar>::quiet_NaN();

    // N, P and K once, with the slots at the root.
    if (const Status status = sweeps.predict(rule.inner, slots_at, two); status != Status::ok) return status;
    const Matrix<Scalar, p, n> H = sensor_slot<Rule::Inner::D>(
        rule.inner, sample.sensor, Sweeps::half(slots_at + first), prediction, at_y);
    if (!all_finite(H)) return Status::sensor_not_finite;
    const Vector<Scalar, p> none = kernel::zeros<Vector<Scalar, p>>();
    Vector<Scalar, n> high, low, variances;
    for (int i = 0; i < n; ++i) {
      const auto part = in_two<Scalar>(z[first + i]);
      high(i) = part.high;
      low(i) = part.low;
    }
    const RowsReport used =
        two.correct(H.data(), sweeps.R.data(), none.data(), false, last.terms.data(), nullptr);
    if (used.status != Status::ok) return used.status;
    if (diagonal_is<Definite::positive>(sweeps.R)) two.gain(report.gain.data());
    two.load_state(high.data(), low.data());
    two.variances(variances.data());
    if (root == Status::ok) root = judge_rounding(last, high, variances, report.gain);
    if (!usable(root)) return root;
    if constexpr (joint) report.smoothed = Sweeps::half(z);
  }
  const Status stored = store_in_two(two, next, report);
  if (stored != Status::ok) return stored;
  if constexpr (!joint) report.smoothed = next.x;
  return root;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
