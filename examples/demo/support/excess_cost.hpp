// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <jml/jml.hpp>
#include <limits>

namespace demo {

/// How far the answer's cost is above that of the exact JML step from the same prior. For a symmetric prior
/// the exact step has the least cost there is; for a nonsymmetric one its root is no minimum, and the
/// difference may be negative.
template <typename D, typename S, int n, int p>
double excess_cost(double cost, const D& d, const S& s, const jml::Estimate<double, n>& prior,
                   const jml::Vector<double, p>& y) {
  const auto exact = jml::step(jml::IteratedJml{}, d, s, prior, y);
  return jml::usable(exact.report.status) ? cost - exact.report.cost
                                          : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace demo
