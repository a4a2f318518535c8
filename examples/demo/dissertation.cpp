// SPDX-License-Identifier: BSD-3-Clause
// Chapter IV of the bounded-noise dissertation with many runs: Tables 2 to 5 beside the printed numbers and
// Figures 6 to 19. The estimators are the library's, jml::Filter and jml::Filter with jml::Kalman, each
// on the same system.
//
// As chosen here, where the source says nothing or the scan lost it:
// - Example 1: A = exp(-ω 0.1 s), B = √(1 - A²), so that the variance of x stays Q; u uniform with variance
//   Q. The figures show the 11th sample, at 1 s.
// - Start, as the source describes it: the bounded estimator has no prior box in example 1, its first box is
//   y ± b; the Kalman filter passes over the first sample, x = 0, P = Q.
// - Example 2: Q is a spectral density, so that u has the variance Q / 0.1 s (this reproduces Table 5). The
//   Kalman filter starts at 0 with P = 3 Q diag(.6950, 1/6), the printed first row for Q = 1/3 (the
//   stationary variances are .6943 and .1665). The truth starts uniform with these variances; the velocity,
//   which is not measured, has that uniform density for a prior box; the position has none. The steady state
//   is read at 10 s, the last sample.
// - Example 3: the variance of u stays what it was, so that the bound falls from √10 to √(10/3) on the way
//   from uniform to ±ū. With the bound fixed the Kalman filter's error would rise by 40 %, where the source
//   saw little change.

#include "support/dissertation.hpp"

#include <cstdio>
#include <limits>
#include <string>

#include "support/bounded_campaign.hpp"
#include "support/figure.hpp"
#include "support/output.hpp"
#include "support/statistics.hpp"

