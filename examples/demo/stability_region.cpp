// SPDX-License-Identifier: BSD-3-Clause
// How far from the origin is the state-dependent Riccati filter of McCaffrey 1998 stable? Proposition 2.1 on
// the oscillators of both papers of Rusnak and their saturating sensor: the region that the full condition
// certifies, that of the condition as printed, and how much farther out convergence is really lost.
//
// A filter without input that is started at x̂ is to come to the origin. On n = 1 everything is known, and is
// asked first.
#include <algorithm>
#include <analysis/scalar_by_hand.hpp>
#include <cmath>
#include <jml/analysis/stability_region.hpp>
#include <models/continuous.hpp>
#include <models/stability.hpp>

#include "support/figure.hpp"
#include "support/output.hpp"

namespace {

using V2 = jml::Vector<double, 2>;
using Region = jml::StabilityRegion<2>;
constexpr double farthest = 16;  // times the certified boundary
// Far out the oscillator is damped so strongly that a start needs long to come back: it is given the time.
const jml::AutonomousRun patient{.time_constants = 1e5};

struct Case {
  const char *name, *key;
  models::Oscillator dynamics;
  models::SaturatingSignal sensor;
  V2 box;
};

/// The boundary in the order of its angle, closed.
std::vector<V2> outline(const std::vector<jml::StabilityPoint<2>>& points) {
  std::vector<V2> out;
  for (const auto& point : points) out.push_back(point.x);
  std::sort(out.begin(), out.end(),
            [](const V2& a, const V2& b) { return std::atan2(a(1), a(0)) < std::atan2(b(1), b(0)); });
  if (!out.empty()) out.push_back(out.front());
  return out;
}

demo::Series curve(const std::string& label, const char* ink, const std::vector<V2>& points,
                   const char* style) {
  demo::Series out{label, ink, {}, {}, style};
  for (const V2& x : points) {
    out.x.push_back(x(0));
    out.y.push_back(x(1));
  }
  return out;
}

/// The points of one front, where all rays of it are there yet.
std::vector<V2> front(const Region& region, std::size_t level) {
  std::vector<jml::StabilityPoint<2>> points;
  for (const auto& ray : region.rays) {
    if (level >= ray.first && level - ray.first < ray.points.size())
      points.push_back(ray.points[level - ray.first]);
  }
  return outline(points);
}

void draw_region(const std::filesystem::path& file, const std::string& title, const Region& region) {
  using namespace demo;
  Panel panel{"velocity (1/s)", {}};
  const double certified = std::log(region.level / region.rays.front().points.front().level);
  for (const double share : {0.05, 0.2, 0.45}) {
    const double level = (certified + std::log(share)) / std::log(region.level_ratio);
    panel.series.push_back(curve(share == 0.05 ? "S = γ/20, γ/5, γ/2" : "", colour::grey,
                                 front(region, static_cast<std::size_t>(std::max(0.0, level))),
                                 "lines lw 1"));
  }
  std::vector<V2> printed;
  for (const auto& ray : region.rays) {
    for (const auto& point : ray.points) {
      if (point.printed >= 0 && point.level < 2.1 * region.level) printed.push_back(point.x);
    }
  }
  panel.series.push_back(curve("(13) as printed fails", colour::orange, printed, "points pt 7 ps 0.35"));
  panel.series.push_back(curve("certified, S = γ", colour::blue, outline(region.boundary), "lines lw 2"));
  const V2 at = region.limiting_point.x;
  const bool condition = region.limit == jml::StabilityLimit::condition;
  panel.series.push_back(
      curve(condition ? "dS/dt = 0" : "the box", colour::red, {at, V2(-at)}, "points pt 7 ps 1.1"));
  Figure{title, "position ξ (-)", {panel}, 900, 640}.write(
      file,
      "Of no source: Proposition 2.1 of McCaffrey 1998. The filter is the algebraic one, (8) and (9); γ is "
      "the largest certified level.");
}

void one_state(demo::Summary& summary) {
  std::printf("x' = a x + w, y = x - x³ + v: certified exactly on (-1, 1), at the level ∫₀¹ x/V dx.\n\n");
  demo::Table table({"a", "q", "r", "level", "by hand", "limit", "at", "printed condition"});
  int number = 0;
  for (const by_hand::Scalar& c : {by_hand::Scalar{0.5, 1, 0.3}, by_hand::Scalar{0.2, 2, 1}}) {
    const models::Copies<1> dynamics{jml::Vector<double, 1>(c.a), jml::Vector<double, 1>(c.q)};
    const models::TurningSignals<1> sensor{jml::Vector<double, 1>(c.r)};
    const auto region = jml::stability_region(dynamics, sensor, {.box = jml::Vector<double, 1>(3)});
    const double exact = c.level(1);
    table.add({demo::text("%.1f", c.a), demo::text("%.0f", c.q), demo::text("%.1f", c.r),
               demo::text("%.6f", region.level), demo::text("%.6f", exact), jml::describe(region.limit),
               demo::text("%.4f", std::abs(region.limiting_point.x(0))),
               demo::text("%.6f", region.printed_level)});
    const std::string prefix = "one_state_" + std::to_string(++number);
    summary.add(prefix + "_level", region.level, "-");
    summary.add(prefix + "_by_hand", exact, "-");
    summary.add(prefix + "_printed_level", region.printed_level, "-");
  }
  table.print();
}

constexpr const char* notes = R"(
γ: the largest level of S that the full condition, dS/dt < 0 along the filter, certifies within the box. By sampling, no proof.
(13) fails: points looked at where the printed condition does not hold. farther: the least factor on the boundary at which
a start no longer converges. |H|: the relative error of the Hamilton-Jacobi equation on the manifold.

- The condition as printed leaves out -½ λᵀGQGᵀλ. With one measurement of two states it certifies nothing: it fails in a strip
  beside h(x) = 0 however near the origin (orange in the figures). The full condition holds there.
- With a good sensor the box is the limit. With a poorer one the condition fails at last, where the sensor is flat. It
  is sufficient only: starts sixteen times as far out still converge, all of them, if they are given the time (some hundred
  seconds where the damping 2c ξ² is strong).
- V(x̂) goes to V(0), the steady P of the EKF, as x̂ goes to 0, with the square of the distance, as S does (third figure).
)";

}  // namespace

