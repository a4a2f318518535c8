// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The rays of stability_region.hpp: each a characteristic with one point a level, every point put to the
/// test, and a failure traced to the level where it begins.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/stability_options.hpp>
#include <optional>

namespace jml::detail {

template <typename D, typename S>
class StabilityRays {
 public:
  static constexpr int n = states_of<D>;
  using Model = RiccatiFilterModel<D, S>;
  using Flow = Characteristic<Model>;
  using X = typename Model::X;
  using State = typename Flow::State;
  using Point = StabilityPoint<n>;

  /// Something that a ray met, and where.
  struct Event {
    StabilityLimit limit = StabilityLimit::none;
    double level = std::numeric_limits<double>::infinity();
    int ray = -1;
    Point point;
    Status status = Status::ok;
  };

  StabilityRays(const Model& model, const StabilityOptions<n>& options)
      : model_(model), flow_{model}, options_(options) {}

  std::vector<StabilityRay<n>> rays;
  Event first;                                                         ///< the lowest of all events
  double without_condition = std::numeric_limits<double>::infinity();  ///< lowest event of any other kind
  StabilityLimit without_condition_limit = StabilityLimit::none;
  double printed_level = std::numeric_limits<double>::infinity();  ///< first point where (13) failed
  long printed_failures = 0;
  int levels = 0;  ///< fronts complete

  [[nodiscard]] double level_of(int k) const { return std::exp(log_level(k)); }

  /// The point of ray i at a level, from its last point below; empty where the ray does not reach it.
  std::optional<Point> at_level(int i, double level) const {
    const Track& track = tracks_[static_cast<std::size_t>(i)];
    const auto& points = rays[static_cast<std::size_t>(i)].points;
    std::size_t from = 0;
    while (from + 1 < points.size() && points[from + 1].level <= level) ++from;
    if (points.empty() || points[from].level > level) return std::nullopt;
    State y = track.states[from];
    CvodeSolver<2 * n + 1> solver(options_.integrator);
    const Status status = advance(solver, y, std::log(level), false);
    if (status != Status::ok && status != Status::step_limit) return std::nullopt;
    auto V = track.V[from];
    return examine(y, V);
  }

  /// How far a level may be off, relative to it: by the integration, and by a first ellipsoid that is not the
  /// manifold's. H is constant along a ray, and λ off by H over the speed.
  [[nodiscard]] double level_error(double level) const {
    double start = 0;
    for (const auto& ray : rays) {
      if (ray.first > 0 || ray.points.empty()) continue;
      const Point& point = ray.points.front();
      const double share = point.level / level;
      if (share < 1) start = std::max(start, point.hamiltonian * share * (1 - std::log(share)));
    }
    return 20 * options_.integrator.relative_tolerance + 2 * start;
  }

 protected:
  /// What a ray needs to go on from any of its points.
  struct Track {
    CvodeSolver<2 * n + 1> solver;
    std::vector<State> states;
    std::vector<typename Model::Covariance> V;
    double clock = 0;
    bool dead = false;
  };

  [[nodiscard]] double log_level(int k) const { return start_level_ + k * std::log(options_.level_ratio); }
  [[nodiscard]] bool ended_by_breakdown() const {
    return first.limit == StabilityLimit::integration || first.limit == StabilityLimit::no_start;
  }
  [[nodiscard]] bool ended() const { return stop_; }

  void note(const Event& event) {
    if (event.limit != StabilityLimit::condition) {
      stop_ = true;
      if (event.level < without_condition) {
        without_condition = event.level;
        without_condition_limit = event.limit;
      }
    }
    if (event.level < first.level) first = event;
  }

  Point examine(const State& y, typename Model::Covariance& V) const {
    return model_.examine(flow_.position(y), flow_.costate(y), Flow::level(y), V);
  }

