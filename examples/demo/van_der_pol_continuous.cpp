// SPDX-License-Identifier: BSD-3-Clause
// The example of the discrete paper (Rusnak 2015, eqs. (19)-(23)) once more, by the filter in continuous
// time: without noise (case i, Figures 1-6) and with both noises (case ii, Figures 7-12), beside the discrete
// filters, which must become the continuous ones as the step goes to zero.
//
// What the paper leaves open is chosen as in van_der_pol.cpp: the true state starts at (2, 0), the estimate
// at (1, 1), the noises are held for π/100 s, samples come every π/1000 s, and the seeds are the same.
// Between samples the continuous filter sees a straight line, which is what y(t) is but for its curvature.
#include <jml/filter/filter.hpp>
#include <map>
#include <numbers>

#include "support/oscillator.hpp"
#include "support/output.hpp"
#include "support/statistics.hpp"

namespace {

using demo::Between, demo::Riccati, demo::State, demo::Track, demo::simulate;

constexpr double dt = std::numbers::pi / 1000, duration = 20;      // s
constexpr double measurement_density = 1e-3, driving_density = 1;  // R_c 1/Hz, Q_c (1/s²)²/Hz
constexpr std::size_t steps = static_cast<std::size_t>(duration / dt), runs = 100;
constexpr std::size_t finest = 32;  // grid points of the refinement in a sample
const models::Oscillator oscillator{.mu = 1, .c = 0.1, .k = 1, .q = driving_density};
const models::SaturatingSignal sensor{.r = measurement_density};
const State truth(2, 0);
const jml::Estimate<double, 2> start{{1, 1}, Riccati::Zero()};

Track track(bool with_noise, std::uint64_t seed, std::size_t refined = 1) {
  const demo::HeldNoise noise{driving_density, measurement_density, 10 * refined, seed};
  return simulate(oscillator, truth, dt / static_cast<double>(refined), steps * refined,
                  with_noise ? &noise : nullptr, refined == 1 ? 4 : 1);
}

template <typename Rule>
auto continuous(const Rule& rule) {
  return jml::Filter{jml::Continuous{rule}, oscillator, start};
}

/// The discrete filter with steps of h: R = R_c/h, Q = Q_c/h.
template <typename Rule, typename Observer>
int follow_discrete(const Rule& rule, const Track& track, std::size_t stride, const Observer& observe) {
  const double h = track.dt * static_cast<double>(stride);
  const models::VanDerPol dynamics{.dt = h, .q_c = driving_density};
  const models::SaturatingPosition sampled{.r = measurement_density / h};
  jml::Filter filter{rule, dynamics, start};
  int refused = 0;
  for (std::size_t i = stride; i <= track.steps(); i += stride) {
    refused += !jml::usable(filter.step(sampled, track.y_until(i)).status);
    observe(i, filter.estimate());
  }
  return refused;
}

/// use(name, key, rule, the discrete rule).
template <typename Use>
void each_rule(const Use& use) {
  use("EKF", "ekf", jml::Ekf{}, jml::Ekf{});
  use("SDDRE", "sddre", jml::Sddre{}, jml::Sddre{});
  use("RNLS, discrete: JML one pass", "rnls", jml::Rnls{}, jml::Jml{});
}

struct Result {
  demo::Mean position, velocity;  // squared errors
  double asymmetry = 0;           // largest |P12 - P21|
  int refused = 0;

