// SPDX-License-Identifier: BSD-3-Clause
// Real data: a car finds its way by an inertial unit at 100 Hz and a satellite fix a second, for eight
// minutes (support/car_log.hpp: the log that the Python package gtsam installs; without it this demo is
// skipped).
//
// The state is in a space: attitude as a quaternion, position, velocity and the biases of gyros and
// accelerometers, 16 numbers of 15 degrees of freedom; the unit's noise is an argument of the dynamics
// (examples/navigation/strapdown.hpp). Every fifth fix is held out, and each estimator is judged there by its
// state at that time: causally, from the fixes before; some fixes later; or from all the flight. The numbers
// of gtsam's own estimators on the same problem: car_log_gtsam.py.
#include <cstdio>
#include <jml/jml.hpp>
#include <memory>
#include <string>

#include "support/car_run.hpp"
#include "support/figure.hpp"
#include "support/output.hpp"

namespace {

using namespace demo;
using navigation::GnssPosition;

constexpr int skipped = 77;

constexpr const char* notes = R"(
Fixes later: the state at the fix held out, once so many more fixes were there; all: the whole flight. A second: median
time from a fix to the next, of which there are 100 samples; in that of "integrated once" the integration is not counted.
Times: one run on a shared machine, noisy.

- Once under way, the estimate is the same to a few millimetres whatever the method: 100 Hz leave nothing nonlinear in a
  step. What counts is the noise that is believed, and whether later fixes may speak: two of them leave a third of the error.
- With the noise of the metadata the filter believes the unit more than its receiver, whose fixes wander by metres for tens
  of seconds: the NIS is far above its 3, and the whole flight is farther off than a lag of two fixes. The likelihood of the
  fixes that are used asks for more noise of the unit and less of the fixes; the error at those held out falls to a seventh.
- Heading off by 150°: an iterated step finds its way where it is the whole second between two fixes, and so do a lag and a
  batch. One of a hundredth of a second does as badly as the EKF's: P was led along the wrong heading by the 99 before it.
- Steps from fix to fix lose nothing, and a lag costs a third or less of one with a node a sample. With the samples
  integrated once, by two filters of 100 samples, a sweep is next to free: that is for an iterated step, a lag or a batch.
)";

/// Runs along one set of noises, and their rows.
class Study {
 public:
  Study(const CarLog& log, CarNoise noise, std::string key, bool coarse, std::vector<CarRun>& runs)
      : log_(log), noise_(noise), key_(std::move(key)), start_(start_of(log, coarse)), runs_(runs) {
    Stopwatch watch;
    increments_ = increments_of(log, noise, watch);
    integration = watch.median();
  }

  double integration;  // ns a second, of the samples integrated once

  template <typename D, typename M>
  void filter(const std::string& name, const std::string& key, const M& method) {
    auto& run = begin(name, key);
    jml::Filter filter{method, model<D>(), start_};
    fly<D>(log_, noise_.sensor(), filter, run);
  }
  /// `length` nodes, of which the state `fixes` back is judged.
  template <typename D, int length>
  void lag(const std::string& name, const std::string& key, int fixes) {
    auto& run = begin(name, key);
    run.lag = fixes;
    using Lag =
        decltype(jml::Filter{jml::FixedLag<length>{}, model<D>(), jml::sensors<GnssPosition>, start_});
    const auto filter = std::make_unique<Lag>(jml::FixedLag<length>{jml::LagOptions{.newton = false}},
                                              model<D>(), jml::sensors<GnssPosition>, start_);
    fly<D>(log_, noise_.sensor(), *filter, run);
  }
  template <typename D>
  void batch(const std::string& name, const std::string& key) {
    auto& run = begin(name, key);
    jml::Batch batch{model<D>(),
                     jml::sensors<GnssPosition>,
                     start_,
                     {.steps = static_cast<int>(log_.samples.size()),
                      .measurements = static_cast<int>(log_.fixes.size())}};
    batch.options.tolerance = 0.01;  // of a posterior standard deviation
    batch.options.newton = false;
    solve<D>(log_, noise_.sensor(), batch, run);
  }

 private:
  CarRun& begin(const std::string& name, const std::string& key) {
    auto& run = runs_.emplace_back();
    run.name = name;
    run.key = key_ + "_" + key;
    return run;
  }
  template <typename D>
  D model() const {
    if constexpr (std::is_same_v<D, Preintegrated>)
      return D(increments_);
    else
      return D(log_, noise_);
  }

