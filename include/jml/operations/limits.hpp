// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What x and P of a filter may be: limits on the state are watched, floors and ceilings of variances and a
/// bound on correlations are kept.
#include <jml/warnings_begin.hpp>
#pragma once

#include <bitset>
#include <jml/filter/filter.hpp>
#include <jml/filter/way_out.hpp>

namespace jml {

/// Limits of an estimate with `states` numbers and n degrees of freedom; by default there are none.
template <int states, int n = states>
struct Limits {
  static constexpr double infinity = std::numeric_limits<double>::infinity();        ///< no limit
  Vector<double, states> lower = kernel::filled<Vector<double, states>>(-infinity);  ///< of x: watched only
  Vector<double, states> upper = kernel::filled<Vector<double, states>>(infinity);   ///< of x: watched only
  Vector<double, n> least_variance = kernel::zeros<Vector<double, n>>();             ///< of P_ii, units of x²
  Vector<double, n> most_variance = kernel::filled<Vector<double, n>>(infinity);     ///< of P_ii, units of x²
  double most_correlation = 1;  ///< of |P_ij|/√(P_ii P_jj), in (0, 1]

  /// In their range, no NaN, least ≤ most.
  [[nodiscard]] bool valid() const {
    bool good = most_correlation > 0 && most_correlation <= 1;
    for (int i = 0; i < states; ++i) good = good && lower(i) <= upper(i);
    for (int i = 0; i < n; ++i)
      good = good && least_variance(i) >= 0 && least_variance(i) < infinity &&
             least_variance(i) <= most_variance(i) && most_variance(i) > 0;
    return good;
  }
};

/// What was found beyond its limits. status: invalid_option of Limits that are none; covariance_lost where P
/// is not finite; else what Filter::rescale() answered, ok where P needed no change.
template <int states, int n>
struct Kept {
  Status status = Status::ok;   ///< ok, or why P was left as it was
  std::bitset<states> outside;  ///< x_i is below its lower limit, above its upper one, or a NaN
  std::bitset<n> raised;        ///< P_ii was below its floor
  std::bitset<n> lowered;       ///< P_ii was above its ceiling
  std::bitset<n> decorrelated;  ///< state i was correlated too strongly with another one

  /// Something was beyond its limits.
  [[nodiscard]] bool any() const {
    return status != Status::ok || outside.any() || raised.any() || lowered.any() || decorrelated.any();
  }
};

namespace detail {
template <typename F>
concept CarriesCovariance =
    Loosens<typename F::Belief, typename F::State::Scalar, F::degrees> &&
    requires(F& filter) { requires std::remove_cvref_t<decltype(filter.method())>::symmetric; };
}  // namespace detail

/// Watches x and keeps P of a filter within its limits: P ← S P S + diag(v), which stays a covariance.
///   above its ceiling   s_i = √(most/P_ii): the state keeps its correlations
///   |ρ| above its bound s_i² ← s_i² most/|ρ|, and what is missing in P_ii is put back: every correlation of
///                       the state shrinks by s_i
///   below its floor     v_i = least - P_ii: its correlations shrink
/// A window begins anew where P is changed. Of a symmetric method; of a nonsymmetric rule P is no covariance,
/// and only x is watched.
template <typename F, int states, int n>
Kept<states, n> keep_within(F& filter, const Limits<states, n>& limits) {
  using Scalar = typename F::State::Scalar;
  static_assert(states == F::states && n == F::degrees,
                "jml: Limits<states, degrees> of another size than the filter's state");
  Kept<states, n> kept;
  if (!limits.valid()) {
    kept.status = Status::invalid_option;
    return kept;
  }
  const auto& x = filter.x();
  for (int i = 0; i < states; ++i) {
    const auto value = static_cast<double>(x(i));
    kept.outside[static_cast<std::size_t>(i)] = !(value >= limits.lower(i) && value <= limits.upper(i));
  }
  if constexpr (detail::CarriesCovariance<F>) {
    const Matrix<Scalar, n, n> P = filter.P();
    if (!all_finite(P)) {
      kept.status = Status::covariance_lost;
      return kept;
    }
    Vector<Scalar, n> factor = kernel::filled<Vector<Scalar, n>>(Scalar(1));
    Vector<Scalar, n> added = kernel::zeros<Vector<Scalar, n>>();
    for (int i = 0; i < n; ++i) {
      const auto bit = static_cast<std::size_t>(i);
      const auto most = static_cast<Scalar>(limits.most_variance(i));
      const auto least = static_cast<Scalar>(limits.least_variance(i));
      Scalar variance = P(i, i), largest = 0;
      if (variance > most) {
        kept.lowered.set(bit);
        factor(i) = std::sqrt(most / variance);
        variance = most;
      }
      for (int j = 0; j < n; ++j) {
        const Scalar size = std::sqrt(P(i, i)) * std::sqrt(P(j, j));
        if (j != i && size > Scalar(0)) largest = std::max(largest, std::abs(P(i, j)) / size);
      }
      const auto bound = static_cast<Scalar>(limits.most_correlation);
      if (bound < Scalar(1) && largest > bound) {
        kept.decorrelated.set(bit);
        factor(i) *= std::sqrt(bound / largest);
        added(i) = variance * (Scalar(1) - bound / largest);
      }
      if (variance < least) {
        kept.raised.set(bit);
        added(i) += least - variance;
      }
    }
    if (kept.raised.any() || kept.lowered.any() || kept.decorrelated.any())
      kept.status = filter.rescale(factor, added);
  }
  return kept;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