  void add(const jml::Estimate<double, 2>& estimate, const State& x) {
    const State error = estimate.x - x;
    position.add(error(0) * error(0));
    velocity.add(error(1) * error(1));
    asymmetry = std::max(asymmetry, std::abs(estimate.P(0, 1) - estimate.P(1, 0)));
  }
};

void compare(const std::string& key, bool with_noise, demo::Summary& summary) {
  std::map<std::string, Result> in_time, in_steps;
  for (std::size_t seed = 1; seed <= (with_noise ? runs : 1); ++seed) {
    const Track t = track(with_noise, seed);
    each_rule([&](const char*, const std::string& rule_key, const auto& rule, const auto& discrete) {
      auto filter = continuous(rule);
      Result &a = in_time[rule_key], &b = in_steps[rule_key];
      a.refused += follow(filter, sensor, t, 1, Between::line,
                          [&](std::size_t i, const auto&) { a.add(filter.estimate(), t.x[i]); });
      b.refused += follow_discrete(discrete, t, 1,
                                   [&](std::size_t i, const auto& estimate) { b.add(estimate, t.x[i]); });
    });
  }
  demo::Table table({"", "RMSE position", "velocity 1/s", "max |P₁₂-P₂₁|", "refused",
                     "discrete: RMSE position", "velocity", "max |P₁₂-P₂₁|", "refused"});
  each_rule([&](const char* name, const std::string& rule_key, const auto&, const auto&) {
    std::vector<std::string> row{name};
    for (const bool discrete : {false, true}) {
      const Result& r = (discrete ? in_steps : in_time)[rule_key];
      row.push_back(demo::text("%.5f", r.position.root()));
      row.push_back(demo::text("%.5f", r.velocity.root()));
      row.push_back(demo::text("%.4f", r.asymmetry));
      row.push_back(std::to_string(r.refused));
      const std::string prefix = key + "_" + rule_key + (discrete ? "_discrete" : "");
      summary.add(prefix + "_position_rmse", r.position.root(), "-");
      summary.add(prefix + "_velocity_rmse", r.velocity.root(), "1/s");
      summary.add(prefix + "_asymmetry", r.asymmetry, "1/s");
      summary.add(prefix + "_refused", r.refused, "-");
    }
    table.add(row);
  });
  table.print();
}

/// RMS distance of the discrete from the continuous estimate, and of their P, as both take shorter steps.
void refine(const std::string& key, bool with_noise, demo::Summary& summary, demo::Series* curve) {
  const Track t = track(with_noise, 1, finest);
  std::vector<std::string> header{""};
  for (std::size_t part = 1; part <= finest; part *= 2)
    header.push_back(part == 1 ? "h = π/1000 s" : "h/" + std::to_string(part));
  header.push_back("order");
  demo::Table table(header);
  each_rule([&](const char* name, const std::string& rule_key, const auto& rule, const auto& discrete) {
    std::vector<double> x_distance, P_distance;
    for (std::size_t stride = finest; stride >= 1; stride /= 2) {
      auto filter = continuous(rule);
      std::vector<jml::Estimate<double, 2>> reference;
      (void)follow(filter, sensor, t, stride, Between::line,
                   [&](std::size_t, const auto&) { reference.push_back(filter.estimate()); });
      demo::Mean x, P;
      std::size_t at = 0;
      (void)follow_discrete(discrete, t, stride, [&](std::size_t, const jml::Estimate<double, 2>& estimate) {
        x.add((estimate.x - reference[at].x).squaredNorm());
        P.add((estimate.P - reference[at].P).squaredNorm());
        ++at;
      });
      x_distance.push_back(x.root());
      P_distance.push_back(P.root());
      if (curve != nullptr && rule_key == "rnls") {
        curve->x.push_back(t.dt * static_cast<double>(stride));
        curve->y.push_back(x.root());
      }
    }
    const auto row = [&](const std::string& label, const std::string& what, const std::vector<double>& d) {
      std::vector<std::string> cells{label};
      for (const double value : d) cells.push_back(demo::text("%.2e", value));
      const double order = std::log2(d[d.size() - 2] / d.back());
      cells.push_back(demo::text("%.3f", order));
      table.add(cells);
      summary.add(key + "_" + rule_key + "_" + what + "_distance", d.front(), "mixed");
      summary.add(key + "_" + rule_key + "_" + what + "_order", order, "-");
    };
    row(std::string(name) + ": x̂", "x", x_distance);
    row("  P", "P", P_distance);
  });
  table.print();
}

/// Six figures of one case, from `first` on.
void draw(const std::filesystem::path& directory, int first, const std::string& condition, const Track& t) {
  using namespace demo;
  History history;
  history.every = 5;
  auto filter = continuous(jml::Rnls{});
  history.begin(t, filter, sensor.r);
  (void)follow(filter, sensor, t, 1, Between::line,
               [&](std::size_t i, const auto& report) { history.record(t, i, filter, report); });
  std::vector<double> output_error;
  for (std::size_t i = 0; i < history.t.size(); ++i)
    output_error.push_back(output(State(history.x[i], 0)) - history.y_hat[i]);
  const auto figure = [&](int number, const std::string& title, std::vector<Panel> panels) {
    write_figure(directory, first + number, title + ", " + condition, std::move(panels),
                 "Redraws Figure " + std::to_string(first + number) +
                     " of Rusnak 2015. The filter is RNLS, in continuous time; one flight.");
  };
  figure(0, "Output", history.output_panels());
  figure(1, "Position", history.position_panels());
  figure(2, "Estimation errors",
         {{"error (-)",
           {history.line("position, ξ - ξ̂", colour::blue, History::minus(history.x, history.x_hat)),
            history.line("output, m(x) - m(x̂)", colour::red, output_error)}}});
  figure(3, "Velocity", history.velocity_panels());
  figure(4, "Gains", history.gain_panels());
  figure(5, "Terms of P", history.riccati_panels());
}

constexpr const char* notes = R"(
- The continuous filters and the discrete ones with R = R_c/h, Q = Q_c/h are the same filter in the limit: their distance is
  proportional to the step, for x̂ and P, without noise and with it. (The noise is one function of time here, whatever
  the step; with noise that becomes wider as the step shrinks this need not be so.)
- So the figures and the RMSE are those of van_der_pol, and so is the verdict: nothing beats the EKF in RMSE.
)";

}  // namespace