namespace {

using namespace demo::dissertation;
using demo::Series, demo::Summary, demo::Table, demo::text;

const int constant_runs = 1'000'000, bandwidth_runs = 200'000, transient_runs = 200'000, steady_runs = 30'000;
constexpr double interval = 0.1;  // s
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Counts {
  int refused = 0, violated = 0, outside = 0;
  void add(const auto& campaign) {
    refused += campaign.refused;
    violated += campaign.violated;
    outside += campaign.outside;
  }
};

double reduction(const Errors& e) { return 100 * (1 - e.bounded.value() / e.kalman.value()); }

/// One printed table beside ours.
template <typename C>
void compare(const C& campaign, std::size_t state, const Printed& printed, const std::string& key,
             const char* first_column, double first_value, double step, Summary& summary) {
  Table table({first_column, "optimum printed", "ours", "Kalman, their 100 runs", "± expected", "ours", "±",
               "bounded", "±", "its own estimate"});
  for (std::size_t k = 0; k < rows; ++k) {
    const Errors& e = campaign.errors[k][state];
    table.add({text("%g", first_value + step * static_cast<double>(k)), text("%.4f", printed.optimum[k]),
               text("%.4f", e.optimum), text("%.4f", printed.actual[k]), text("%.4f", scatter(e.kalman)),
               text("%.5f", e.kalman.value()), text("%.5f", e.kalman.standard_error()),
               text("%.5f", e.bounded.value()), text("%.5f", e.bounded.standard_error()),
               text("%.5f", e.on_line.value())});
    const std::string row = key + text("_%02.0f", static_cast<double>(k)) + '_';
    summary.add(row + "optimum", e.optimum, "-");
    summary.add(row + "kalman", e.kalman.value(), "-");
    summary.add(row + "kalman_se", e.kalman.standard_error(), "-");
    summary.add(row + "bounded", e.bounded.value(), "-");
    summary.add(row + "bounded_se", e.bounded.standard_error(), "-");
    summary.add(row + "on_line", e.on_line.value(), "-");
    summary.add(row + "on_line_se", e.on_line.standard_error(), "-");
    summary.add(row + "difference_se", e.difference.standard_error(), "-");
  }
  table.print();
  const Stray far = stray(campaign, state, printed);
  std::printf(
      "Their 100 runs are at most %.1f standard errors from the optimum; %.1f %% of %zu such "
      "campaigns of ours go as far.\n\n",
      far.largest, 100 * far.share, campaign.means.size());
  summary.add(key + "_source_stray", far.largest, "-");
  summary.add(key + "_source_stray_share", far.share, "-");
}

struct Drawing {
  std::filesystem::path directory;
  void operator()(int number, const std::string& title, const std::string& x_title,
                  std::vector<Series> series, const std::string& options = "set yrange [0:*]",
                  const std::string& y_title = "mean squared error (-)") const {
    char name[16];
    std::snprintf(name, sizeof name, "fig%02d.svg", number);
    demo::Figure{
        "Fig. " + std::to_string(number) + "  " + title, x_title, {{y_title, std::move(series), options}}}
        .write(directory / name,
               "Redraws Figure " + std::to_string(number) +
                   " of the bounded-noise dissertation: its estimator, linearised, and the Kalman filter.");
  }
};

// ---- Example 1, second part: a constant ----

struct Case {
  const char *key, *name;
  double q, r;
  const Printed& printed;
  int figure;
  double source_reduction;
};

Campaign<FirstOrder> constant(const Case& c, std::uint64_t seed) {
  Campaign<FirstOrder> out{{}, c.r, jml::Vector<double, 1>(c.q), jml::Vector<double, 1>(infinity), rows};
  out.keep_campaigns = true;
  out.run(constant_runs, seed);
  return out;
}

/// The first sample, counted from 1, from which on `holds`.
std::size_t first_sample(const Campaign<FirstOrder>& campaign, const auto& holds) {
  std::size_t k = rows;
  while (k > 0 && holds(campaign.errors[k - 1][0])) --k;
  return k + 1;
}

void constants(const Drawing& draw, Summary& summary, Counts& counts) {
  const Case cases[] = {{"table2", "Q > R", 4. / 3, 1. / 3, table2, 8, 83},
                        {"table3", "Q = R", 1. / 3, 1. / 3, table3, 10, 86},
                        {"table4", "Q < R", 1. / 3, 4. / 3, table4, 12, 80}};
  Table overview({"", "reduction at 25 %", "± of 100 runs", "source", "bounded better from", "source",
                  "MSE .03: bounded", "source", "Kalman", "optimum", "source"});
  for (const Case& c : cases) {
    const std::string key = c.key;
    std::printf("Table %c  A constant, %s (Q = %.4f, R = %.4f), %d runs; samples counted from 1\n\n",
                key.back(), c.name, c.q, c.r, constant_runs);
    const auto campaign = constant(c, 40 + static_cast<std::uint64_t>(c.figure));
    counts.add(campaign);
    compare(campaign, 0, c.printed, key, "samples", 1, 1, summary);

    const Errors& last = campaign.errors.back()[0];
    // The scatter of 1 - a / b over 100 runs, to first order; a, b correlate.
    const double a = last.bounded.value(), b = last.kalman.value(), sa = scatter(last.bounded),
                 sb = scatter(last.kalman), sd = scatter(last.difference);
    const double both = (sa * sa + sb * sb - sd * sd) / 2;
    const double spread = 100 * a / b * std::sqrt(sa * sa / (a * a) + sb * sb / (b * b) - 2 * both / (a * b));
    const auto better =
        first_sample(campaign, [](const Errors& e) { return e.bounded.value() < e.kalman.value(); });
    const auto bounded = first_sample(campaign, [](const Errors& e) { return e.bounded.value() <= .03; });
    const auto kalman = first_sample(campaign, [](const Errors& e) { return e.kalman.value() <= .03; });
    const auto optimum = first_sample(campaign, [](const Errors& e) { return e.optimum <= .03; });
    const bool source_counted = key == "table2";
    const auto sample = [](std::size_t n) { return n > rows ? std::string("> 25") : std::to_string(n); };
    overview.add({c.name, text("%.1f", reduction(last)), text("%.1f", spread),
                  text("%.0f", c.source_reduction), sample(better), key == "table4" ? "7" : "-",
                  sample(bounded), source_counted ? "7" : "-", sample(kalman), sample(optimum),
                  source_counted ? "14" : "-"});
    summary.add(key + "_reduction", reduction(last), "%");
    summary.add(key + "_reduction_scatter", spread, "%");
    summary.add(key + "_reduction_se", spread * std::sqrt(source_runs / static_cast<double>(constant_runs)),
                "%");
    summary.add(key + "_bounded_better_from", static_cast<double>(better), "samples");
    summary.add(key + "_bounded_reaches_03", static_cast<double>(bounded), "samples");
    summary.add(key + "_kalman_reaches_03", static_cast<double>(kalman), "samples");
    summary.add(key + "_optimum_reaches_03", static_cast<double>(optimum), "samples");

    for (int part = 0; part < 2; ++part) {
      const std::size_t from = part == 0 ? 0 : 8, to = part == 0 ? 10 : rows;
      Curves curves;
      Series printed{
          "the source's 100 runs", demo::colour::black, {}, {}, "points pt 6 ps 0.9"};
      for (std::size_t k = from; k < to; ++k) {
        const auto n = static_cast<double>(k + 1);
        curves.add(n, campaign.errors[k][0]);
        printed.x.push_back(n);
        printed.y.push_back(c.printed.actual[k]);
      }
      auto series = curves.series();
      series.push_back(printed);
      draw(c.figure + part, std::string("A constant, ") + c.name + (part == 0 ? "" : ", enlarged"),
           "number of samples (-)", std::move(series));
    }
  }
  overview.print();
}

// ---- Example 1, first part: bandwidth ----

struct Point {
  double w;
  Errors errors;
};

constexpr double low_end[] = {.0001, .0003, .001,  .002, .003,  .004, .005, .006, .007, .0078,
                              .0085, .009,  .0095, .010, .0105, .011, .012, .014, .017, .02};
constexpr double middle[] = {.05, .1, .3, 1};
constexpr double high_end[] = {3, 4, 5, 6, 6.7, 7.5, 8, 8.5, 9, 9.5, 10, 12, 15, 20, 30, 50, 100};

Point at_bandwidth(double w, Counts& counts) {
  constexpr double q = 4. / 3, r = 1. / 3;
  const double a = std::exp(-w * interval), b = std::sqrt(1 - a * a);
  Campaign<FirstOrder> campaign{{a, b, q, bound_of(q)},           r,  jml::Vector<double, 1>(q),
                                jml::Vector<double, 1>(infinity), 11, 10};
  campaign.run(bandwidth_runs, 6);  // the same draws at every bandwidth
  counts.add(campaign);
  return {w, campaign.errors[0][0]};
}

/// Where the difference first crosses zero from w = `from` to `to`, by interpolation; and the standard error
/// of that place.
struct Crossing {
  double w = std::numeric_limits<double>::quiet_NaN(), se = w;
};

Crossing crossing(const std::vector<Point>& points, double from, double to, const auto& difference) {
  Crossing out;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (points[i - 1].w < from || points[i].w > to) continue;
    const double a = difference(points[i - 1]), b = difference(points[i]);
    if ((a < 0) == (b < 0)) continue;
    const double slope = (b - a) / (points[i].w - points[i - 1].w);
    out.w = points[i - 1].w - a / slope;
    out.se = points[i].errors.difference.standard_error() / std::abs(slope);
    break;
  }
  return out;
}