  const CarLog& log_;
  CarNoise noise_;
  std::string key_;
  CarEstimate start_;
  std::vector<CarRun>& runs_;
  std::vector<Increment> increments_;
};

/// Log-likelihood of the fixes that are used, by the EKF, and its mean NIS.
struct Likelihood {
  double value = 0;
  Mean nis;
};
Likelihood likelihood_of(const CarLog& log, const CarNoise& noise) {
  Likelihood out;
  jml::Filter filter{jml::Ekf{}, EveryFix{log, noise}, start_of(log, false)};
  for_each_step<EveryFix>(log, [&](double dt, const auto& control, const Fix* fix) {
    if (fix->held_out) {
      static_cast<void>(filter.predict(dt, control));
      return;
    }
    const auto report = filter.step(noise.sensor(), fix->position, dt, control);
    out.value += report.log_likelihood();
    out.nis.add(report.nis());
  });
  return out;
}
/// One noise after the other by factors of 4, then of 2, as long as the likelihood rises.
CarNoise most_likely(const CarLog& log, CarNoise noise) {
  double most = likelihood_of(log, noise).value;
  const auto try_factor = [&](double& number, double factor) {
    const double before = number;
    number *= factor;
    const double value = likelihood_of(log, noise).value;
    if (value > most) return most = value, true;
    number = before;
    return false;
  };
  for (double factor : {4.0, 2.0}) {
    bool better = true;
    while (better) {
      better = false;
      for (double* number : {&noise.gyro, &noise.force, &noise.horizontal, &noise.vertical}) {
        while (try_factor(*number, factor)) better = true;
        while (try_factor(*number, 1 / factor)) better = true;
      }
    }
  }
  return noise;
}

void print_noise(const CarLog& log, const CarNoise& noise, const char* what) {
  const auto likelihood = likelihood_of(log, noise);
  std::printf(
      "\n%s: gyros %.3g rad/s/√Hz, accelerometers %.3g m/s²/√Hz, fixes %.4f and %.4f m; log-likelihood %.0f, "
      "NIS %.2f\n(%g,%g,%.6g,%.6g for car_log_gtsam.py)\n\n",
      what, noise.gyro, noise.force, noise.horizontal, noise.vertical, likelihood.value,
      likelihood.nis.value(), noise.gyro / log.gyro_noise, noise.force / log.force_noise, noise.horizontal,
      noise.vertical);
}

/// Rows for the reader, and numbers for summary.csv.
void report(std::vector<CarRun>& runs, Summary& summary, Summary& timing) {
  Table table({"errors at the fixes held out, m", "horizontal RMSE", "median", "3D RMSE", "median", "refused",
               "a second, ms", "whole, s"});
  for (auto& run : runs) {
    const double second = run.second.median() * 1e-6;
    const auto row = [&](const std::string& name, const std::string& key, const CarErrors& errors,
                         bool timed) {
      const double numbers[] = {CarErrors::rmse(errors.horizontal), median(errors.horizontal),
                                CarErrors::rmse(errors.all), median(errors.all)};
      table.add({name, text("%.3f", numbers[0]), text("%.3f", numbers[1]), text("%.3f", numbers[2]),
                 text("%.3f", numbers[3]), timed ? std::to_string(run.refused) : "",
                 timed ? text("%.3f", second) : "", timed ? text("%.2f", run.whole) : ""});
      const char* names[] = {"_horizontal_rmse", "_horizontal_median", "_rmse", "_median"};
      for (std::size_t i = 0; i < 4; ++i) summary.add(key + names[i], numbers[i], "m");
    };
    if (!run.causal.all.empty()) row(run.name + ", causal", run.key + "_causal", run.causal, true);
    if (!run.later.all.empty())
      row(run.name + (run.lag > 0 ? ", " + std::to_string(run.lag) + " fixes later" : ", all"),
          run.key + "_later", run.later, run.causal.all.empty());
    summary.add(run.key + "_refused", run.refused, "-");
    if (run.iterations > 0) {
      summary.add(run.key + "_cost", run.cost, "-");
      summary.add(run.key + "_iterations", run.iterations, "-");
    }
    timing.add(run.key + "_ms", run.lag >= 0 && run.iterations == 0 ? second : run.whole * 1e3, "ms");
  }
  table.print();
  for (const auto& run : runs) {
    if (run.iterations > 0)
      std::printf("%s: J = %.2f after %d iterations, %s\n", run.name.c_str(), run.cost, run.iterations,
                  jml::describe(run.status));
  }
}