  /// Moves y to ln S = target. It stops short where Ṡ has vanished (characteristic.hpp).
  Status advance(CvodeSolver<2 * n + 1>& solver, State& y, double target, bool continuous,
                 double* clock = nullptr) const {
    double now = clock != nullptr ? *clock : 0;
    for (int pass = 0; pass < 40; ++pass) {
      const double left = target - y(2 * n);
      if (!(left > 1e-13 * std::max(1.0, std::abs(target)))) break;
      const auto report = solver.integrate(flow_, now, now + left, y, continuous || pass > 0);
      if (report.status != Status::ok) return report.status;
      now += left;
    }
    if (clock != nullptr) *clock = now;
    return target - y(2 * n) < 1e-9 ? Status::ok : Status::step_limit;
  }

  int add_ray(std::size_t at, const State& y) {
    const int i = static_cast<int>(rays.size());
    rays.push_back({at, {}});
    tracks_.push_back(Track{CvodeSolver<2 * n + 1>(options_.integrator), {}, {}});
    Track& track = tracks_.back();
    State here = y;
    auto V = model_.origin_covariance();
    if (advance(track.solver, here, log_level(static_cast<int>(at)), false, &track.clock) != Status::ok) {
      note({StabilityLimit::integration, level_of(static_cast<int>(at)), i, {}, Status::accuracy_not_met});
      track.dead = true;
      return i;
    }
    push(i, here, V);
    for (int k = static_cast<int>(at) + 1; k < levels; ++k) extend(i);
    return i;
  }

  /// The next point of ray i.
  void extend(int i) {
    Track& track = tracks_[static_cast<std::size_t>(i)];
    if (track.dead) return;
    const auto& ray = rays[static_cast<std::size_t>(i)];
    const int k = static_cast<int>(ray.first + ray.points.size());
    State y = track.states.back();
    const Status status = advance(track.solver, y, log_level(k), true, &track.clock);
    if (status != Status::ok) {
      note({StabilityLimit::integration, ray.points.back().level, i, ray.points.back(), status});
      track.dead = true;
      return;
    }
    push(i, y, track.V.back());
  }

  StabilityLimit verdict(const Point& point) const {
    if (!usable(point.status) || !(point.covariance <= options_.largest_covariance))
      return StabilityLimit::covariance;
    if (!(point.rate < 0)) return StabilityLimit::condition;
    if (!(point.x.cwiseAbs().array() <= options_.box.array()).all()) return StabilityLimit::box;
    return StabilityLimit::none;
  }

  void push(int i, const State& y, typename Model::Covariance V) {
    Track& track = tracks_[static_cast<std::size_t>(i)];
    auto& points = rays[static_cast<std::size_t>(i)].points;
    const Point point = examine(y, V);
    track.states.push_back(y);
    track.V.push_back(V);
    points.push_back(point);
    if (!(point.printed < 0)) {
      ++printed_failures;
      printed_level = std::min(printed_level, point.level);
    }
    const StabilityLimit limit = verdict(point);
    if (limit != StabilityLimit::none) {
      if (limit == StabilityLimit::condition && point.level > 1.001 * first.level) return;
      if (points.size() < 2) return note({limit, 0, i, point, point.status});
      const auto end = bisect(i, points.size() - 2, y(2 * n));
      // Before it: what no third point can hint at any more.
      const std::size_t from = points.size() - std::min<std::size_t>(points.size(), 3);
      if (limit != StabilityLimit::covariance &&
          std::max(end.covariance, points[points.size() - 2].covariance) > 1.3)
        climb(i, from, std::log(end.level), size_of_covariance);
      if (limit != StabilityLimit::condition &&
          std::max(strictness(end), strictness(points[points.size() - 2])) > -0.05)
        climb(i, from, std::log(end.level), [this](const Point& q) { return strictness(q); });
      return;
    }
    if (points.size() < 3 || points[points.size() - 3].level > first.level) return;
    // Between the levels: a peak of V, or of the condition, that three points only hint at.
    const Point *a = &points[points.size() - 3], *b = a + 1, *c = a + 2;
    if (b->covariance > 1.3 && b->covariance >= a->covariance && b->covariance >= c->covariance)
      climb(i, points.size() - 3, y(2 * n), size_of_covariance);
    if (strictness(*b) > -0.05 && strictness(*b) >= strictness(*a) && strictness(*b) >= strictness(*c))
      climb(i, points.size() - 3, y(2 * n), [this](const Point& q) { return strictness(q); });
  }

