// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Batch with bounds of states and disturbances.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/batch.hpp>
#include <jml/interval/bounded.hpp>

namespace jml {

/// Batch within bounds: after solve() every x(k) is exactly within them, every w(k) too, and J is least among
/// the trajectories that are. P(k) is that of the problem without bounds, see Bounded. invalid_option: bounds
/// that are none. no_feasible_point: no trajectory of the model is within them.
///
///     jml::BoundedBatch batch{Tank{}, jml::sensors<Level>, estimate, {.steps = 1000}, bounds};
template <typename D, typename List, typename Box, typename Scalar_ = double>
class BoundedBatch : public Batch<D, List, Scalar_> {
  using Base = Batch<D, List, Scalar_>;
  static constexpr int n = Base::states, q = Base::disturbances, bounded = Box::disturbances;
  using Multipliers = detail::NodeMultipliers<Scalar_, n, bounded>;
  static_assert(!detail::runs_locally<Recorder<List>, D>(),
                "jml: bounds are of states in ℝⁿ with additive disturbances");
  static_assert(detail::require_bounds<Box, Scalar_, D>());

 public:
  using Scalar = Scalar_;  ///< of the estimate

  /// As of Batch; `by`: bounds of all nodes.
  BoundedBatch(D dynamics, List list, const Estimate<Scalar, n>& prior, Capacity capacity, const Box& by,
               double time = 0)
      : Base(std::move(dynamics), list, prior, capacity, time), bounds(by) {
    const bool sensible = capacity.steps >= 0 && capacity.steps <= detail::most_nodes;
    if (sensible && detail::has_room(sizeof(Multipliers) * (capacity.steps + 1.0)))
      all_.resize(static_cast<std::size_t>(capacity.steps) + 1);
  }

  Box bounds;      ///< of all nodes
  int most = 500;  ///< backward passes where a bound acts, in place of options.max_iterations

  /// As of Batch. invalid_option: bounds that are none, or `most` below 1; memory_full: no room for their
  /// multipliers.
  BatchReport<Scalar> solve() {
    BatchReport<Scalar> report;
    report.status = this->status();
    if (report.status == Status::ok && (!bounds.valid() || most < 1)) report.status = Status::invalid_option;
    if (report.status == Status::ok && all_.empty()) report.status = Status::memory_full;
    if (report.status != Status::ok) return report;
    const auto solve_it = [this] {
      return this->solve_by([this] { return minimise(); },
                            [this](Vector<Scalar, n>& state) { detail::clip(bounds, state); });
    };
    report = solve_it();
    if (this->start != Start::filter || usable(report.status)) return report;
    const int before = report.iterations;
    this->start = Start::prediction;
    report = solve_it();
    this->start = Start::filter;
    report.iterations += before;
    return report;
  }

  /// Within the bounds, n, 0 … steps().
  [[nodiscard]] Vector<Scalar, n> x(int node) const {
    Vector<Scalar, n> out = Base::x(node);
    if (all_.empty()) return out;
    for (int i = 0; i < n; ++i) out(i) = at(node).x.held(i, out(i), bounds.lower(i), bounds.upper(i));
    return out;
  }
  [[nodiscard]] Vector<Scalar, n> x() const { return x(this->steps()); }  ///< of the last node
  /// Of the step after the node, within the bounds, q.
  [[nodiscard]] Vector<Scalar, q> w(int node) const {
    Vector<Scalar, q> out = Base::w(node);
    for (int i = 0; i < bounded; ++i)
      out(i) = at(node + 1).w.held(i, out(i), bounds.w_lower(i), bounds.w_upper(i));
    return out;
  }
  /// Of the bounds of a node's state, positive at an upper one: what J would fall by, per unit that it gives
  /// way; and of the step after the node.
  [[nodiscard]] const Vector<Scalar, n>& multiplier(int node) const { return at(node).x.value; }
  /// See multiplier().
  [[nodiscard]] const Vector<Scalar, bounded>& w_multiplier(int node) const { return at(node + 1).w.value; }

 private:
  [[nodiscard]] auto& at(int j) { return all_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] const auto& at(int j) const { return all_[static_cast<std::size_t>(j)]; }

  [[nodiscard]] BatchReport<Scalar> minimise() {
    auto& store = this->recording();
    using Inside = std::remove_cvref_t<decltype(store)>;
    for (int j = 0; j <= store.last(); ++j) at(j) = {};
    detail::AugmentedStore<Inside, Box> view(store, bounds, all_.data());
    return detail::minimise_within(view, this->options, false, false, most);
  }

  std::vector<Multipliers> all_;
};

/// Types from the arguments.
template <typename D, typename... S, typename Scalar, int n, int m, typename Box>
BoundedBatch(D, Sensors<S...>, const Estimate<Scalar, n, m>&, Capacity, const Box&, double = 0)
    -> BoundedBatch<D, Sensors<S...>, Box, Scalar>;

}  // namespace jml
#include <jml/warnings_end.hpp>