void bandwidths(const Drawing& draw, Summary& summary, Counts& counts) {
  std::vector<Point> points;
  for (const double w : low_end) points.push_back(at_bandwidth(w, counts));
  for (const double w : middle) points.push_back(at_bandwidth(w, counts));
  for (const double w : high_end) points.push_back(at_bandwidth(w, counts));

  std::printf("\nExample 1, bandwidth: mean squared error at 1 s, Q = 4/3, R = 1/3, %d runs\n\n",
              bandwidth_runs);
  Table table({"bandwidth rad/s", "optimum", "Kalman", "±", "bounded", "±", "its own estimate", "reduction %",
               "difference", "± of 100 runs"});
  Curves low, high;
  for (const auto& [w, e] : points) {
    table.add({text("%g", w), text("%.4f", e.optimum), text("%.5f", e.kalman.value()),
               text("%.5f", e.kalman.standard_error()), text("%.5f", e.bounded.value()),
               text("%.5f", e.bounded.standard_error()), text("%.5f", e.on_line.value()),
               text("%.1f", reduction(e)), text("%.4f", e.difference.value()),
               text("%.4f", scatter(e.difference))});
    const std::string key = text("bandwidth_%g_", w);
    summary.add(key + "optimum", e.optimum, "-");
    summary.add(key + "optimum_all_samples", e.optimum_all, "-");
    summary.add(key + "kalman", e.kalman.value(), "-");
    summary.add(key + "kalman_se", e.kalman.standard_error(), "-");
    summary.add(key + "bounded", e.bounded.value(), "-");
    summary.add(key + "bounded_se", e.bounded.standard_error(), "-");
    summary.add(key + "difference", e.difference.value(), "-");
    summary.add(key + "difference_scatter", scatter(e.difference), "-");
    summary.add(key + "on_line", e.on_line.value(), "-");
    if (w <= .02) low.add(w, e);
    if (w >= 3) high.add(w, e);
  }
  table.print();

  const auto difference = [](const Point& p) { return p.errors.difference.value(); };
  const Crossing below = crossing(points, 1e-4, .02, difference),
                 above = crossing(points, 3, 100, difference);
  const Crossing all_samples = crossing(
      points, 1e-4, .02, [](const Point& p) { return p.errors.bounded.value() - p.errors.optimum_all; });
  const double more = std::sqrt(bandwidth_runs / static_cast<double>(source_runs));
  std::printf(
      "\nThe bounded estimator is the better one below %.4f ± %.4f rad/s (of 100 runs: ± %.4f; source .0078) "
      "and above %.2f ± %.2f\nrad/s (± %.1f; source 6.7). Against a Kalman filter that uses the first sample "
      "too: below %.4f rad/s.\n",
      below.w, below.se, below.se * more, above.w, above.se, above.se * more, all_samples.w);
  summary.add("crossover_low", below.w, "rad/s");
  summary.add("crossover_low_se", below.se, "rad/s");
  summary.add("crossover_low_all_samples", all_samples.w, "rad/s");
  summary.add("crossover_high", above.w, "rad/s");
  summary.add("crossover_high_se", above.se, "rad/s");

  auto series = low.series();
  series.push_back(low.with_first_sample());
  draw(6, "Mean squared error at 1 s, low bandwidths", "bandwidth (rad/s)", std::move(series));
  draw(7, "Mean squared error at 1 s, high bandwidths", "bandwidth (rad/s)", high.series(),
       "set logscale x\nset yrange [.2:.34]");
}

