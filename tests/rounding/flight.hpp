// SPDX-License-Identifier: BSD-3-Clause
// The judge's own flight of a problem: what is exact after each verb, how hard it was to get there, and whether what
// a filter shows is right.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "rounding/exact_filter.hpp"
#include "rounding/problems.hpp"

namespace rounding {

/// What is called right.
struct Bounds {
  double P = 1e-3;          ///< in every direction, relative
  double x = 1e-6;          ///< standard deviations
  bool by_factors = false;  ///< P is shown by factors: see exact_filter.hpp for singular ones
};
inline constexpr Bounds dense_bounds{1e-3, 1e-6, false}, factored_bounds{1e-5, 1e-6, true};
inline constexpr double singular_from = 1e28, factors_wide_from = 1e20;

/// What a filter shows: x, and P in all digits that it is made of.
struct Shown {
  QuadVector x{};
  QuadMatrix P{};
};

struct Errors {
  double P = 0, x = 0;
  [[nodiscard]] bool right(const Bounds& bounds) const { return P <= bounds.P && x <= bounds.x; }
};

class Flight {
 public:
  /// The state after one operation, a move or one row.
  struct Stage {
    Moments exact;
    QuadMatrix P{};
    double scale = 0;   ///< the largest |x| so far
    Condition here;
    double label = 1;   ///< the largest condition of P so far, after each verb of a filter
    double inner = 1;   ///< the same after each row, those inside of a verb too
    double loss = 1;    ///< the largest condition of a step so far: what cancelled counts too, in R as well
    bool singular = false;
  };

  explicit Flight(const Problem& problem)
      : problem_(problem), B_(problem.noise_root()), epsilon_(problem.single ? 0x1p-23 : 0x1p-52) {
    Moments start = at_start();
    push(start, true, 1);
    for (const Event& event : problem.events) {
      Place place;
      if (event.moves) ops_.push_back({true, {}, {}});
      place.moved = place.end = static_cast<int>(ops_.size());
      if (event.rows != Rows::none) {
        const auto& sensor = problem.sensors[static_cast<std::size_t>(event.sensor)];
        std::array<double, most_rows * most_rows> R{};
        const int p = problem.p;
        for (int i = 0; i < p; ++i) {
          for (int j = 0; j < p; ++j)
            R[i * p + j] = i == j || event.rows == Rows::together ? sensor.R[static_cast<std::size_t>(i * p + j)] : 0;
        }
        for (const ExactRow& row : independent_rows(sensor.H.data(), R.data(), event.y.data(), p, problem.n))
          ops_.push_back({false, row, {}});
        place.end = static_cast<int>(ops_.size());
      }
      const int first = static_cast<int>(stages_.size()) - 1;
      for (int i = first; i < place.end; ++i) {
        do_op(start, ops_[static_cast<std::size_t>(i)], 0);
        ops_[static_cast<std::size_t>(i)].size = start.size;
        const bool shown = i + 1 == place.end || event.rows == Rows::apart || (i + 1 == place.moved && !event.fused);
        push(start, shown, 1 / ops_[static_cast<std::size_t>(i)].row.cancelled);
      }
      places_.push_back(place);
    }
    bool wide_factors = false, singular = false;
    for (const Stage& stage : stages_) {
      singular = singular || stage.singular;
      wide_factors = wide_factors || stage.inner > factors_wide_from;
    }
    if (wide_factors || singular) fly_wide(share(factored_bounds), wide_factors_);
    if (singular) fly_wide(share(dense_bounds), wide_dense_);
  }

