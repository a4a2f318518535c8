// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Region of stability of the state-dependent algebraic Riccati filter (component jml::cvode),
/// Proposition 2.1 of McCaffrey 1998, for n = 1, 2, 3.
///
/// The filter without input is ẋ = f(x) - V(x)HᵀR⁻¹h(x), with V(x) from the algebraic equation (9) of the SDC
/// matrices at x. S, with ∂S/∂x = λ, is followed outward along the unstable manifold of (10)
/// (characteristic.hpp, stability_continuation.hpp), from a small ellipsoid with λ = V(0)⁻¹x, S = ½xᵀV(0)⁻¹x.
/// The filter is asymptotically stable on the largest set {S ≤ γ} on which, x ≠ 0,
///   dS/dt = λᵀ(f - VHᵀR⁻¹h) = -½λᵀGQGᵀλ + ½hᵀR⁻¹h - λᵀVHᵀR⁻¹h < 0.
/// The printed (13) drops the first term and is only sufficient. With fewer measurements than states there is
/// a surface h(x) = 0 through the origin, on which (13) reads 0 < 0, and beside it (13) fails strictly: it
/// then certifies nothing at all. Both are reported.
///
/// Even the full condition is borderline where Gᵀλ = 0 and h = 0 meet. That is the origin alone if the two
/// together have rank n there (`definiteness` > 0); otherwise, as for n = 3, p = q = 1, they meet along a
/// line out of the origin beside which the condition can fail at any level, though the filter is stable.
///
/// **Certified by sampling, no proof**: the condition was looked at on `rays` × `levels` points, between
/// levels where a peak shows, and more finely round the ray that fails first. What is narrower than the
/// reported resolution can be missed, and so can a mesh that meets itself without a fold. What the
/// integration and the first ellipsoid may be off is taken from the level.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/autonomous_filter.hpp>
#include <jml/analysis/stability_continuation.hpp>

namespace jml {

/// What stability_region() found.
template <int n>
struct StabilityRegion {
  Status status = Status::ok;  ///< refusal before any continuation, or of what ended it
  Matrix<double, n, n> origin_covariance = kernel::zeros<Matrix<double, n, n>>();  ///< V(0)

  double level = 0;                                     ///< largest γ certified by the full condition
  StabilityLimit limit = StabilityLimit::none;          ///< what keeps γ from being larger
  StabilityPoint<n> limiting_point;                     ///< where, if a point does
  double printed_level = 0;                             ///< largest γ certified by the printed condition (13)
  StabilityLimit printed_limit = StabilityLimit::none;  ///< what keeps printed_level from being larger
  long printed_failures = 0;                            ///< points looked at where (13) failed
  /// Smallest decay rate of S per unit of S of the linear filter at the origin, relative to the mean rate.
  /// 0: borderline directions (above).
  double definiteness = 0;

  /// How far S was followed, whatever the condition said, and what ended that; none: no need to go on.
  double reach = 0;
  StabilityLimit reach_limit = StabilityLimit::none;  ///< what ended that

  std::vector<StabilityRay<n>> rays;        ///< the characteristics that were followed
  std::vector<std::array<int, n>> mesh;     ///< neighbours: numbers of rays, oriented
  std::vector<StabilityPoint<n>> boundary;  ///< of {S ≤ γ}, one for each ray that reaches it

  int levels = 0;          ///< fronts
  double level_ratio = 0;  ///< S of a mesh over S of the one before
  double largest_gap = 0;  ///< between neighbours on a mesh, relative to its size; n = 1: none
  double hamiltonian = 0;  ///< largest relative |H| met, zero in theory: the accuracy of the manifold
};

/// The region of stability of the filter about the origin, where f(0) = 0 and h(0) = 0; G, Q, R constant.
///
/// Refused: options out of range (invalid_option), an origin that is no equilibrium (invalid_state), Q or R
/// invalid, no stabilising V(0), V(0) singular (covariance_lost).
template <ContinuousDynamics D, Sensor S>
[[nodiscard]] StabilityRegion<states_of<D>> stability_region(const D& dynamics, const S& sensor,
                                                             const StabilityOptions<states_of<D>>& options) {
  constexpr int n = states_of<D>;
  static_assert(n <= 3, "jml: the region of stability is for one, two or three states");
  StabilityRegion<n> out;
  out.limit = out.printed_limit = StabilityLimit::no_start;
  const detail::RiccatiFilterModel<D, S> model(dynamics, sensor);
  out.status = valid(options) ? model.status() : Status::invalid_option;
  if (!usable(out.status)) return out;
  out.origin_covariance = model.origin_covariance();
  out.definiteness = model.definiteness();

  detail::StabilityContinuation<D, S> continuation(model, options);
  continuation.run();
  out.levels = continuation.levels;
  out.level_ratio = options.level_ratio;
  out.largest_gap = continuation.largest_gap;
  out.mesh = continuation.mesh.simplices;
  const double certified =
      continuation.first.level * (1 - continuation.level_error(continuation.first.level));
  out.level = std::max(0.0, std::min(certified, options.largest_level));
  if (certified <= options.largest_level) {
    out.limit = continuation.first.limit;
    out.limiting_point = continuation.first.point;
    out.status = continuation.first.status;
  } else {
    out.limit = StabilityLimit::none;
  }
  out.reach = std::min(continuation.without_condition, continuation.level_of(continuation.levels - 1));
  out.reach_limit = continuation.without_condition_limit;
  out.printed_level = out.level;  // what (13) allows, the full condition allows too
  out.printed_limit = out.limit;
  out.printed_failures = continuation.printed_failures;
  if (!model.printed_can_hold()) {
    out.printed_level = 0;
    out.printed_limit = StabilityLimit::condition;
  } else if (continuation.printed_level < out.printed_level) {
    out.printed_level = continuation.printed_level / options.level_ratio;
    out.printed_limit = StabilityLimit::condition;
  }
  if (out.level > 0) {
    for (int i = 0; i < static_cast<int>(continuation.rays.size()); ++i) {
      if (const auto point = continuation.at_level(i, out.level)) out.boundary.push_back(*point);
    }
  }
  out.rays = std::move(continuation.rays);
  for (const auto& ray : out.rays) {
    for (const auto& point : ray.points) out.hamiltonian = std::max(out.hamiltonian, point.hamiltonian);
  }
  return out;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