// ---- Example 2 ----

Campaign<SecondOrder> oscillator(double q, double r, int samples, int first) {
  const double u = q / interval;
  const jml::Vector<double, 2> variance = 3 * q * jml::Vector<double, 2>(.6950, 1. / 6);
  return {{u, bound_of(u)}, r, variance, {infinity, bound_of(variance(1))}, samples, first};
}

constexpr const char* state_names[] = {"position", "velocity"};

void table_5(Summary& summary, Counts& counts) {
  auto campaign = oscillator(1. / 3, 1. / 3, rows, 0);
  campaign.keep_campaigns = true;
  campaign.run(transient_runs, 5);
  counts.add(campaign);
  for (std::size_t i = 0; i < 2; ++i) {
    std::printf("\nTable 5  Example 2, %s, Q = R = 1/3, %d runs\n\n", state_names[i], transient_runs);
    compare(campaign, i, i == 0 ? table5_position : table5_velocity, std::string("table5_") + state_names[i],
            "time s", 0, interval, summary);
  }
}

void ratios(const Drawing& draw, Summary& summary, Counts& counts) {
  for (const bool of_signal : {true, false}) {
    const char* name = of_signal ? "Q/R" : "R/Q";
    std::printf("Example 2, %s from 1 to 81, the other 1/3: mean squared error at 10 s, %d runs\n\n", name,
                steady_runs);
    Table table({name, "position: optimum", "Kalman", "±", "bounded", "±", "ratio", "velocity: optimum",
                 "Kalman", "±", "bounded", "±", "ratio"});
    Curves curves[2];
    for (const double ratio : {1., 2., 3., 5., 9., 16., 27., 45., 81.}) {
      auto campaign = oscillator(of_signal ? ratio / 3 : 1. / 3, of_signal ? 1. / 3 : ratio / 3, 101, 100);
      campaign.run(steady_runs, 14);
      counts.add(campaign);
      std::vector<std::string> row{text("%g", ratio)};
      for (std::size_t i = 0; i < 2; ++i) {
        const Errors& e = campaign.errors[0][i];
        curves[i].add(ratio, e);
        for (const double value : {e.optimum, e.kalman.value(), e.kalman.standard_error(), e.bounded.value(),
                                   e.bounded.standard_error()})
          row.push_back(text("%.4f", value));
        row.push_back(text("%.2f", e.bounded.value() / e.kalman.value()));
        const std::string key = (of_signal ? "q_over_r_" : "r_over_q_") + text("%g_", ratio) + state_names[i];
        summary.add(key + "_optimum", e.optimum, "-");
        summary.add(key + "_kalman", e.kalman.value(), "-");
        summary.add(key + "_kalman_se", e.kalman.standard_error(), "-");
        summary.add(key + "_bounded", e.bounded.value(), "-");
        summary.add(key + "_bounded_se", e.bounded.standard_error(), "-");
      }
      table.add(row);
    }
    table.print();
    std::printf("\n");
    for (int i = 0; i < 2; ++i) {
      draw((of_signal ? 14 : 16) + i,
           std::string("Steady-state ") + state_names[i] + " error as a function of " + name +
               (of_signal ? ", R fixed" : ", Q fixed"),
           std::string(name) + " (-)", curves[i].series(), "set yrange [0:*]");
    }
  }
}