  // Stages, by number: the prior, after the move of an event, after its row i, after all of it.
  [[nodiscard]] static int prior() { return 0; }
  [[nodiscard]] int moved(int event) const { return places_[static_cast<std::size_t>(event)].moved; }
  [[nodiscard]] int row(int event, int i) const { return moved(event) + 1 + i; }
  [[nodiscard]] int end(int event) const { return places_[static_cast<std::size_t>(event)].end; }
  [[nodiscard]] int events() const { return static_cast<int>(places_.size()); }
  [[nodiscard]] const Stage& stage(int i) const { return stages_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Stage& last() const { return stages_.back(); }

  /// How far `shown` is from right after that stage. `scale`: a state that x was made of, if it is larger than those
  /// of the filter.
  [[nodiscard]] Errors errors(const Shown& shown, int i, const Bounds& bounds, double scale = 0) const {
    const Stage& exact = stage(i);
    return {covariance_error(shown.P, exact.P, width(i, bounds)),
            state_error(shown.x, exact.exact, 64 * epsilon_ * std::max(scale, exact.scale), bounds.x)};
  }

  /// The same of the state after that stage, given all measurements up to `until`: `stage` and `until` end an event.
  [[nodiscard]] Errors smoothed_errors(const Shown& shown, int i, int until, const Bounds& bounds,
                                       double larger = 0) const {
    const Moments exact = smoothed(i, until, 0, stage(i).exact);
    bool singular = condition_of(exact).of_P > singular_from;
    for (int k = i; k <= until; ++k) singular = singular || stage(k).singular;
    const Moments& from = width(i, bounds);
    const bool wide = &from != &stage(i).exact;
    const Moments width = wide || (singular && !wide_dense_.empty())
                              ? smoothed(i, until, share(bounds), wide ? from : wide_dense_[static_cast<std::size_t>(i)])
                              : exact;
    double scale = std::max(larger, stage(until).scale);  // of the filter; what later measurements tell may be larger
    for (int k = 0; k < problem_.n; ++k) scale = std::max(scale, static_cast<double>(fabsq(exact.x[k])));
    return {covariance_error(shown.P, exact.P(), width), state_error(shown.x, exact, 64 * epsilon_ * scale, bounds.x)};
  }
  [[nodiscard]] Moments smoothed(int i, int until) const { return smoothed(i, until, 0, stage(i).exact); }
  /// The largest state of a trajectory: after each of these stages, given all measurements up to `until`.
  [[nodiscard]] double largest(const std::vector<int>& stages, int until) const {
    double out = 0;
    for (const int i : stages) {
      const Moments exact = smoothed(i, until);
      for (int k = 0; k < problem_.n; ++k) out = std::max(out, static_cast<double>(fabsq(exact.x[k])));
    }
    return out;
  }

 private:
  struct Op {
    bool move;
    ExactRow row;
    QuadVector size;
  };
  struct Place {
    int moved = 0, end = 0;
  };

  [[nodiscard]] Quad share(const Bounds& bounds) const {
    const Quad e = 64 * epsilon_;
    return (bounds.by_factors ? e * e : e) / bounds.P;
  }
  [[nodiscard]] const Moments& width(int i, const Bounds& bounds) const {
    const Stage& exact = stage(i);
    const auto k = static_cast<std::size_t>(i);
    if (bounds.by_factors)
      return !wide_factors_.empty() && (exact.inner > factors_wide_from || exact.singular) ? wide_factors_[k] : exact.exact;
    return exact.singular ? wide_dense_[k] : exact.exact;
  }

  [[nodiscard]] Moments at_start() const {
    Moments start;
    start.n = problem_.n;
    for (int i = 0; i < problem_.n; ++i) start.x[i] = problem_.x0[static_cast<std::size_t>(i)];
    start.S = problem_.prior_root();
    start.set_sizes();
    return start;
  }
  void do_op(Moments& moments, const Op& op, Quad wide) const {
    if (op.move)
      moments.predict(problem_.F.data(), B_, wide);
    else
      moments.measure(op.row, wide);
  }
  void push(const Moments& moments, bool shown, double condition_of_noise) {
    Stage stage;
    if (!stages_.empty()) {
      const Stage& before = stages_.back();
      stage.scale = before.scale;
      stage.label = before.label;
      stage.inner = before.inner;
      stage.loss = before.loss;
    }
    stage.exact = moments;
    stage.here = condition_of(moments);
    for (int i = 0; i < problem_.n; ++i)
      stage.scale = std::max(stage.scale, static_cast<double>(fabsq(moments.x[i])));
    stage.inner = std::max(stage.inner, stage.here.of_P);
    stage.loss = std::max({stage.loss, stage.here.of_step, condition_of_noise});
    stage.singular = stage.here.of_P > singular_from;
    for (int i = 0; i < problem_.n; ++i)
      stage.singular = stage.singular || (moments.cancelled && moments.known(i));
    if (stage.singular) stage.inner = infinite;
    if (shown) {
      stage.P = moments.P();
      stage.label = std::max(stage.label, stage.singular ? infinite : stage.here.of_P);
    }
    stages_.push_back(stage);
  }
  void fly_wide(Quad share, std::vector<Moments>& out) const {
    Moments moments = at_start();
    moments.widen(share);
    out.push_back(moments);
    for (const Op& op : ops_) {
      do_op(moments, op, share);
      out.push_back(moments);
    }
  }

  /// `wide`: the share of each operation's sizes, as in the flight that `from` comes from.
  [[nodiscard]] Moments smoothed(int i, int until, Quad wide, Moments from) const {
    Information later;
    later.n = problem_.n;
    const Quad root = sqrtq(wide);
    for (int k = until; k > i; --k) {
      const Op& op = ops_[static_cast<std::size_t>(k - 1)];
      if (wide > 0) {
        QuadVector d{};
        for (int j = 0; j < later.n; ++j) d[j] = root * op.size[j];
        later.widen(d);
      }
      if (op.move)
        later.pass(problem_.F.data(), B_);
      else
        later.add(op.row);
    }
    for (int r = 0; r < later.n; ++r) {
      ExactRow row;
      for (int j = 0; j < later.n; ++j) row.h[j] = later.M[r][j];
      row.y = later.M[r][later.n];
      row.r = 1;
      from.measure(row, 0);
    }
    from.set_sizes();
    return from;
  }

  const Problem& problem_;
  QuadMatrix B_;
  double epsilon_;
  std::vector<Op> ops_;
  std::vector<Stage> stages_;
  std::vector<Place> places_;
  std::vector<Moments> wide_factors_, wide_dense_;
};

}  // namespace rounding
