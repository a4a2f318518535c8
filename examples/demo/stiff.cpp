// SPDX-License-Identifier: BSD-3-Clause
// A sensor so good that the Riccati equation is stiff: the oscillator of Rusnak 2018 with R = 1e-12 instead
// of 1e-5, P0 = I and an estimate that knows nothing, x̂ = 0. P starts to fall at a rate of P0/R = 1e12 a
// second and ends at some thousand, while the oscillator moves in seconds.
//
// Which integrator for that? Runge-Kutta steps of fixed length, the same cut in two where they are refused,
// Davison-Maki, and CVODE with Adams and BDF. The position is 1.5 cos(t/2) and y(t) holds no noise, so that
// all errors are the integrators'; RNLS throughout. The reference is BDF at 1e-12, which fine Runge-Kutta
// steps confirm.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <jml/continuous/cvode.hpp>
#include <jml/riccati/davison_maki.hpp>
#include <models/continuous.hpp>

#include "support/figure.hpp"
#include "support/output.hpp"

namespace {

using State = jml::Vector<double, 2>;
using Riccati = jml::Matrix<double, 2, 2>;
using Output = jml::Vector<double, 1>;
using Estimate = jml::Estimate<double, 2>;

constexpr double duration = 10, smallest = 1e-12;  // s; R, 1/Hz
const models::Oscillator oscillator;
const Estimate start{State(0, 0), Riccati::Identity()};

Output output(double time) {
  return models::SaturatingSignal{}.measurement(State(1.5 * std::cos(0.5 * time), 0));
}

/// Runge-Kutta pieces of an interval: cut in two where one is refused as too long, doubled where it is not.
/// Each accepted piece is taken in `substeps`, to see how accurate that is.
struct CutInTwo {
  int substeps = 1;
};

/// The samples of one run and what they cost.
struct Run {
  std::vector<Estimate> at;  // after each sample; as far as it came
  jml::Status status = jml::Status::ok;
  long first = 0, later = 0;  // evaluations of the first sample, of the others
  double time = NAN;          // µs of processor time a sample, the best of three runs
};

/// How y goes on between the samples: as the function it is, or held.
enum class Signal { function, held };

template <typename Filter>
auto step(Filter& filter, const models::SaturatingSignal& sensor, Signal signal, double sampled, double dt) {
  return signal == Signal::held ? filter.step(sensor, output(sampled), dt) : filter.step(sensor, output, dt);
}

template <typename Integrator>
Run run_once(const Integrator& integrator, double R, Signal signal = Signal::function, double dt = 0.1) {
  constexpr bool cut = std::is_same_v<Integrator, CutInTwo>;
  const models::SaturatingSignal sensor{.r = R};
  const auto engine = [&] {
    if constexpr (cut)
      return jml::RungeKutta4{integrator.substeps};
    else
      return integrator;
  }();
  jml::Filter filter{jml::Continuous{jml::Rnls{}, engine}, oscillator, start};
  jml::Filter judge{jml::Continuous{jml::Rnls{}}, oscillator, start};  // one step: may the piece be taken?
  const int samples = static_cast<int>(std::lround(duration / dt));
  Run out;
  double piece = dt;
  const std::clock_t begin = std::clock();
  for (int i = 0; i < samples && out.status == jml::Status::ok; ++i) {
    long& evaluations = i == 0 ? out.first : out.later;
    if constexpr (cut) {
      const double end = dt * (i + 1);
      while (out.status == jml::Status::ok && end - filter.time() > 1e-12 * end) {
        const double h = std::min(piece, end - filter.time());
        bool refused = false;
        if (integrator.substeps > 1) {
          (void)judge.reset(filter.estimate(), filter.time());
          refused = step(judge, sensor, signal, dt * i, h).status == jml::Status::step_too_long;
        }
        if (!refused) {
          const auto report = step(filter, sensor, signal, dt * i, h);
          refused = report.status == jml::Status::step_too_long;
          if (!refused) out.status = report.status;
          evaluations += refused ? 4 : report.evaluations;  // a refusal costs at most a step
        }
        if (refused)
          piece = h / 2;
        else if (h == piece)
          piece = 2 * h;
        if (!(piece > 1e-20)) out.status = jml::Status::step_too_long;
      }
    } else {
      const auto report = step(filter, sensor, signal, dt * i, dt);
      out.status = report.status;
      evaluations += report.evaluations;
    }
    if (out.status == jml::Status::ok) out.at.push_back(filter.estimate());
  }
  out.time = 1e6 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / samples;
  return out;
}

template <typename Integrator>
Run run(const Integrator& integrator, double R, Signal signal = Signal::function, double dt = 0.1) {
  Run out = run_once(integrator, R, signal, dt);
  for (int again = 0; again < 2; ++again)
    out.time = std::min(out.time, run_once(integrator, R, signal, dt).time);
  return out;
}

jml::Cvode cvode(jml::CvodeMethod method, double tolerance) {
  return {{.method = method,
           .relative_tolerance = tolerance,
           .absolute_tolerance = 1e-6 * tolerance,
           .max_steps = 100000}};
}
jml::Cvode bdf(double tolerance) { return cvode(jml::CvodeMethod::bdf, tolerance); }
Run reference(double R, Signal signal = Signal::function, double dt = 0.1) {
  return run_once(bdf(1e-12), R, signal, dt);
}

/// Largest differences from t = 1 s on, and of P22 after the first sample.
struct Distance {
  double position = NAN, velocity = NAN, P22 = NAN, first = NAN;
};

Distance between(const Run& a, const Run& reference) {
  Distance d;
  if (a.at.empty() || a.at.size() != reference.at.size()) return d;
  d = {0, 0, 0, std::abs(a.at[0].P(1, 1) / reference.at[0].P(1, 1) - 1)};
  for (std::size_t i = a.at.size() / 10; i < a.at.size(); ++i) {
    const State x = (a.at[i].x - reference.at[i].x).cwiseAbs();
    d.position = std::max(d.position, x(0));
    d.velocity = std::max(d.velocity, x(1));
    d.P22 = std::max(d.P22, std::abs(a.at[i].P(1, 1) / reference.at[i].P(1, 1) - 1));
  }
  return d;
}

std::string short_name(jml::Status status) {
  switch (status) {
    case jml::Status::ok:
      return "ok";
    case jml::Status::step_too_long:
      return "step_too_long";
    case jml::Status::step_limit:
      return "step_limit";
    default:
      return jml::describe(status);
  }
}

/// One table of integrators, and its rows of the summary.
class Comparison {
 public:
  Comparison(demo::Summary& summary, std::string prefix, double R, Signal signal, double dt)
      : summary_(summary),
        prefix_(std::move(prefix)),
        R_(R),
        signal_(signal),
        dt_(dt),
        reference_(reference(R, signal, dt)) {}