// ---- Example 3 ----

void inputs(const Drawing& draw, Summary& summary, Counts& counts) {
  const auto with = [&counts](bool bang_bang, bool tight) {
    auto out = oscillator(1. / 3, 1. / 3, 26, 0);
    out.bang_bang = bang_bang;
    if (tight) out.system.bound = std::sqrt(out.system.variance);
    out.run(transient_runs, 18);
    counts.add(out);
    return out;
  };
  const auto uniform = with(false, false), loose = with(true, false), bang = with(true, true);
  for (std::size_t i = 0; i < 2; ++i) {
    std::printf("Example 3, %s, %d runs: bounded estimator and Kalman filter with u uniform or ±ū\n\n",
                state_names[i], transient_runs);
    Table table({"time s", "optimum", "with first sample", "Kalman, uniform", "±ū", "±", "bounded, uniform",
                 "±ū, bound as before", "±ū", "±"});
    Curves curves, before, unaware;
    double better = -1, better_uniform = -1, better_than_all = -1;  // s, the last time
    for (std::size_t k = 0; k < uniform.errors.size(); ++k) {
      const double t = interval * static_cast<double>(k);
      const Errors &u = uniform.errors[k][i], &l = loose.errors[k][i], &b = bang.errors[k][i];
      table.add({text("%.1f", t), text("%.4f", b.optimum), text("%.4f", b.optimum_all),
                 text("%.5f", u.kalman.value()), text("%.5f", b.kalman.value()),
                 text("%.5f", b.kalman.standard_error()), text("%.5f", u.bounded.value()),
                 text("%.5f", l.bounded.value()), text("%.5f", b.bounded.value()),
                 text("%.5f", b.bounded.standard_error())});
      curves.add(t, b);
      before.add(t, u);
      unaware.add(t, l);
      const auto below_zero = [](const demo::Mean& m) { return m.value() < -3 * m.standard_error(); };
      if (below_zero(b.difference)) better = t;
      if (below_zero(u.difference)) better_uniform = t;
      if (b.bounded.value() + 3 * b.bounded.standard_error() < b.optimum_all) better_than_all = t;
      const std::string key =
          std::string("example3_") + state_names[i] + text("_%02.0f_", static_cast<double>(k));
      summary.add(key + "optimum", b.optimum, "-");
      summary.add(key + "optimum_all_samples", b.optimum_all, "-");
      summary.add(key + "kalman", b.kalman.value(), "-");
      summary.add(key + "kalman_se", b.kalman.standard_error(), "-");
      summary.add(key + "kalman_uniform", u.kalman.value(), "-");
      summary.add(key + "bounded_uniform", u.bounded.value(), "-");
      summary.add(key + "bounded_loose", l.bounded.value(), "-");
      summary.add(key + "bounded", b.bounded.value(), "-");
      summary.add(key + "bounded_se", b.bounded.standard_error(), "-");
    }
    table.print();
    const double gain = 100 * (1 - curves.bounded.back() / before.bounded.back());
    const double gain_of_shape = 100 * (1 - unaware.bounded.back() / before.bounded.back());
    const auto until = [](double t) { return t < 0 ? std::string("never") : text("to %.1f s", t); };
    std::printf(
        "\nAt 2.5 s, from uniform to ±ū: %.1f %% less, %.1f %% where the bound stays. Better than the Kalman "
        "filter: %s (uniform: %s;\n±ū against the filter that uses the first sample: %s).\n\n",
        gain, gain_of_shape, until(better).c_str(), until(better_uniform).c_str(),
        until(better_than_all).c_str());
    const std::string key = std::string("example3_") + state_names[i];
    summary.add(key + "_gain", gain, "%");
    summary.add(key + "_gain_of_shape", gain_of_shape, "%");
    summary.add(key + "_better_until", better, "s");
    summary.add(key + "_better_until_uniform", better_uniform, "s");
    summary.add(key + "_better_until_all_samples", better_than_all, "s");

    auto series = curves.series(", u = ±ū");
    series.push_back({"bounded noise, u uniform", demo::colour::orange, before.x, before.bounded,
                      "linespoints pt 6 ps 0.5 lw 1.6"});
    series.push_back({"bounded noise, u = ±ū, bound as before", demo::colour::black, unaware.x,
                      unaware.bounded, "lines lw 1.2 dt (4,6)"});
    draw(18 + static_cast<int>(i), std::string("Example 3, ") + state_names[i] + " error", "time (s)",
         std::move(series), "set yrange [0:.25]\nset key below vertical maxrows 3");
  }
}