void draw(const std::filesystem::path& directory, const CarLog& log, const std::vector<CarRun>& runs) {
  std::vector<double> time, x, y;
  for (const auto& fix : log.fixes) {
    x.push_back(fix.position(0));
    y.push_back(fix.position(1));
    if (fix.held_out) time.push_back(fix.time - log.fixes.front().time);
  }
  Figure{"The way of the car: satellite fixes",
         "east (m)",
         {{"north (m)", {{"fixes", colour::black, x, y, "lines lw 1.4"}}, "set size ratio -1\nunset key"}},
         800,
         860}
      .write(directory / "map.svg", "Of no source; log of the package gtsam.");
  std::vector<Series> series;
  const auto add = [&](const char* key, bool later, const char* label, const char* ink) {
    for (const auto& run : runs) {
      if (run.key == key)
        series.push_back({label, ink, time, later ? run.later.horizontal : run.causal.horizontal});
    }
  };
  add("metadata_ekf", false, "EKF, noise of the metadata", colour::orange);
  add("likely_ekf", false, "EKF, likely noise", colour::blue);
  add("likely_batch", true, "whole flight, likely noise", colour::black);
  Figure{"Horizontal error at the fixes held out",
         "time (s)",
         {{"error (m)", series, "set logscale y\nset key below"}},
         900,
         520}
      .write(directory / "error.svg", "Of no source; log of the package gtsam. EKF and batch JML.");
}

}  // namespace

int main(int argc, char** argv) {
  const auto directory = output_directory(argc, argv, "<output directory> [<directory of the log>]");
  const auto data = CarLog::find(argc > 2 ? argv[2] : nullptr);
  if (!CarLog::is_in(data)) {
    std::printf("skipped: the package gtsam is not installed, which the log of the car comes with\n");
    return skipped;
  }
  const CarLog log(data);
  Summary summary, timing;
  std::printf("%zu inertial samples, %zu fixes, %.0f s; every fifth fix is held out.\n", log.samples.size(),
              log.fixes.size(), log.duration());

  std::vector<CarRun> all;
  const auto flights = [&](const CarNoise& noise, const std::string& key, bool coarse, const char* what) {
    print_noise(log, noise, what);
    std::vector<CarRun> runs;
    Study study(log, noise, key, coarse, runs);
    study.filter<EverySample>("EKF", "ekf", jml::Ekf{});
    study.filter<EverySample>("EKF in factors U D Uᵀ", "factored", jml::Factored{jml::Ekf{}});
    study.filter<EverySample>("iterated EKF", "iterated", jml::Iterated<jml::Ekf<>>{});
    if (!coarse) {
      study.lag<EverySample, 220>("fixed lag of 220 samples", "lag220", 2);
      study.filter<EveryFix>("EKF, steps from fix to fix", "ekf_fix", jml::Ekf{});
      study.lag<EveryFix, 2>("fixed lag, steps from fix to fix", "lag2_fix", 2);
    }
    study.filter<Preintegrated>("EKF, samples integrated once", "ekf_once", jml::Ekf{});
    study.filter<Preintegrated>("iterated EKF, samples integrated once", "iterated_once",
                                jml::Iterated<jml::Ekf<>>{});
    study.lag<Preintegrated, 2>("fixed lag, samples integrated once", "lag2", 2);
    study.lag<Preintegrated, 5>("fixed lag, samples integrated once", "lag5", 5);
    study.lag<Preintegrated, 10>("fixed lag, samples integrated once", "lag10", 10);
    study.batch<Preintegrated>("whole flight, samples integrated once", "batch");
    if (key == "likely") study.batch<EverySample>("whole flight, a node a sample", "batch_samples");
    report(runs, summary, timing);
    std::printf("Integrating the samples once: %.2f ms a second.\n", study.integration * 1e-6);
    timing.add(key + "_integration_ms", study.integration * 1e-6, "ms");
    for (auto& run : runs) all.push_back(std::move(run));
  };
  const auto metadata = CarNoise::of_metadata(log);
  flights(metadata, "metadata", false, "Noise as the metadata say");
  const auto likely = most_likely(log, metadata);
  flights(likely, "likely", false, "Noise of the highest likelihood");
  flights(likely, "coarse", true,
          "The same from a coarse start: heading off by 150° of a deviation of 100°, no velocity");
  std::printf("%s", notes);
  summary.write(directory / "summary.csv");
  timing.write(directory / "timing.csv");
  draw(directory, log, all);
}
