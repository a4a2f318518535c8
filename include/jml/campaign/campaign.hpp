// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Monte Carlo campaigns (component jml::campaign): a scenario flown many times, every estimator on the same
/// flights.
///
/// A run's random numbers depend on the seed and its own number alone, so results are the same to the bit for
/// any number of threads, after any interruption, and for a single run replayed.
#pragma once

#include <jml/campaign/campaign_engine.hpp>
#include <jml/campaign/worker.hpp>
#include <stdexcept>
#include <tuple>

namespace jml {

/// One run again: the flight, and of every estimator what the campaign saw.
template <typename Scenario>
struct CampaignReplay {
  struct Track {
    std::string name;
    std::vector<CampaignRow<Scenario::states>> rows;  ///< 0 … steps, or to the step at which the run failed
    std::optional<RunFault> fault;                    ///< why the run does not count
  };
  std::string error;  ///< not empty: why there is no replay
  detail::FlightOf<Scenario> flight;
  std::vector<Track> tracks;
  [[nodiscard]] bool ok() const { return error.empty(); }
};

/// A scenario and the estimators that fly it.
///
///     jml::Campaign campaign{VanDerPolFlights{}, jml::Estimator{"EKF", make_ekf}, …};
///     campaign.options = {.runs = 10000, .seed = 1, .threads = 2, .journal = "vdp.journal"};
///     const auto result = campaign.run();
///     if (!result.ok()) puts(result.message());
///
/// The scenario: `states`, `measurements` (static), `name`, `steps`, `dt` (s), `sensor`, and
/// `fly(CounterNoise&, Flight&) const`, which fills truth, y and, with a static `controls`, control (see
/// simulate()); it is called from several threads at once. Optional: `measured_at_start` (then y[0] is used
/// by update(), where the estimator has it, before the first step); `double error(x̂, truth) const`, a scalar
/// in the user's units, default the 2-norm of x̂ - truth; `lost`: a run whose scalar error is above it at any
/// sample is lost.
///
/// Samples 1 … steps count, and 0 where measured at the start. A refused step is followed by predict(); a
/// refused prediction (or none to call), and an estimate or error that is not finite, fail the run for this
/// estimator. Failed and lost runs are listed and left out of the averages.
template <typename Scenario, typename... E>
class Campaign {
  static_assert(sizeof...(E) > 0, "jml: a campaign needs at least one jml::Estimator");
  static_assert(detail::require_scenario<Scenario>());
  static_assert((detail::require_estimator<Scenario, E>() && ...));

 public:
  explicit Campaign(Scenario scenario, E... estimators)
      : scenario_(std::move(scenario)), estimators_(std::move(estimators)...) {}

  CampaignOptions options;

  /// Never throws: what goes wrong is the result's message().
  [[nodiscard]] CampaignResult run() const {
    try {
      return detail::run_plan(plan());
    } catch (const std::exception& e) {
      return CampaignResult(std::string("the campaign stopped: ") + e.what());
    }
  }

  /// Run 0 … options.runs - 1 alone.
  [[nodiscard]] CampaignReplay<Scenario> replay(std::int64_t run) const {
    CampaignReplay<Scenario> out;
    try {
      const detail::CampaignPlan plan = this->plan();
      out.error = plan.refusal;
      if (out.ok() && (run < 0 || run >= options.runs))
        out.error =
            "there is no run " + std::to_string(run) + ": the campaign has " + std::to_string(options.runs);
      if (!out.ok()) return out;
      FlightWorker worker(*this);
      FlightWorker::named(run, [&] {
        worker.launch(run);
        each([&](auto index) {
          auto& flown = std::get<index>(worker.workers);
          const detail::RunOutcome outcome = flown.fly(worker.flight);
          typename CampaignReplay<Scenario>::Track track{std::get<index>(estimators_).name, flown.rows,
                                                         outcome.fault};
          track.rows.resize(static_cast<std::size_t>(outcome.last) + 1);
          if (track.fault) detail::sign(*track.fault, run, index);
          out.tracks.push_back(std::move(track));
        });
      });
      out.flight = std::move(worker.flight);
    } catch (const std::exception& e) {
      out.error = e.what();
    }
    return out;
  }

