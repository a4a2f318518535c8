// SPDX-License-Identifier: BSD-3-Clause
// Real data: a robot finds its way by odometry and by ranges to four radio tags, Plaza 1
// (examples/data/plaza1/README.md).
//
// One row of odometry is one step, and its distance and turn are the control input. The ranges that arrived
// during a row are used at its end: the first one together with the row, filter.step(), because the iterated
// JML step couples the two; any further one with filter.update(); a row without ranges is filter.predict().
// For the one-pass rules step() is predict() and update() in one.
#include <cstdio>
#include <jml/analysis/nees.hpp>
#include <jml/jml.hpp>
#include <string>

#include "support/figure.hpp"
#include "support/output.hpp"
#include "support/plaza.hpp"
#include "support/statistics.hpp"

namespace {

using demo::Plaza;

constexpr double expected_bias = 2.75;  // m, the middle of the range errors of these same data

/// A place to count from that means something here: the middle of the tags and the bias to be expected.
jml::Vector<double, 7> middle_of_tags(const Plaza& data) {
  jml::Vector<double, 7> point = jml::Vector<double, 7>::Constant(expected_bias);
  point.head<3>().setZero();
  for (const auto& tag : data.tags) point.head<2>() += jml::Vector<double, 2>(tag[1], tag[2]) / 4;
  return point;
}

constexpr const char* notes = R"(
Costs: the one-step criterion (11) of every range that was used, in total and a range, each from the filter's own prior
(from a narrower P or after more rejections it counts less: compare it only beside the RMSE). no NIS: sym(S) was not
positive, and a gate lets no such range pass. * undefined at some rows, where sym(P) is indefinite; over the others.
Times: a range with the row before it, median, one run on a shared machine: noisy.

- The EKF with a bias per tag is the filter to use here. About the estimate SDDRE and JML are the EKF, identically, and
  the iterated JML differs by a millimetre in RMSE: over one row everything is nearly linear.
- About the origin, or any fixed point, they lose the robot. M (x - r) = m(x) - m(r) holds along the chord from r, and r
  means nothing to a range from a tag: M is no slope, P shrinks or turns indefinite, and the gate rejects good ranges.
  These rows are shown as they came out. How far they stray is chance: JML about the origin is some 50 m away until, at
  1430 s, one range with an S of 0.66 m², where the Jacobians give 105 m², throws it 400 m. JML is optimal sample by
  sample in its criterion, not in RMSE.
- The position NEES stays near 8 where 2 is expected: white noise is a wrong model of these radios, whose errors last.
  That of a nonsymmetric P is descriptive only, since that P is no covariance.
- The odometry's turns equal those of the ground truth to rounding: heading is no independent truth, and is not judged.
)";

struct Result {
  std::string name, key;
  demo::Mean squared_error, nees, cost;
  int rejected = 0, refused = 0, no_nis = 0;
  double largest_error = 0;
  demo::Stopwatch watch;
  std::vector<double> time, x, y, error;

  Result(std::string n, std::string k) : name(std::move(n)), key(std::move(k)) {}
};

template <int tags, typename Rule>
Result run(const std::string& name, const std::string& key, const Plaza& data, const Rule& rule,
           bool use_ranges = true) {
  Result out(name, key);
  const models::PlazaRobot<tags> robot;
  jml::Filter filter{rule, robot, demo::start<tags>(data), data.truth[0][0]};
  filter.gate = {0.999};
  std::size_t next = 0;
  for (std::size_t row = 0; row < data.odometry.size(); ++row) {
    const auto [time, distance, turn] = data.odometry[row];
    const double dt = time - filter.time();
    const jml::Vector<double, 2> control(distance, turn);
    bool moved = false;
    for (; use_ranges && next < data.ranges.size() && data.ranges[next][0] <= time; ++next) {
      const double range = data.ranges[next][2];
      const auto radio = data.radio<tags>(data.ranges[next]);
      const auto prior = filter.estimate();
      const jml::StepContext<double, 2> at{filter.time(), dt, control};
      out.watch.start();
      const auto report = moved ? filter.update(radio, range) : filter.step(radio, range, dt, control);
      out.watch.stop();
      out.rejected += report.gate == jml::Verdict::rejected;
      out.refused += !jml::usable(report.status);
      out.no_nis += std::isnan(report.nis());
      const jml::Vector<double, 1> y(range);
      const auto cost = moved ? jml::one_step_cost(rule, jml::Stay<3 + tags>{}, radio, prior, y, {}, report)
                              : jml::one_step_cost(rule, robot, radio, prior, y, at, report);
      if (report.gate == jml::Verdict::accepted) out.cost.add(cost.value);
      moved = moved || jml::usable(report.status);
    }
    if (!moved && !jml::usable(filter.predict(dt, control))) ++out.refused;

    const jml::Vector<double, 2> error = filter.x().template head<2>() - data.position(row);
    out.squared_error.add(error.squaredNorm());
    out.largest_error = std::max(out.largest_error, error.norm());
    out.nees.add(jml::nees(error, filter.P().template topLeftCorner<2, 2>()));
    out.time.push_back(time - data.truth[0][0]);
    out.x.push_back(filter.x()(0));
    out.y.push_back(filter.x()(1));
    out.error.push_back(error.norm());
  }
  return out;
}

