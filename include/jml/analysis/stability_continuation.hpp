// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The continuation of stability_region.hpp: rays from the origin outward, level by level of S, with new rays
/// where neighbours part.
///
/// A new ray does not start at the origin: directions that part along the continuation were closer there than
/// numbers can tell. It starts midway between its neighbours at the first level where they were 1e-4 apart,
/// where the mean of the two is on the manifold to 1e-9; and what is off the manifold dies out along the
/// flow. S of the mean is that of the cubic through both, S - (λ₂ - λ₁)ᵀ(x₂ - x₁)/8.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/direction_mesh.hpp>
#include <jml/analysis/stability_rays.hpp>

namespace jml {

namespace detail {

template <typename D, typename S>
class StabilityContinuation : public StabilityRays<D, S> {
  using Base = StabilityRays<D, S>;

 public:
  using Base::n;
  using X = typename Base::X;
  using State = typename Base::State;
  using Base::rays, Base::first, Base::levels, Base::level_of;
  static constexpr double parting = 1e-4;

  using Base::Base;

  DirectionMesh<n> mesh;
  double largest_gap = 0;

  void run() {
    double radius = std::numeric_limits<double>::infinity();
    for (int i = 0; i < n; ++i)
      radius = std::min(radius, options_.box(i) / std::sqrt(model_.origin_covariance()(i, i)));
    start_level_ = std::log(0.5) + 2 * std::log(options_.start * radius);
    const auto on_axis = [this](int k) {
      State y = kernel::zeros<State>();
      y(k / 2) = y(n + k / 2) = k % 2 == 0 ? 1 : -1;
      y(2 * n) = start_level_;
      return y;
    };
    for (int halving = 0; halving < 20; ++halving) {  // of a start too far out for the linear filter's S
      double off = 0;
      for (int k = 0; k < 2 * n; ++k) {
        auto V = model_.origin_covariance();
        off = std::max(off, examine(on_axis(k), V).hamiltonian);
      }
      if (off <= 1e-4) break;
      start_level_ -= std::log(4.0);
    }
    for (int k = 0; k < 2 * n; ++k) add_ray(0, on_axis(k));
    levels = 1;
    fill_gaps();
    check_folds();
    while (!ended() && levels < options_.max_levels) {
      ++levels;
      for (int i = 0; i < static_cast<int>(rays.size()); ++i) extend(i);
      if (level_of(levels - 1) > std::min(options_.largest_level, options_.beyond * first.level)) break;
      if (!ended_by_breakdown()) fill_gaps();
      check_folds();
    }
    if (!ended() && level_of(levels - 1) <= std::min(options_.largest_level, options_.beyond * first.level))
      note({StabilityLimit::resolution, level_of(levels - 1), -1, {}, Status::step_limit});
    settle(0);
    for (int round = 0; round < options_.refinements; ++round) {
      const std::size_t before = rays.size();
      refine();
      settle(before);
    }
    if (options_.refinements > 0) settle(0);
  }

 private:
  using Base::add_ray, Base::between, Base::bisect, Base::ended, Base::examine, Base::ended_by_breakdown,
      Base::extend, Base::model_, Base::note, Base::options_, Base::start_level_, Base::state_at,
      Base::verdict;

  static double gap(const State& a, const State& b) {
    const X za = a.template head<n>(), zb = b.template head<n>();
    return (za - zb).norm() / std::max(0.5 * (za.norm() + zb.norm()), 1e-300);
  }

  /// The gap between two rays on the last complete mesh.
  double gap_now(int a, int b) const {
    const State *ya = state_at(a, static_cast<std::size_t>(levels - 1)),
                *yb = state_at(b, static_cast<std::size_t>(levels - 1));
    return ya != nullptr && yb != nullptr ? gap(*ya, *yb) : 0.0;
  }

  /// A ray midway between two; false where there is no room for it.
  bool insert(int a, int b) {
    if (static_cast<int>(rays.size()) >= options_.max_rays) return false;
    for (std::size_t k = 0; k < static_cast<std::size_t>(levels); ++k) {
      const State *ya = state_at(a, k), *yb = state_at(b, k);
      if (ya == nullptr || yb == nullptr) continue;
      if (gap(*ya, *yb) < parting && k + 1 < static_cast<std::size_t>(levels)) continue;
      const State half = 0.5 * (*yb - *ya);
      State y = *ya + half;
      const double share =
          1 - half.template segment<n>(n).dot(half.template head<n>());  // S / S of the level
      if (!(share > 0.1)) return false;
      y.template head<2 * n>() /= std::sqrt(share);
      // On the first mesh, an ellipsoid, its neighbours may be far apart: a point of its own, of the same
      // level.
      y(2 * n) = (*ya)(2 * n) + (k > 0 ? std::log(share) : 0.0);
      const int middle = add_ray(k, y);
      return mesh.split(a, b, middle);
    }
    return false;
  }