int main(int argc, char** argv) {
  const auto directory = demo::output_directory(argc, argv, "<output directory>");
  demo::Summary summary;
  one_state(summary);

  const Case cases[] = {
      {"2018: c = 0.01, k = 0.1, R = 1e-5", "chapter", {}, {}, V2(10, 30)},
      {"2015: c = 0.1, k = 1, R = 1e-3", "paper", {1, 0.1, 1, 1}, {1e-3}, V2(6, 12)},
      {"2015, but R = 1e-2", "coarse", {1, 0.1, 1, 1}, {1e-2}, V2(6, 12)},
      {"2015, but R = 1e-1", "coarser", {1, 0.1, 1, 1}, {1e-1}, V2(6, 12)},
  };
  std::printf("\nThe oscillator, Q = 1, seen through the saturating sensor:\n\n");
  demo::Table table({"", "box ±", "γ", "limit", "at", "γ of (13)", "(13) fails", "starts on the boundary",
                     "converge", "farther", "rays", "fronts", "gap", "|H|"});
  demo::Panel claim{"|V(x)/V(0) - 1| (-)", {}};
  const char* inks[] = {demo::colour::blue, demo::colour::green, demo::colour::orange, demo::colour::red};
  for (std::size_t number = 0; number < std::size(cases); ++number) {
    const Case& c = cases[number];
    const Region region = jml::stability_region(c.dynamics, c.sensor, {.box = c.box});
    std::vector<V2> starts;
    int converging = 0;
    for (const auto& point : region.boundary) {
      starts.push_back(point.x);
      converging += jml::run_without_input(c.dynamics, c.sensor, point.x, patient).converged;
    }
    const auto factors = jml::convergence_factors(c.dynamics, c.sensor, starts, farthest, patient);
    const double least = factors.empty() ? NAN : *std::min_element(factors.begin(), factors.end());
    table.add(
        {c.name, demo::text("%.0f, ", c.box(0)) + demo::text("%.0f", c.box(1)),
         demo::text("%.4g", region.level), jml::describe(region.limit),
         demo::text("(%.2f, ", region.limiting_point.x(0)) + demo::text("%.2f)", region.limiting_point.x(1)),
         demo::text("%.3g", region.printed_level), std::to_string(region.printed_failures),
         std::to_string(starts.size()), std::to_string(converging),
         least >= farthest ? demo::text("> %.0f", farthest) : demo::text("%.1f", least),
         std::to_string(region.rays.size()), std::to_string(region.levels),
         demo::text("%.2f", region.largest_gap), demo::text("%.0e", region.hamiltonian)});
    const std::string prefix = c.key;
    summary.add(prefix + "_level", region.level, "-");
    summary.add(prefix + "_limited_by_condition", region.limit == jml::StabilityLimit::condition, "-");
    summary.add(prefix + "_limited_by_box", region.limit == jml::StabilityLimit::box, "-");
    summary.add(prefix + "_printed_level", region.printed_level, "-");
    summary.add(prefix + "_printed_failures", static_cast<double>(region.printed_failures), "-");
    summary.add(prefix + "_starts", static_cast<double>(starts.size()), "-");
    summary.add(prefix + "_converging", converging, "-");
    summary.add(prefix + "_farther", least, "-");
    summary.add(prefix + "_hamiltonian", region.hamiltonian, "-");

    // Over all rays that are there, front by front.
    demo::Series series{c.name, inks[number], {}, {}, "lines lw 1.6"};
    for (int k = 0; k < region.levels; ++k) {
      double level = 0, change = 0;
      for (const auto& ray : region.rays) {
        const auto at = static_cast<std::size_t>(k);
        if (at < ray.first || at - ray.first >= ray.points.size()) continue;
        level = ray.points[at - ray.first].level;
        change = std::max(change, std::abs(ray.points[at - ray.first].covariance - 1));
      }
      if (level > region.level) break;
      series.x.push_back(level);
      series.y.push_back(change);
    }
    std::size_t tenth = 0;  // S ten times that of the first front
    while (tenth + 1 < series.x.size() && series.x[tenth] < 10 * series.x[0]) ++tenth;
    summary.add(prefix + "_covariance_order",
                std::log(series.y[tenth] / series.y[0]) / std::log(series.x[tenth] / series.x[0]), "-");
    claim.series.push_back(std::move(series));

    if (prefix == "paper")
      draw_region(directory / "fig02_good_sensor.svg", "Certified region at R = 0.001, c = 0.1, k = 1",
                  region);
    if (prefix == "coarser")
      draw_region(directory / "fig01_poor_sensor.svg", "Certified region at R = 0.1, c = 0.1, k = 1", region);
  }
  table.print();
  claim.options = "set logscale xy; set format '10^{%T}'; set key top left vertical inside Left reverse";
  demo::Figure{
      "V(x) goes to V(0) at the origin: the largest change on S = level", "level of S (-)", {claim}, 900, 520}
      .write(directory / "fig03_claim.svg",
             "Of no source: a claim of Proposition 2.1 of McCaffrey 1998, of the algebraic filter (9) on the "
             "oscillator.");
  std::printf("%s", notes);
  summary.write(directory / "summary.csv");
}