void draw(const std::filesystem::path& directory, const Plaza& data, const std::vector<Result>& results) {
  using namespace demo;
  const auto result = [&results](const char* key) -> const Result& {
    return *std::find_if(results.begin(), results.end(), [key](const Result& r) { return r.key == key; });
  };
  const auto path = [&](const char* key, const char* label, const char* ink) {
    return Series{label, ink, thinned(result(key).x, 3000), thinned(result(key).y, 3000), "lines lw 1.2"};
  };
  const Series truth{"ground truth", colour::black, thinned(column(data.truth, 1), 3000),
                     thinned(column(data.truth, 2), 3000), "lines lw 2.4"};
  const Series tags{"radio tags", colour::purple, column(data.tags, 1), column(data.tags, 2),
                    "points pt 9 ps 1.6"};
  Figure{"Plaza 1: ground truth and estimates",
         "x (m)",
         {{"y (m)",
           {truth, path("dead_reckoning", "dead reckoning", colour::orange),
            path("ekf", "EKF with biases (JML about the estimate is the same)", colour::blue), tags},
           "set size ratio -1\nset key below\nset xrange [-55:35]\nset yrange [-15:72]"}},
         900,
         920}
      .write(directory / "map.svg", "Of no source; data of Plaza 1. The filter is the EKF with four biases.");
  const auto error = [&](const char* key, const char* label, const char* ink) {
    return Series{label, ink, thinned(result(key).time), thinned(result(key).error), "lines lw 1.2"};
  };
  Figure{"Plaza 1: distance of the estimate from the ground truth",
         "time (s)",
         {{"position error (m)",
           {error("ekf", "EKF with biases", colour::blue),
            error("ekf_without_biases", "EKF without", colour::sky),
            error("dead_reckoning", "dead reckoning", colour::orange),
            error("sddre_origin", "SDDRE about the origin", colour::green),
            error("iterated_origin", "iterated JML about the origin", colour::purple),
            error("jml_origin", "JML about the origin", colour::red)},
           "set logscale y\nset yrange [0.01:1000]\nset key below"}},
         900,
         620}
      .write(directory / "error.svg",
             "Of no source; data of Plaza 1. EKF with and without biases, and rules about an origin that "
             "means nothing.");
}

}  // namespace

int main(int argc, char** argv) {
  const auto directory = demo::output_directory(argc, argv, "<output directory> [<data directory>]");
  const Plaza data(argc > 2 ? argv[2] : PLAZA1_DATA);
  const jml::AboutPoint middle{middle_of_tags(data)};
  const jml::AboutEstimate estimate;

  std::vector<Result> results;
  results.push_back(run<0>("dead reckoning", "dead_reckoning", data, jml::Ekf{}, false));
  results.push_back(run<0>("EKF without biases", "ekf_without_biases", data, jml::Ekf{}));
  results.push_back(run<4>("EKF", "ekf", data, jml::Ekf{}));
  results.push_back(run<4>("SDDRE about the origin", "sddre_origin", data, jml::Sddre{}));
  results.push_back(run<4>("SDDRE about the tags' middle", "sddre_point", data, jml::Sddre{middle}));
  results.push_back(run<4>("SDDRE about the estimate", "sddre_estimate", data, jml::Sddre{estimate}));
  results.push_back(run<4>("JML about the origin", "jml_origin", data, jml::Jml{}));
  results.push_back(run<4>("JML about the tags' middle", "jml_point", data, jml::Jml{middle}));
  results.push_back(run<4>("JML about the estimate", "jml_estimate", data, jml::Jml{estimate}));
  results.push_back(run<4>("iterated JML about the origin", "iterated_origin", data, jml::IteratedJml{}));
  results.push_back(
      run<4>("iterated JML about the tags' middle", "iterated_point", data, jml::IteratedJml{middle}));
  results.push_back(
      run<4>("iterated JML about the estimate", "iterated_estimate", data, jml::IteratedJml{estimate}));

  std::printf("Plaza 1: %zu odometry rows, %zu ranges, gate 99.9 %%; position against the ground truth.\n\n",
              data.odometry.size(), data.ranges.size());
  demo::Table table({"", "RMSE m", "largest m", "NEES", "rejected", "no NIS", "refused", "sum of costs",
                     "a range", "median ns"});
  demo::Summary summary, timing;
  for (auto& r : results) {
    table.add({r.name, demo::text("%.3f", r.squared_error.root()), demo::text("%.2f", r.largest_error),
               demo::starred("%.3g", r.nees.value(), r.nees.missing()), std::to_string(r.rejected),
               std::to_string(r.no_nis), std::to_string(r.refused),
               demo::starred("%.1f", r.cost.sum(), r.cost.missing()), demo::text("%.3f", r.cost.value()),
               demo::text("%.0f", r.watch.median())});
    summary.add(r.key + "_rmse", r.squared_error.root(), "m");
    summary.add(r.key + "_largest_error", r.largest_error, "m");
    summary.add(r.key + "_nees", r.nees.value(), "-");
    summary.add(r.key + "_nees_undefined", r.nees.missing(), "-");
    summary.add(r.key + "_rejected", r.rejected, "-");
    summary.add(r.key + "_no_nis", r.no_nis, "-");
    summary.add(r.key + "_refused", r.refused, "-");
    summary.add(r.key + "_cost", r.cost.sum(), "-");
    timing.add(r.key + "_range_ns", r.watch.median(), "ns");
  }
  table.print();
  std::printf("%s", notes);
  summary.write(directory / "summary.csv");
  timing.write(directory / "timing.csv");
  draw(directory, data, results);
}
