// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a channel does when its gate has shut: a filter that is wrong rejects every measurement that could
/// put it right.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstdint>
#include <jml/linear_algebra.hpp>
#include <jml/status.hpp>
#include <limits>

namespace jml {

/// The way out of a gate that has shut, and what it costs.
enum class Recovery : std::uint8_t {
  report,   ///< none: Channel::shut() says so. The filter stays lost, and no outlier gets in.
  inflate,  ///< P is made larger by Lockout::variances, and the measurement judged again. Outliers of the
            ///< inflated size pass as long as P is large: one or two samples.
  widen,    ///< the measurement is judged again by Lockout::probability. What passes is used with the P that
            ///< was wrong: the filter moves slowly, and believes itself.
  accept,   ///< the measurement is used. One outlier in the wrong place moves the filter by its gain.
};

/// When a gate counts as shut, and what is done then. Off by default.
///
/// `after` bounds what it costs: a burst of fewer outliers in a row never opens the gate. Of outliers at
/// random places, b of them in m samples, a run of a or more has a probability below (m - a + 1) (b/m)^a.
///
/// n: the degrees of freedom of the state where `variances` are given; 0: none.
template <int n = 0>
struct Lockout {
  int after = 0;  ///< measurements in a row that were rejected, or refused for what the filter is; 0: never
  double seconds =
      std::numeric_limits<double>::infinity();  ///< or since the last accepted one, and one rejected
  Recovery recovery = Recovery::report;         ///< what is done
  double probability = 1;                       ///< of the gate, for `widen`
  Vector<double, n> variances =
      kernel::zeros<Vector<double, n>>();  ///< added to P, for `inflate`, ≥ 0; units of x²
  int times = 3;  ///< recoveries at most, `after` measurements apart, until one was accepted

  /// In their range; for Recovery::inflate also with variances.
  [[nodiscard]] bool valid() const {
    bool good = after >= 0 && seconds > 0 && probability > 0 && probability <= 1 && times >= 0;
    for (int i = 0; i < n; ++i) good = good && variances(i) >= 0 && std::isfinite(variances(i));
    return good && (recovery != Recovery::inflate || n > 0);
  }
};

namespace detail {
/// Refused for what the filter is, and not for what it was given.
[[nodiscard]] constexpr bool refused_by_filter(Status status) {
  return status == Status::covariance_lost || status == Status::singular_innovation ||
         status == Status::innovation_indefinite || status == Status::accuracy_not_met ||
         status == Status::contradiction || status == Status::not_converged || status == Status::no_minimum;
}
}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
