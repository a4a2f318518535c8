// SPDX-License-Identifier: BSD-3-Clause
// A jml::Campaign as a study: for the files of scenarios alone, which know its types.
#pragma once

#include <atomic>
#include <jml/jml.hpp>
#include <jml/campaign/campaign.hpp>
#ifdef JML_CAMPAIGN_MPI
#include <jml/campaign/campaign_mpi.hpp>
#endif
#include <mutex>
#include <thread>

#include "study.hpp"

namespace study {

template <typename Scenario>
void write_samples(const jml::CampaignReplay<Scenario>& flown, std::FILE* out) {
  constexpr int n = Scenario::states, p = Scenario::measurements;
  std::fputs("estimator,step,time", out);
  for (const char* name : {"truth", "x"}) {
    for (int i = 1; i <= n; ++i) std::fprintf(out, ",%s_%d", name, i);
  }
  for (int i = 1; i <= p; ++i) std::fprintf(out, ",y_%d", i);
  std::fputs(",error,nees,nis,cost,rejected,status\n", out);
  const auto number = [out](double value) {
    if (value == value)
      std::fprintf(out, ",%.9g", value);
    else
      std::fputc(',', out);
  };
  for (const auto& track : flown.tracks) {
    for (std::size_t k = 0; k < track.rows.size(); ++k) {
      const auto& row = track.rows[k];
      std::fprintf(out, "\"%s\",%zu,%.9g", track.name.c_str(), k, flown.flight.time(static_cast<int>(k)));
      for (int i = 0; i < n; ++i) number(row.truth(i));
      for (int i = 0; i < n; ++i) number(row.x(i));
      const bool measured = k > 0 || flown.flight.measured_at_start;
      for (int i = 0; i < p; ++i) number(measured ? flown.flight.y[k](i) : std::nan(""));
      for (const double value : {row.scalar_error, row.nees, row.nis, row.cost}) number(value);
      std::fprintf(out, ",%d,%s\n", row.rejected, jml::describe(row.status));
    }
  }
}

/// One run's share of RunErrors.
template <typename Scenario>
void score(const jml::CampaignReplay<Scenario>& flown, std::size_t run, RunErrors& out) {
  const std::size_t first = flown.flight.measured_at_start ? 0 : 1;
  for (std::size_t j = 0; j < flown.tracks.size(); ++j) {
    const auto& track = flown.tracks[j];
    double squares = 0;
    std::int64_t no_nees = 0;
    for (std::size_t k = first; k < track.rows.size(); ++k) {
      squares += track.rows[k].scalar_error * track.rows[k].scalar_error;
      no_nees += std::isnan(track.rows[k].nees);
    }
    out.rmse[j][run] =
        track.fault ? std::nan("") : std::sqrt(squares / static_cast<double>(track.rows.size() - first));
    if (!track.fault) out.no_nees[j] += no_nees;
  }
}

/// Threads take runs as they come; each run has its own place, so the answer does not depend on them.
template <typename Campaign>
RunErrors score_each_run(const Campaign& campaign, std::size_t estimators, int samples) {
  const auto runs = static_cast<std::size_t>(campaign.options.runs);
  RunErrors out{
      {}, std::vector(estimators, std::vector<double>(runs)), std::vector<std::int64_t>(estimators)};
  out.samples = campaign.options.runs * samples;
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  const auto work = [&] {
    for (std::size_t run; (run = next++) < runs;) {
      const auto flown = campaign.replay(static_cast<std::int64_t>(run));
      const std::lock_guard lock(mutex);
      if (flown.ok())
        score(flown, run, out);
      else
        out.error = flown.error;
    }
  };
  std::vector<std::thread> threads;
  const int wanted =
      campaign.options.threads > 0 ? campaign.options.threads : int(std::thread::hardware_concurrency());
  for (int i = 1; i < wanted; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  return out;
}

/// The study of `about` (its words) with this scenario and these estimators.
template <typename Scenario, typename... E>
Study make(Study about, Scenario scenario, E... estimators) {
  scenario.name = about.key;
  about.states = Scenario::states;
  about.steps = scenario.steps;
  about.dt = scenario.dt;
  (about.estimators.push_back(estimators.name), ...);
  const jml::Campaign campaign{scenario, estimators...};
  const auto with = [campaign](const jml::CampaignOptions& options) {
    auto copy = campaign;
    copy.options = options;
    return copy;
  };
  about.run = [with](const jml::CampaignOptions& options) { return with(options).run(); };
#ifdef JML_CAMPAIGN_MPI
  about.run_on_ranks = [with](const jml::CampaignOptions& options) {
    return jml::run_on_ranks(with(options));
  };
#endif
  about.replay = [with](const jml::CampaignOptions& options, std::int64_t run, std::FILE* out) {
    const auto flown = with(options).replay(run);
    if (flown.ok()) write_samples(flown, out);
    return flown.error;
  };
  about.each_run = [with, count = sizeof...(E),
                    samples = scenario.steps](const jml::CampaignOptions& options) {
    return score_each_run(with(options), count, samples);
  };
  return about;
}

/// A filter of one of the rules, made anew for each flight. With jml::OneStep{} its one-step cost (11).
template <typename Rule, typename D, int n, typename Cost = jml::NoCost>
auto filter(std::string name, const Rule& rule, const D& dynamics, const jml::Estimate<double, n>& start,
            Cost cost = {}) {
  return jml::Estimator{std::move(name),
                        [rule, dynamics, start](const auto&) { return jml::Filter{rule, dynamics, start}; },
                        cost};
}

/// The fixed lag of twenty steps, two sweeps a step; `newton` false: without second derivatives, at half the
/// time.
template <typename S, typename D, int n>
auto lag_20(const D& dynamics, const jml::Estimate<double, n>& start, bool newton = true) {
  return jml::Estimator{newton ? "fixed lag 20" : "fixed lag 20, Gauss-Newton",
                        [dynamics, start, newton](const auto&) {
                          jml::Filter lag{jml::FixedLag<20>{}, dynamics, jml::sensors<S>, start};
                          lag.method().options.newton = newton;
                          return lag;
                        }};
}

/// A start within the filter's own belief.
template <int n>
jml::Vector<double, n> draw(const jml::Estimate<double, n>& start, jml::CounterNoise& noise) {
  return start.x + noise.normal_vector<n>(start.P);
}

}  // namespace study
