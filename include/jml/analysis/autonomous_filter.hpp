// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The state-dependent algebraic Riccati filter without input, ẋ = f(x) - V(x)HᵀR⁻¹h(x) (McCaffrey 1998, eq.
/// (8) with dy = 0), run until it is at rest or lost: how far beyond a certified region does it still
/// converge? CVODE integrates (component jml::cvode).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/characteristic.hpp>
#include <jml/solve/cvode.hpp>
#include <vector>

namespace jml {

/// How far and how long a run without input goes. |x| is measured by xᵀV(0)⁻¹x.
struct AutonomousRun {
  double converged = 1e-3;      ///< |x| over its start: at rest
  double lost = 1e3;            ///< |x| over its start: gone
  double time_constants = 200;  ///< of the linear filter at the origin; then it counts as not converging
  CvodeOptions integrator{CvodeMethod::bdf, 1e-6, 1e-8, 2000};  ///< BDF, as the filter may be stiff
};

/// How a run without input ended.
struct AutonomousResult {
  bool converged = false;      ///< |x| fell to AutonomousRun::converged of its start
  Status status = Status::ok;  ///< not ok: V(x) ceased to exist on the way, or CVODE refused
  double time = 0;             ///< s
};

namespace detail {

/// ẋ in coordinates where V(0) is the identity, over the size of the start.
template <typename Model>
struct AutonomousEquations {
  static constexpr int n = Model::n;
  const Model& model;
  double size;
  typename Model::Covariance& V;  // where the next solution starts

  Status derivative(double, const double* from, double* to) const {
    const Eigen::Map<const Vector<double, n>> z(from);
    Eigen::Map<Vector<double, n>> out(to);
    const Vector<double, n> x = model.out_of(z * size);
    Vector<double, n> correction;
    const Status status = model.gain(x, V, correction);
    if (!usable(status)) return status;
    out = model.into(model.f(x) - correction) / size;
    return out.allFinite() ? Status::ok : Status::dynamics_not_finite;
  }
};

template <typename Model>
AutonomousResult run_without_input(const Model& model, const typename Model::X& start,
                                   const AutonomousRun& run) {
  constexpr int n = Model::n;
  AutonomousResult out;
  out.status = model.status();
  if (!usable(out.status)) return out;
  Vector<double, n> z = model.into(start);
  const double size = z.norm();
  if (!(run.converged > 0 && run.converged < 1 && run.lost > 1 && run.time_constants > 0)) {
    out.status = Status::invalid_option;
    return out;
  }
  if (!std::isfinite(size)) {
    out.status = Status::invalid_state;
    return out;
  }
  out.converged = size == 0;
  if (out.converged) return out;
  z /= size;
  typename Model::Covariance V = model.origin_covariance();
  const AutonomousEquations<Model> equations{model, size, V};
  CvodeSolver<n> solver(run.integrator);
  const double chunk = 1 / model.pace();
  for (int k = 0; k < static_cast<int>(std::ceil(run.time_constants)); ++k) {
    const auto report = solver.integrate(equations, k * chunk, (k + 1) * chunk, z, true);
    out.status = report.status;
    if (out.status != Status::ok) return out;
    out.time = (k + 1) * chunk;
    if (z.norm() <= run.converged) {
      out.converged = true;
      return out;
    }
    if (z.norm() >= run.lost) return out;
  }
  return out;
}

}  // namespace detail

/// Does the filter without input, started at x, come to the origin?
template <ContinuousDynamics D, typename S>
[[nodiscard]] AutonomousResult run_without_input(const D& dynamics, const S& sensor,
                                                 const Vector<double, states_of<D>>& start,
                                                 const AutonomousRun& run = {}) {
  return detail::run_without_input(detail::RiccatiFilterModel<D, S>(dynamics, sensor), start, run);
}

/// For each of `points` the factor by which it can be scaled before the filter without input no longer
/// converges, to a relative 1e-3: found by doubling, then halving, so that an island of convergence beyond a
/// gap is not seen. `largest_factor` where none was lost up to there; 1 or less where the point itself is.
template <ContinuousDynamics D, typename S>
[[nodiscard]] std::vector<double> convergence_factors(const D& dynamics, const S& sensor,
                                                      const std::vector<Vector<double, states_of<D>>>& points,
                                                      double largest_factor = 16,
                                                      const AutonomousRun& run = {}) {
  const detail::RiccatiFilterModel<D, S> model(dynamics, sensor);
  std::vector<double> out;
  out.reserve(points.size());
  for (const auto& point : points) {
    const auto converges = [&](double factor) {
      return detail::run_without_input(model, Vector<double, states_of<D>>(factor * point), run).converged;
    };
    double below = 0, above = 1;
    while (above < largest_factor && converges(above)) {
      below = above;
      above = std::min(2 * above, largest_factor);
    }
    if (above >= largest_factor && converges(largest_factor)) {
      out.push_back(largest_factor);
      continue;
    }
    for (int halving = 0; halving < 12; ++halving) {
      const double middle = 0.5 * (below + above);
      (converges(middle) ? below : above) = middle;
    }
    out.push_back(below);
  }
  return out;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
