// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What stability_region() is asked, and the words for what limits its answer.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/characteristic.hpp>
#include <jml/solve/cvode.hpp>
#include <vector>

namespace jml {

/// What ended or limited a region of stability.
enum class StabilityLimit : std::uint8_t {
  none,         ///< nothing: the wanted level was reached
  condition,    ///< dS/dt of the filter is not negative
  covariance,   ///< V(x) does not exist, or exceeds the limit set
  box,          ///< the level set touches the box
  fold,         ///< the manifold ceases to be a graph over x
  resolution,   ///< rays or levels used up
  integration,  ///< CVODE refused
  no_start,     ///< no steady filter at the origin, or options out of range
};

/// One word for a log.
[[nodiscard]] constexpr const char* describe(StabilityLimit limit) {
  switch (limit) {
    case StabilityLimit::none:
      return "the wanted level";
    case StabilityLimit::condition:
      return "the condition";
    case StabilityLimit::covariance:
      return "V(x)";
    case StabilityLimit::box:
      return "the box";
    case StabilityLimit::fold:
      return "a fold of the manifold";
    case StabilityLimit::resolution:
      return "the resolution";
    case StabilityLimit::integration:
      return "the integration";
    case StabilityLimit::no_start:
      return "no start at the origin";
  }
  return "unknown";
}

/// box: half widths, n, in the units of x, > 0. The rest has defaults that suit most models.
template <int n>
struct StabilityOptions {
  Vector<double, n> box = kernel::zeros<Vector<double, n>>();      ///< half widths
  double largest_level = std::numeric_limits<double>::infinity();  ///< of S; the continuation ends there
  double start = 1e-3;  ///< radius of the first ellipsoid, relative to the largest one in the box; halved
                        ///< until H is 1e-4 of its terms there
  double level_ratio = 1.15;                ///< from one level of S to the next
  double largest_gap = n == 3 ? 0.3 : 0.1;  ///< between neighbours on the mesh, relative to its size
  double beyond = 1.5;  ///< the continuation goes on to this multiple of a level at which the condition fails
  int refinements = 4;  ///< halvings of the gap round the ray that limits the region
  int max_rays = n == 3 ? 4000 : 1000;                        ///< characteristics at most
  int max_levels = 400;                                       ///< level sets at most
  double largest_covariance = 1e4;                            ///< of V(x), relative to V(0)
  CvodeOptions integrator{CvodeMethod::adams, 1e-10, 1e-12};  ///< of the characteristics, Adams
};

/// Everything finite and in its range.
template <int n>
[[nodiscard]] bool valid(const StabilityOptions<n>& o) {
  return (o.box.array() > 0).all() && all_finite(o.box) && o.largest_level > 0 && o.start > 0 &&
         o.start < 1 && o.level_ratio > 1 && o.level_ratio <= 4 && o.largest_gap > 0 && o.largest_gap < 2 &&
         o.beyond >= 1 && o.refinements >= 0 && o.refinements <= 20 && o.max_rays > 2 * n &&
         o.max_levels > 0 && o.largest_covariance > 1 && valid(o.integrator);
}

/// A characteristic: one point a level, the first at level number `first`.
template <int n>
struct StabilityRay {
  std::size_t first = 0;                  ///< the level number of points[0]
  std::vector<StabilityPoint<n>> points;  ///< from the inside to the outside
};

}  // namespace jml
#include <jml/warnings_end.hpp>