int main(int argc, char** argv) {
  const auto directory = demo::output_directory(argc, argv, "<output directory>");
  demo::Summary summary;
  std::printf(
      "The oscillator of Rusnak 2015 (c = 0.1, k = 1, R_c = 1e-3, Q_c = 1, P0 = 0), truth from (2, 0), "
      "estimate from\n"
      "(1, 1), %.0f s, samples every π/1000 s. RungeKutta4, one step a sample.\n\nCase (i), no noise:\n\n",
      duration);
  compare("quiet", false, summary);
  draw(directory, 1, "no noise", track(false, 1));
  std::printf("\nCase (ii), both noises, %zu runs:\n\n", runs);
  compare("noisy", true, summary);
  draw(directory, 7, "both noises", track(true, 1));

  demo::Series quiet{"no noise", demo::colour::blue, {}, {}, "linespoints pt 7 ps 0.7 lw 1.5"};
  demo::Series noisy{"both noises", demo::colour::red, {}, {}, "linespoints pt 5 ps 0.7 lw 1.5"};
  std::printf("\nRMS distance of discrete and continuous filter, both with steps of h, no noise:\n\n");
  refine("quiet", false, summary, &quiet);
  std::printf("\nBoth noises, seed 1:\n\n");
  refine("noisy", true, summary, &noisy);
  demo::Panel panel{"RMS distance of x̂ (-, 1/s)", {quiet, noisy}};
  panel.options =
      "set logscale xy; set xrange [5e-5:5e-3]; set yrange [5e-5:2e-2]; set format '10^{%T}'; set key top "
      "left vertical inside";
  demo::write_figure(
      directory, 13, "Discrete JML and continuous RNLS, as the step shrinks", {panel},
      "Of no source. RNLS in continuous time against JML, one pass of (14), with R = R_c/h and Q = Q_c/h.",
      "step h (s)");
  std::printf("%s", notes);
  summary.write(directory / "summary.csv");
}