  /// The campaign without its types, for the engines. Refers to this object.
  [[nodiscard]] detail::CampaignPlan plan() const {
    detail::CampaignPlan out;
    detail::CampaignData& d = out.data;
    d.options = options;
    d.scenario = scenario_.name;
    each([&](auto index) { d.estimators.push_back(std::get<index>(estimators_).name); });
    d.layout = {static_cast<int>(sizeof...(E)), Scenario::states, scenario_.steps};
    d.dt = scenario_.dt;
    d.measured_at_start = detail::measured_at_start(scenario_);
    out.refusal = detail::check(d);
    const double lost = detail::lost_bound(scenario_);
    if (out.refusal.empty() && !(lost > 0)) out.refusal = "the scenario's bound `lost` is not positive";
    out.identity = {{"format", 1},
                    {"scenario", d.scenario},
                    {"version", d.options.version},
                    {"estimators", d.estimators},
                    {"seed", d.options.seed},
                    {"runs", d.options.runs},
                    {"blocks", d.options.blocks},
                    {"states", Scenario::states},
                    {"measurements", Scenario::measurements},
                    {"steps", d.layout.steps},
                    {"dt", d.dt},
                    {"measured_at_start", d.measured_at_start},
                    {"lost", lost},
                    {"numbers", d.layout.size() + d.layout.time_size()}};
    detail::Json& costs = out.identity["costs"] = detail::Json::array();
    (costs.push_back(!std::is_same_v<decltype(E::cost), NoCost>), ...);
    out.make_worker = [this, layout = d.layout, blocks = d.options.blocks]() -> detail::BlockWorker {
      const auto worker = std::make_shared<FlightWorker>(*this);
      return [worker, layout, blocks](int block, detail::BlockRecord& record, const std::atomic<bool>& stop) {
        worker->fly(layout, blocks, block, record, stop);
      };
    };
    return out;
  }

 private:
  template <typename Function>
  static void each(const Function& function) {
    [&]<std::size_t... i>(std::index_sequence<i...>) {
      (function(std::integral_constant<std::size_t, i>{}), ...);
    }(std::index_sequence_for<E...>{});
  }

  /// What one thread needs; all memory of its runs.
  struct FlightWorker {
    explicit FlightWorker(const Campaign& c)
        : campaign(c),
          workers(std::apply(
              [&c](const auto&... estimator) {
                return std::tuple<detail::Worker<Scenario, E>...>(
                    detail::Worker<Scenario, E>(c.scenario_, estimator)...);
              },
              c.estimators_)) {}

    /// What the user's code throws is given the number of the run.
    template <typename Function>
    static void named(std::int64_t run, const Function& function) {
      std::string what;
      try {
        return function();
      } catch (const std::exception& e) {
        what = e.what();
      } catch (...) {
        what = "an exception that is no std::exception";
      }
      throw std::runtime_error("run " + std::to_string(run) + ": " + what);
    }

    void launch(std::int64_t run) {
      const Scenario& scenario = campaign.scenario_;
      flight.resize(scenario.steps);
      flight.dt = scenario.dt;
      flight.measured_at_start = detail::measured_at_start(scenario);
      kernel::set_zero(flight.guess);
      CounterNoise noise(campaign.options.seed, static_cast<std::uint64_t>(run));
      scenario.fly(noise, flight);
      const auto steps = static_cast<std::size_t>(scenario.steps);
      if (flight.truth.size() != steps + 1 || flight.y.size() != steps + 1 ||
          flight.control.size() != steps || flight.steps != scenario.steps)
        throw std::runtime_error("fly() changed the size of the flight");
    }

    void fly(const detail::TallyLayout& layout, int blocks, int block, detail::BlockRecord& record,
             const std::atomic<bool>& stop) {
      using L = detail::TallyLayout;
      const auto start = std::chrono::steady_clock::now();
      record.start(layout, block);
      each([&](auto index) {
        auto& flown = std::get<index>(workers);
        flown.inside_ns = flown.covariance_ns = flown.flown_steps = 0;
      });
      const std::int64_t share = campaign.options.runs / blocks, rest = campaign.options.runs % blocks;
      const std::int64_t first = block * share + std::min<std::int64_t>(block, rest);
      const std::int64_t end = first + share + (block < rest ? 1 : 0);
      for (std::int64_t run = first; run < end && !stop; ++run) {
        named(run, [&] {
          launch(run);
          each([&](auto index) { add(layout, run, index, record); });
        });
      }
      each([&](auto index) {
        const auto& flown = std::get<index>(workers);
        double* times = record.times.data() + L::times * index;
        times[L::inside_ns] = flown.inside_ns;
        times[L::covariance_ns] = flown.covariance_ns;
        times[L::flown_steps] = flown.flown_steps;
      });
      record.times.back() =
          std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
    }

    template <typename Index>
    void add(const detail::TallyLayout& layout, std::int64_t run, Index index, detail::BlockRecord& record) {
      using L = detail::TallyLayout;
      auto& flown = std::get<index>(workers);
      using Worker = std::decay_t<decltype(flown)>;
      const detail::RunOutcome outcome = flown.fly(flight);
      const int first = flight.measured_at_start ? 0 : 1, number = static_cast<int>(index());
      if (!outcome.fault) {
        detail::add_run<Worker::n, Worker::boxed>(layout, number, first, flown.rows, record.sums.data());
        return;
      }
      detail::add_refusals(layout, number, first, outcome.last, flown.rows, record.sums.data());
      const bool lost = outcome.fault->kind == RunFault::Kind::lost;
      record.sums[layout.head_of(number) + static_cast<std::size_t>(lost ? L::lost : L::failed)] += 1;
      record.faults.push_back(*outcome.fault);
      detail::sign(record.faults.back(), run, index);
    }

    const Campaign& campaign;
    detail::FlightOf<Scenario> flight;
    std::tuple<detail::Worker<Scenario, E>...> workers;
  };

  Scenario scenario_;
  std::tuple<E...> estimators_;
};

}  // namespace jml