  template <typename Integrator>
  void row(const std::string& name, const std::string& key, const Integrator& integrator) {
    const Run r = run(integrator, R_, signal_, dt_);
    const Distance d = between(r, reference_);
    const bool whole = r.status == jml::Status::ok;
    const auto later = static_cast<double>(r.later) / static_cast<double>(reference_.at.size() - 1);
    table_.add({name, short_name(r.status), whole ? std::to_string(r.first) : "-",
                demo::text("%.1f", whole ? later : NAN), demo::text("%.1e", d.first),
                demo::text("%.1e", d.position), demo::text("%.1e", d.velocity), demo::text("%.1e", d.P22),
                demo::text("%.1f", whole ? r.time : NAN)});
    const std::string prefix = prefix_ + "_" + key;
    summary_.add(prefix + "_ok", whole, "-");
    summary_.add(prefix + "_step_too_long", r.status == jml::Status::step_too_long, "-");
    if (!whole) return;
    summary_.add(prefix + "_first_P22", d.first, "-");
    summary_.add(prefix + "_position", d.position, "-");
    summary_.add(prefix + "_velocity", d.velocity, "1/s");
    summary_.add(prefix + "_P22", d.P22, "-");
    summary_.add(prefix + "_evaluations_later", later, "-");
  }
  void print() const { table_.print(); }

