// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The steps of a factored belief in twice the digits (filter/step_in_two.hpp), and whether it has to keep
/// them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored_steps.hpp>
#include <jml/filter/watched.hpp>

namespace jml::detail {

/// How much rounding of an ε of Extended<Scalar> may grow.
template <typename Scalar>
inline constexpr Scalar worst_magnification_in_two =
    worst_magnification<Scalar> * std::numeric_limits<Scalar>::epsilon() / extended_epsilon<Scalar>;

/// The same of x: half of what x may be off by, as of many rows each adds some.
template <typename Scalar>
inline constexpr Scalar worst_surprise_in_two =
    (std::is_same_v<Scalar, float> ? Scalar(1e-4) : Scalar(5e-7)) / extended_epsilon<Scalar>;

/// x, U, D from `two` into `next`; the low parts where they hold digits that will be asked for.
/// An infinite variance that was none before is an overflow. `before`: the magnification of the belief that
/// `two` began with.
template <typename Scalar, int n>
[[nodiscard]] Status store_extended(const ExtendedStep<Scalar>& two, FactoredBelief<Scalar, n>& next,
                                    bool infinite_before = true, Scalar before = 0) {
  if (!two.finite() || two.underflows() || !(two.magnification() <= worst_magnification_in_two<Scalar>))
    return Status::covariance_lost;
  bool unknown = two.combines();
  for (int i = 0; i < n; ++i) {
    const auto x = in_two<Scalar>(two.x(i)), d = in_two<Scalar>(two.D(i));
    next.x(i) = x.high;
    next.x_low(i) = x.low;
    next.D(i) = d.high;
    next.D_low(i) = std::isinf(d.high) ? Scalar(0) : d.low;
    for (int j = 0; j < n; ++j) {
      const auto u = in_two<Scalar>(two.U(i, j));
      next.U(i, j) = u.high;
      next.U_low(i, j) = u.low;
    }
    if (std::isinf(d.high) && !infinite_before) return Status::covariance_lost;
    unknown = unknown || std::isinf(d.high);
  }
  next.magnification = before + two.magnification_of_P();  // a relative error stays, or shrinks
  next.extended = unknown || two.magnification_of_now() > worst_magnification<Scalar> / Scalar(64);
  two.variances(next.variances.data());
  return Status::ok;
}

/// Of a linear m: an ε of y, or of the terms of H x, is more than a deviation of the noise.
template <typename Rule, typename Sample, typename At, typename Scalar, int n>
[[nodiscard]] bool finer_than_its_digits(const Rule& rule, const Sample& sample, const At& at,
                                         const Vector<Scalar, n>& x) {
  constexpr int p = Sample::measurements;
  using S = std::remove_cvref_t<decltype(sample.sensor)>;
  bool finer = false;
  if constexpr (SensorTraits<S>::linear) {
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    const Vector<Scalar, p> R = conditional_variances<Scalar, p>(noise_covariance(sample.sensor, x, at));
    const Matrix<Scalar, p, n> H = sensor_slot<Rule::D>(rule, sample.sensor, x, x, at);
    const Vector<Scalar, p> terms = innovation_sizes(H, x, sample.y);
    for (int i = 0; i < p; ++i) finer = finer || !(epsilon * terms(i) * epsilon <= R(i));
  }
  return finer;
}

/// A prediction over `at` (where `moves`), and the correction with a sample (Unobserved: none) at `at_y`,
/// from `prior` in twice the digits.
template <bool moves, typename Rule, typename Model, typename Scalar, int n, typename At, typename Sample,
          typename AtY, typename Report>
JML_NOINLINE void factored_in_two(const Rule& rule, const Model& model,
                                  const FactoredBelief<Scalar, n>& prior, const At& at, const Sample& sample,
                                  const AtY& at_y, FactoredBelief<Scalar, n>& next, Report& report) {
  constexpr int q = disturbances_in<moves, Model>(), p = measurements_in<Sample>();
  ExtendedMemory<Scalar, n, q, p> memory;
  ExtendedStep<Scalar> two(memory);
  report.redone = true;
  const auto begin = [&]() -> Status {
    two.load(prior.U.data(), prior.D.data(), prior.extended ? prior.U_low.data() : nullptr,
             prior.extended ? prior.D_low.data() : nullptr);
    two.load_state(prior.x.data(), prior.x_low.data());
    if constexpr (moves) return predict_in_two(rule, model, prior.x, at, two);
    return Status::ok;
  };
  report.status = begin();
  if (report.status != Status::ok) return;
  if constexpr (p > 0) {
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    const Scalar given = prior.extended ? Scalar(0) : epsilon * two.magnification_of_now();
    report.rows = {};
    correct_in_two(rule, sample, at_y, two, report, report.rows);
    const bool rejected = report.status == Status::ok && report.gate == Verdict::rejected;
    if (rejected) report.status = begin();
    if (report.status != Status::ok) return;
    // A P in the digits of Scalar is right to `given`; where NIS is of the rounding of y, x is no answer.
    const bool blamed = !(given * std::sqrt(report.rows.nis()) <= plain_error<Scalar>) &&
                        finer_than_its_digits(rule, sample, at_y, prior.x);
    if (!rejected &&
        (blamed || !(two.magnification_of_x(prior.magnification) <= worst_surprise_in_two<Scalar>)))
      return void(report.status = Status::accuracy_not_met);
  }
  bool infinite = false;
  for (int i = 0; i < n; ++i) infinite = infinite || std::isinf(prior.D(i));
  report.status = store_extended(two, next, infinite, prior.magnification);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