  static double size_of_covariance(const Point& point) { return point.covariance; }
  double strictness(const Point& point) const { return point.rate / (point.level * model_.pace()); }

  /// State, V and point of ray i at ln S = at, from its point number `from`.
  std::optional<Point> between(int i, std::size_t from, double at) const {
    const Track& track = tracks_[static_cast<std::size_t>(i)];
    State y = track.states[from];
    CvodeSolver<2 * n + 1> solver(options_.integrator);
    const Status status = advance(solver, y, at, false);
    if (status != Status::ok && status != Status::step_limit) return std::nullopt;
    auto V = track.V[from];
    return examine(y, V);
  }

  /// The level at which a ray that is well at its point `from` and not at ln S = above first fails: that of
  /// the last point found well, which is the answer. Where Ṡ vanishes a point falls short of the level asked
  /// for.
  Point bisect(int i, std::size_t from, double above) {
    double below = rays[static_cast<std::size_t>(i)].points[from].level;
    Point well = rays[static_cast<std::size_t>(i)].points[from];
    below = std::log(below);
    Event event{StabilityLimit::none, 0, i, {}, Status::ok};
    for (int halving = 0; halving < 40 && above - below > 1e-9; ++halving) {
      const double middle = 0.5 * (below + above);
      const auto point = between(i, from, middle);
      const StabilityLimit limit = point ? verdict(*point) : StabilityLimit::integration;
      if (limit == StabilityLimit::none) {
        below = middle;
        well = *point;
      } else {
        above = middle;
        event.limit = limit;
        if (point) event.point = *point;
      }
    }
    if (event.limit == StabilityLimit::none) {
      const auto point = between(i, from, above);
      event.limit = point ? verdict(*point) : StabilityLimit::integration;
      if (point) event.point = *point;
    }
    event.level = std::min(well.level, std::exp(below));
    event.status = event.point.status;
    note(event);
    return well;
  }

  /// Golden section for the largest `height` of ray i between its point `from` and ln S = above.
  template <typename Height>
  void climb(int i, std::size_t from, double above, const Height& height) {
    constexpr double golden = 0.6180339887498949;
    double low = std::log(rays[static_cast<std::size_t>(i)].points[from].level), high = above;
    double left = high - golden * (high - low), right = low + golden * (high - low);
    const auto look = [&](double at, bool& failed) {
      const auto point = between(i, from, at);
      failed = !point || verdict(*point) != StabilityLimit::none;
      return point ? height(*point) : std::numeric_limits<double>::infinity();
    };
    bool failed = false;
    double at_left = look(left, failed);
    if (failed) return void(bisect(i, from, left));
    double at_right = look(right, failed);
    if (failed) return void(bisect(i, from, right));
    for (int k = 0; k < 60 && high - low > 1e-11; ++k) {
      if (at_left > at_right) {
        high = right;
        right = left;
        at_right = at_left;
        left = high - golden * (high - low);
        at_left = look(left, failed);
        if (failed) return void(bisect(i, from, left));
      } else {
        low = left;
        left = right;
        at_left = at_right;
        right = low + golden * (high - low);
        at_right = look(right, failed);
        if (failed) return void(bisect(i, from, right));
      }
    }
  }

  const State* state_at(int i, std::size_t level) const {
    const auto& ray = rays[static_cast<std::size_t>(i)];
    const auto& states = tracks_[static_cast<std::size_t>(i)].states;
    if (level < ray.first || level - ray.first >= states.size()) return nullptr;
    return &states[level - ray.first];
  }

  const Model& model_;
  Flow flow_;
  const StabilityOptions<n>& options_;
  std::vector<Track> tracks_;
  double start_level_ = 0;
  bool stop_ = false;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