 private:
  demo::Summary& summary_;
  std::string prefix_;
  double R_;
  Signal signal_;
  double dt_;
  Run reference_;
  demo::Table table_{{"", "status", "evaluations: first sample", "later, each", "P₂₂ after the first",
                      "ξ̂, t ≥ 1 s", "velocity", "P₂₂", "µs a sample"}};
};

/// The least number of Runge-Kutta substeps for the first sample: the fixed step may not be longer than 1.39
/// over the rate E K, which is largest at the start.
double least_substeps(double R) { return std::ceil(0.1 * start.P(0, 0) / R / 1.39); }

void over_sensors(demo::Summary& summary, const std::filesystem::path& directory) {
  std::printf(
      "\nThe same over R: the fixed substeps that the first sample wants; µs a sample and the largest error "
      "of the\n"
      "velocity from 1 s on.\n\n");
  demo::Table table({"R (1/Hz)", "RK4 substeps", "accepted, one less", "RK4 cut: µs", "error",
                     "Adams 1e-6: µs", "error", "BDF 1e-6: µs", "error", "DavisonMaki, 16: µs", "error"});
  demo::Series curves[4] = {
      {"Runge-Kutta, cut in two", demo::colour::blue, {}, {}, "linespoints pt 7 ps 0.7 lw 1.5"},
      {"CVODE, Adams", demo::colour::orange, {}, {}, "linespoints pt 9 ps 0.8 lw 1.5"},
      {"CVODE, BDF", demo::colour::red, {}, {}, "linespoints pt 5 ps 0.7 lw 1.5"},
      {"Davison-Maki, 16 substeps", demo::colour::green, {}, {}, "linespoints pt 13 ps 0.9 lw 1.5"}};
  demo::Panel errors{"error of the velocity (1/s)", {}};
  demo::Series error_curves[4] = {curves[0], curves[1], curves[2], curves[3]};
  for (auto& curve : error_curves) curve.label.clear();
  for (int decade = 4; decade <= 14; decade += 2) {
    const double R = std::pow(10.0, -decade);
    const double substeps = least_substeps(R);
    std::string accepted = "not tried";
    if (substeps < 1e6) {
      const models::SaturatingSignal sensor{.r = R};
      const auto first = [&](double count) {
        jml::Filter filter{jml::Continuous{jml::Rnls{}, jml::RungeKutta4{static_cast<int>(count)}},
                           oscillator, start};
        return filter.step(sensor, output, 0.1).status;
      };
      const jml::Status enough = first(substeps), fewer = first(substeps - 1);
      accepted = short_name(enough) + ", " + short_name(fewer);
      summary.add("substeps_1e-" + std::to_string(decade) + "_enough", enough == jml::Status::ok, "-");
      summary.add("substeps_1e-" + std::to_string(decade) + "_one_less_refused",
                  fewer == jml::Status::step_too_long, "-");
    }
    std::vector<std::string> row{demo::text("%.0e", R), demo::text("%.2g", substeps), accepted};
    const Run exact = reference(R);
    int curve = 0;
    const auto add = [&](const char* key, const Run& r) {
      const double velocity = between(r, exact).velocity;
      row.push_back(demo::text("%.1f", r.status == jml::Status::ok ? r.time : NAN));
      row.push_back(demo::text("%.0e", velocity));
      summary.add(std::string("over_R_1e-") + std::to_string(decade) + "_" + key + "_velocity", velocity,
                  "1/s");
      summary.add(std::string("over_R_1e-") + std::to_string(decade) + "_" + key + "_evaluations",
                  static_cast<double>(r.first + r.later), "-");
      if (r.status == jml::Status::ok) {
        curves[curve].x.push_back(R);
        curves[curve].y.push_back(r.time);
        error_curves[curve].x.push_back(R);
        error_curves[curve].y.push_back(velocity);
      }
      ++curve;
    };
    add("cut", run(CutInTwo{}, R));
    add("adams", run(cvode(jml::CvodeMethod::adams, 1e-6), R));
    add("bdf", run(bdf(1e-6), R));
    add("davison_maki_16", run(jml::DavisonMaki{.substeps = 16}, R));
    table.add(row);
  }
  table.print();
  demo::Panel times{"time of a 0.1 s sample (µs)", {curves[0], curves[1], curves[2], curves[3]}};
  errors.series = {error_curves[0], error_curves[1], error_curves[2], error_curves[3]};
  times.options = "set logscale xy; set format '10^{%T}'; set xrange [2e-4:5e-15]";
  errors.options = times.options;
  demo::Figure{"Cost and accuracy against the quality of the sensor (times of this run)",
               "spectral density R (1/Hz)",
               {times, errors},
               900,
               760}
      .write(directory / "fig03_over_R.svg",
             "Of no source. RNLS on the oscillator of Rusnak 2018 by four integrators.");
}

/// P and the steps over the initial transient, from 1e-14 s on.
void draw_transient(const std::filesystem::path& directory) {
  using namespace demo;
  const models::SaturatingSignal sensor{.r = smallest};
  jml::Filter filter{jml::Continuous{jml::Rnls{}, bdf(1e-6)}, oscillator, start};
  Series p11{"P₁₁ (-)", colour::blue, {}, {}, "lines lw 1.6"},
      p22{"P₂₂ (1/s²)", colour::red, {}, {}, "lines lw 1.6"},
      permitted{"longest Runge-Kutta step, 1.39 / E K", colour::blue, {}, {}, "lines lw 1.6"},
      taken{"mean step of BDF at 1e-6", colour::red, {}, {}, "lines lw 1.6"};
  double next = 1e-14;
  for (int i = 0; i <= 8 * 15; ++i) {
    const double t = filter.time(), dt = next - t;
    const double M = 1 / std::sqrt(1 + filter.x()(0) * filter.x()(0));
    const auto report = filter.step(sensor, output, dt);
    if (report.status != jml::Status::ok) return;
    p11.x.push_back(next);
    p11.y.push_back(filter.P()(0, 0));
    p22.x.push_back(next);
    p22.y.push_back(filter.P()(1, 1));
    permitted.x.push_back(next);
    permitted.y.push_back(1.39 / (M * report.gain(0)));
    taken.x.push_back(next);
    taken.y.push_back(dt / static_cast<double>(std::max(report.steps, 1L)));
    next *= std::pow(10.0, 1.0 / 8);
  }
  const char* axes = "set logscale xy; set format '10^{%T}'; set xrange [1e-14:10]";
  Figure{"The first ten seconds at R = 1e-12",
         "time (s)",
         {{"terms of P (-, 1/s²)", {p11, p22}, axes}, {"step (s)", {permitted, taken}, axes}},
         900,
         760}
      .write(directory / "fig01_transient.svg", "Of no source. RNLS on the oscillator of Rusnak 2018.");
}

void draw_work(const std::filesystem::path& directory) {
  using namespace demo;
  const Run exact = reference(smallest);
  Series curves[4] = {{"Runge-Kutta, cut in two", colour::blue, {}, {}, "linespoints pt 7 ps 0.7 lw 1.5"},
                      {"CVODE, Adams", colour::orange, {}, {}, "linespoints pt 9 ps 0.8 lw 1.5"},
                      {"CVODE, BDF", colour::red, {}, {}, "linespoints pt 5 ps 0.7 lw 1.5"},
                      {"Davison-Maki", colour::green, {}, {}, "linespoints pt 13 ps 0.9 lw 1.5"}};
  const auto add = [&](Series& curve, const Run& r) {
    if (r.status != jml::Status::ok) return;
    curve.x.push_back(r.time);
    curve.y.push_back(between(r, exact).velocity);
  };
  for (const int substeps : {1, 2, 4, 8}) add(curves[0], run(CutInTwo{substeps}, smallest));
  for (const double tolerance : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
    add(curves[1], run(cvode(jml::CvodeMethod::adams, tolerance), smallest));
    add(curves[2], run(bdf(tolerance), smallest));
  }
  for (const int substeps : {1, 4, 16, 64, 256, 1024, 4096})
    add(curves[3], run(jml::DavisonMaki{.substeps = substeps}, smallest));
  Panel panel{"largest error of the velocity, t ≥ 1 s (1/s)", {curves[0], curves[1], curves[2], curves[3]}};
  panel.options = "set logscale xy; set format '10^{%T}'";
  Figure{
      "Work and precision at R = 1e-12 (times of this run)", "time of a 0.1 s sample (µs)", {panel}, 900, 520}
      .write(directory / "fig02_work_precision.svg",
             "Of no source. RNLS on the oscillator of Rusnak 2018 by four integrators, R = 1e-12.");
}

constexpr const char* notes = R"(
- A fixed explicit step must be short enough for the first instant, for good: 72 thousand million of them in the first 0.1 s
  at R = 1e-12. The refusal (step_too_long) comes before anything has moved, so a caller may cut the interval in two and
  double it again later, as here. That is a good integrator until the settled filter is stiff itself.
- BDF's steps fit the motion, not the rate (first figure), so that its cost grows slowly with 1/R: six times over ten
  decades. It overtakes the cut Runge-Kutta steps between R = 1e-10 and 1e-12; at 1e-14 it is three to four times faster, at an
  error of 1e-5. It needs a y(t) that goes on smoothly.
- Where y is held CVODE starts afresh at every sample, and loses by a factor of 20 to 100 (last two tables).
- Davison-Maki never refuses here, uses no heap, and costs little more for any R: an estimate at once, P₂₂ within
  five per cent with a single substep. With held samples at R = 1e-8 it is as good as Runge-Kutta in the same time, or better
  with more substeps. But it does not resolve the first instant (P after the first sample is off by up to a half, and
  forgotten later), and within a substep it takes M for the slope of m, as its equation for P does: where y(t) moves, the
  velocity is off by (1 + ξ²) until a substep is shorter than the filter's own time constant, (R/Q)^¼, a millisecond at 1e-12.
  (With Jacobians in both places, as in the EKF's row, there is no such error.) BDF is a thousand times more accurate in the same time.
)";

}  // namespace