constexpr const char* notes = R"(
± : standard error of our means; "± expected", "± of 100 runs": what a mean of 100 runs scatters by, and the bands of
the figures are 1.96 of these. its own estimate: mean of (2.34), (d - c)²/12. "with first sample": the optimum of a
Kalman filter that does not pass over it, as the source's does.

- Kalman filter. It is linear and knows the second moments: its mean squared error is its P, whatever the densities.
  All printed optima are met to the last digit, and by ours with many runs. Of the source's 100 runs the columns of
  Tables 2 to 4 and the velocities of Table 5 are ordinary; its positions from 0.5 to 0.7 s are 2.7 to 3.5 standard
  errors too high, which one campaign in seventy is somewhere. Its first row repeats the start, it is no result of
  runs.
- A constant. The claims hold: the bounded estimator wins by far, and its error is 2 b²/((n + 1)(n + 2)). By this law
  the reductions at 25 samples are 79.3, 78.6, 76.1 %; 83, 86, 80 % are one draw of 100 runs (± 5). The same draws
  served all three tables, so that in the first two the bounded estimator's errors are the same: 83 % of .0147 and 86
  % of .0144 leave .0025 and .0020, which cannot both be. An error of .03 takes 7 samples against 12: 42 % less, not
  50. With Q < R it is ahead from the 6th sample, not the 7th; 100 runs tell neither (a difference of .006 or .022 ±
  .02).
- Bandwidth. The order changes at .0099 and 8.8 rad/s, where the source read .0078 and 6.7: 100 runs leave ± .0045 and
  ± 5, and the bands of Figure 7 overlap everywhere. The reductions at the ends are 59 and 6 % (source 54 and 8). Some
  of the lower end is start-up: a Kalman filter with the first sample loses only below .0082 rad/s.
- Example 2. As the source says, no ratio favours the bounded estimator: in position it has 2.1 to 3.1 times the
  Kalman filter's error. That both hardly reduce the error of the measurement at large Q/R holds for the bounded one
  alone; at 81 the Kalman filter still takes away half. The bounded estimator learns next to nothing of the velocity,
  which is not measured: 1 or 2 % below its variance, and at R/Q = 81 above it: worse than to answer zero.
- Its own estimate is right on average for the constant only. With a disturbance the state is not uniform in its box:
  2.8 times the error in velocity is reached after 0.2 s of example 2, 19 times after 2.4 s.
- Example 3. Some 40 % less error in position with ±ū holds, and that for 0.7 s it is better than the Kalman filter
  (uniform: 0.5 s). The reason given does not: it is not that the signal becomes more uniform. At the same variance ±ū
  has a bound √3 times smaller, which the estimator is told; left with the old one it gains nothing (0.0 %).
)";

}  // namespace

int main(int argc, char** argv) {
  const Drawing draw{demo::output_directory(argc, argv, "<output directory>")};
  Summary summary;
  Counts counts;
  constants(draw, summary, counts);
  bandwidths(draw, summary, counts);
  table_5(summary, counts);
  ratios(draw, summary, counts);
  inputs(draw, summary, counts);
  summary.add("refused", counts.refused, "-");
  summary.add("violated", counts.violated, "-");
  summary.add("outside", counts.outside, "-");
  std::printf("%s", notes);
  summary.write(draw.directory / "summary.csv");
}