  /// The longest edges first, so that triangles keep their shape.
  void fill_gaps() {
    double widest = 0;
    mesh.edges([&](int a, int b) { widest = std::max(widest, gap_now(a, b)); });
    for (double limit = std::max(0.7 * widest, options_.largest_gap);; limit *= 0.7) {
      limit = std::max(limit, options_.largest_gap);
      bool room = true, found = true;
      for (int round = 0; round < 20 && found && room; ++round) {
        found = false;
        mesh.edges([&](int a, int b) {
          if (!room || gap_now(a, b) <= limit) return;
          if (!insert_if_edge(a, b, room)) return;
          found = true;
        });
      }
      if (!room) {
        note({StabilityLimit::resolution, level_of(std::max(0, levels - 2)), -1, {}, Status::step_limit});
        break;
      }
      if (limit <= options_.largest_gap) break;
    }
    mesh.edges([&](int a, int b) { largest_gap = std::max(largest_gap, gap_now(a, b)); });
  }

  /// The edge may be gone since the list was made.
  bool insert_if_edge(int a, int b, bool& room) {
    if (!mesh.has(a, b)) return false;
    room = insert(a, b);
    return room;
  }

  /// Looks at every ray on the level found, and takes the level down where one fails there after all: between
  /// two of its levels it went in and out.
  void settle(std::size_t first_ray) {
    for (int round = 0; round < 20; ++round) {
      bool quiet = true;
      for (std::size_t i = first_ray; i < rays.size(); ++i) {
        const double level = std::min(first.level, options_.largest_level) * (1 - 1e-8);
        if (!(level > 0) || !std::isfinite(level)) return;
        const auto& points = rays[i].points;
        std::size_t from = 0;
        while (from + 1 < points.size() && points[from + 1].level <= level) ++from;
        if (points.empty() || points[from].level > level) continue;
        const int ray = static_cast<int>(i);
        const auto point = between(ray, from, std::log(level));
        if (!point || verdict(*point) == StabilityLimit::none) continue;
        quiet = false;
        bisect(ray, from, std::log(level));
      }
      if (quiet) return;
    }
  }

  /// New rays beside the one that limits the region.
  void refine() {
    if (first.ray < 0 || first.limit == StabilityLimit::integration || first.limit == StabilityLimit::fold)
      return;
    const int limiting = first.ray;
    std::vector<std::array<int, 2>> around;
    mesh.edges([&](int a, int b) {
      if (a == limiting || b == limiting) around.push_back({a, b});
    });
    for (const auto& [a, b] : around) {
      if (mesh.has(a, b) && !insert(a, b)) return;
    }
  }

  /// det[λ, edges] of a simplex keeps its sign as long as the mesh is the level set of a function of x: its
  /// edges are orthogonal to λ, so where λᵀẋ > 0 it can vanish only by a cusp of the mesh.
  void check_folds() {
    for (const auto& simplex : mesh.simplices) {
      Matrix<double, n, n> sides;
      X costate = kernel::zeros<X>();
      bool complete = true;
      for (std::size_t v = 0; v < n; ++v) {
        const State* y = state_at(simplex[v], static_cast<std::size_t>(levels - 1));
        complete &= y != nullptr;
        if (y == nullptr) break;
        costate += y->template segment<n>(n);
        if (v > 0) {
          sides.col(static_cast<int>(v)) =
              y->template head<n>() -
              state_at(simplex[0], static_cast<std::size_t>(levels - 1))->template head<n>();
        } else if (n == 1) {  // no edges: the point itself must move outward
          const State* before = state_at(simplex[0], static_cast<std::size_t>(std::max(0, levels - 2)));
          const double grown = (*y)(0) * std::exp(0.5 * ((*y)(2 * n) - (*before)(2 * n))) - (*before)(0);
          costate(0) = levels > 1 ? grown * ((*before)(0) > 0 ? 1 : -1) : 1;
        }
      }
      if (!complete) continue;
      sides.col(0) = costate;
      if (!(sides.determinant() > 0)) {
        const int last = std::max(0, levels - 2);
        note({StabilityLimit::fold, levels > 1 ? level_of(last) : 0, simplex[0], {}, Status::ok});
        return;
      }
    }
  }
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