int main(int argc, char** argv) {
  const auto directory = demo::output_directory(argc, argv, "<output directory>");
  demo::Summary summary;
  const Distance check = between(run_once(CutInTwo{16}, smallest), reference(smallest));
  std::printf(
      "RNLS with R = 1e-12, P0 = I, x̂ = 0; ξ = 1.5 cos(t/2), y(t) without noise, samples of 0.1 s for 10 s. "
      "Differences from\n"
      "BDF at 1e-12, which Runge-Kutta in sixteenths of the pieces it is allowed confirms to %.0e (ξ̂), %.0e "
      "(velocity),\n"
      "%.0e (P₂₂), relative where P. Evaluations: of x' and P'; Davison-Maki's are of its coefficients.\nµs: "
      "processor time, the best of three runs.\n\n",
      check.position, check.velocity, check.P22);
  summary.add("reference_position", check.position, "-");
  summary.add("reference_velocity", check.velocity, "1/s");
  summary.add("reference_P22", check.P22, "-");
  summary.add("reference_first_P22", check.first, "-");

  {
    Comparison table(summary, "function", smallest, Signal::function, 0.1);
    table.row("RungeKutta4, 1 substep", "rk4_1", jml::RungeKutta4{});
    table.row("RungeKutta4, a million", "rk4_1e6", jml::RungeKutta4{1000000});
    table.row("  cut in two where refused", "cut", CutInTwo{});
    table.row("  the same, pieces in 4", "cut_4", CutInTwo{4});
    table.row("DavisonMaki, 1 substep", "davison_maki_1", jml::DavisonMaki{});
    table.row("  16", "davison_maki_16", jml::DavisonMaki{.substeps = 16});
    table.row("  256", "davison_maki_256", jml::DavisonMaki{.substeps = 256});
    table.row("  4096", "davison_maki_4096", jml::DavisonMaki{.substeps = 4096});
    table.row("Cvode, Adams, 1e-6", "adams", cvode(jml::CvodeMethod::adams, 1e-6));
    table.row("Cvode, BDF, 1e-4", "bdf_4", bdf(1e-4));
    table.row("  1e-6", "bdf_6", bdf(1e-6));
    table.row("  1e-9", "bdf_9", bdf(1e-9));
    table.print();
  }
  over_sensors(summary, directory);
  for (const double R : {1e-8, smallest}) {
    std::printf("\nR = %.0e, y sampled every 10 ms and held:\n\n", R);
    Comparison table(summary, R == smallest ? "held_1e-12" : "held_1e-8", R, Signal::held, 0.01);
    table.row("RungeKutta4, cut in two", "cut", CutInTwo{});
    table.row("DavisonMaki, 1 substep", "davison_maki_1", jml::DavisonMaki{});
    table.row("  4", "davison_maki_4", jml::DavisonMaki{.substeps = 4});
    table.row("  16", "davison_maki_16", jml::DavisonMaki{.substeps = 16});
    table.row("Cvode, BDF, 1e-6", "bdf_6", bdf(1e-6));
    table.print();
  }
  draw_transient(directory);
  draw_work(directory);
  std::printf("%s", notes);
  summary.write(directory / "summary.csv");
}
