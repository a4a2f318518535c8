// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Scripted faults: what a sensor does on its bad days, flown by an estimator behind a channel, and what came
/// of it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <jml/operations/health.hpp>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace faults {

enum class Kind : std::uint8_t {
  none,
  step_10,
  step_100,
  step_1000,
  ramp,
  stuck,
  dropout,
  spikes,
  wrong_sign,
  wrong_time,
  duplicates,
  swapped,
  saturation,
  bias,
  jump,
  nan,
  infinite,
};
constexpr std::array<const char*, 17> names{
    "none",       "step of 10",   "step of 100", "step of 1000", "ramp",       "stuck",
    "dropout",    "spikes of 50", "wrong sign",  "wrong time",   "duplicates", "swapped",
    "saturation", "bias of 3",    "jump of 100", "NaN",          "infinite"};
constexpr const char* name(Kind kind) { return names[static_cast<std::size_t>(kind)]; }

/// A fault acts on the samples begin … end - 1; a bias and a jump stay. Steps, ramps and spikes are in
/// standard deviations of the noise, of all rows.
struct Script {
  int begin = 250, end = 290, samples = 450;
  int delay = 10;    // samples, of a wrong time
  int settled = 20;  // the last samples: an estimator that is not back before them is lost
};

/// A flight: the truth and the measurements at each sample.
template <int n, int p>
struct Tape {
  std::vector<jml::Vector<double, n>> truth;
  std::vector<jml::Vector<double, p>> y;
  jml::Vector<double, p> sd;  // of the noise
};

/// What a sensor says at sample k, and how often (0: it is silent).
template <int n, int p>
int disturbed(const Script& script, Kind kind, const Tape<n, p>& tape, int k, jml::Vector<double, p>& y) {
  const auto [begin, end, samples, delay, settled] = script;
  const auto at = [&tape](int i) { return tape.y[static_cast<std::size_t>(i)]; };
  y = at(k);
  const bool now = k >= begin && k < end;
  if (kind == Kind::bias && k >= begin) y += 3 * tape.sd;
  if (!now) return 1;
  switch (kind) {
    case Kind::step_10:
      y += 10 * tape.sd;
      break;
    case Kind::step_100:
      y += 100 * tape.sd;
      break;
    case Kind::step_1000:
      y += 1000 * tape.sd;
      break;
    case Kind::ramp:
      y += 0.5 * (k - begin) * tape.sd;
      break;
    case Kind::stuck:
      y = at(begin);
      break;
    case Kind::dropout:
      return 0;
    case Kind::spikes:
      if (k % 4 == 0) y += 50 * tape.sd;
      break;
    case Kind::wrong_sign:
      y = -y;
      break;
    case Kind::wrong_time:
      y = at(k - delay);
      break;
    case Kind::duplicates:
      return 2;
    case Kind::swapped:
      y = y.reverse().eval();
      break;
    case Kind::saturation:
      y = y.cwiseMin(0.9 * at(begin).cwiseAbs()).cwiseMax(-0.9 * at(begin).cwiseAbs());
      break;
    case Kind::nan:
      y(k % p) = std::nan("");
      break;
    case Kind::infinite:
      y(k % p) = (k % 2 == 0 ? 1 : -1) * std::numeric_limits<double>::infinity();
      break;
    default:
      break;
  }
  return 1;
}

/// Of several flights: the peak error over the unfaulted RMS (median), samples from the end of the fault
/// until the error is below 3.5 RMS for good (the most), how many never came back, and what was answered.
struct Outcome {
  double peak = 0;
  int back = 0, lost = 0, refused = 0, rejected = 0;
  jml::Status worst = jml::Status::ok;
};

template <typename World, typename Make, typename Channel>
std::vector<double> errors(const World& world, const typename World::Flight& tape, Kind kind,
                           const Make& make, Channel channel, Outcome& outcome) {
  auto filter = make(tape);
  const auto [begin, end, samples, delay, settled] = world.script;
  std::vector<double> out;
  for (int k = 0; k < samples; ++k) {
    typename World::Y y;
    const int times = disturbed(world.script, kind, tape, k, y);
    if (times == 0) static_cast<void>(world.pass(filter, tape, k));
    for (int i = 0; i < times; ++i) {
      const jml::Status status =
          i == 0 ? world.sample(filter, channel, tape, k, y) : jml::Status(channel.update(filter, y).status);
      if (!jml::usable(status)) {
        if (k >= begin) outcome.worst = status;
        outcome.refused += k >= begin;
      }
    }
    out.push_back(world.error(filter.x(), tape.truth[static_cast<std::size_t>(k)]));
  }
  outcome.rejected += static_cast<int>(channel.tally().rejected);
  return out;
}

/// An estimator flown through every fault; make(tape) makes the filter, `channel` its sensor. From a flight
/// to the next one the same noise, with and without the fault.
template <typename World, typename Make, typename Channel>
std::vector<Outcome> fly(const World& world, const Make& make, const Channel& channel, int flights) {
  const auto [begin, end, samples, delay, settled] = world.script;
  std::vector<Outcome> outcomes(names.size());
  std::vector<std::vector<double>> peaks(names.size());
  for (int flight = 1; flight <= flights; ++flight) {
    const auto seed = static_cast<std::uint64_t>(flight);
    const typename World::Flight calm = world.fly(seed, false), jumping = world.fly(seed, true);
    Outcome ignored;
    const auto unfaulted = errors(world, calm, Kind::none, make, channel, ignored);
    double squares = 0;
    for (int k = begin; k < samples; ++k)
      squares += unfaulted[static_cast<std::size_t>(k)] * unfaulted[static_cast<std::size_t>(k)];
    const double rms = std::sqrt(squares / (samples - begin));
    for (std::size_t kind = 1; kind < names.size(); ++kind) {
      const auto fault = static_cast<Kind>(kind);
      Outcome& outcome = outcomes[kind];
      const auto found = errors(world, fault == Kind::jump ? jumping : calm, fault, make, channel, outcome);
      double peak = 0;
      int last = begin - 1;  // sample with an error above 3.5 RMS; a NaN is one
      const int over = fault == Kind::jump || fault == Kind::bias ? begin : end;
      for (int k = begin; k < samples; ++k) {
        const double error = found[static_cast<std::size_t>(k)] / rms;
        peak = std::isfinite(error) ? std::max(peak, error) : std::numeric_limits<double>::infinity();
        if (!(error < 3.5)) last = k;
      }
      peaks[kind].push_back(peak);
      if (last >= samples - settled)
        ++outcome.lost;
      else
        outcome.back = std::max(outcome.back, last + 1 - over);
    }
  }
  for (std::size_t kind = 1; kind < names.size(); ++kind) {
    std::sort(peaks[kind].begin(), peaks[kind].end());
    outcomes[kind].peak = peaks[kind][peaks[kind].size() / 2];
  }
  return outcomes;
}

/// Rows by their key "world,estimator,handling,fault".
using Table = std::map<std::string, Outcome>;

inline std::string last_refusal(const Outcome& o) {
  std::string out = o.refused == 0 ? "" : jml::describe(o.worst);
  std::replace(out.begin(), out.end(), ',', ';');
  return out;
}
inline std::string text(const std::string& key, const Outcome& o) {
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(), "%s,%.3g,%d,%d,%d,%s", key.c_str(), o.peak, o.back, o.lost,
                o.refused, last_refusal(o).c_str());
  return line.data();
}
/// The stored outcomes, as text: peak, back, lost, refused, last refusal.
inline std::map<std::string, std::vector<std::string>> stored(const char* path) {
  std::map<std::string, std::vector<std::string>> out;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::vector<std::string> parts;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) parts.push_back(cell);
    if (parts.size() < 8) continue;
    parts.resize(9);
    out[parts[0] + "," + parts[1] + "," + parts[2] + "," + parts[3]] = {parts.begin() + 4, parts.end()};
  }
  return out;
}
/// The stored row says the same: outcomes are chaotic, and so are told apart by classes of a factor of two.
inline bool agrees(const Outcome& o, const std::vector<std::string>& row) {
  const double peak = std::stod(row[0]);
  const auto near = [](int a, int b, int by) { return std::abs(a - b) <= by + std::max(a, b) / 5; };
  return o.peak <= 2 * peak + 0.5 && peak <= 2 * o.peak + 0.5 && near(o.back, std::stoi(row[1]), 15) &&
         near(o.lost, std::stoi(row[2]), 1) && near(o.refused, std::stoi(row[3]), 3) &&
         (o.refused == 0 || std::stoi(row[3]) == 0 || row[4] == last_refusal(o));
}

/// An estimator's rows: bare, behind a gate of 0.999, and behind it with a policy.
template <typename World, typename Make>
void add_rows(const World& world, const std::string& called, const Make& make, int flights, Table& table,
              int handlings = 3) {
  static constexpr std::array<const char*, 3> handled{"bare", "gate", "policy"};
  for (int handling = 0; handling < handlings; ++handling) {
    jml::Channel channel{world.sensor, handling == 2 ? World::policy() : decltype(World::policy()){}};
    if (handling > 0) channel.gate = {0.999};
    const auto outcomes = fly(world, make, channel, flights);
    for (std::size_t kind = 1; kind < names.size(); ++kind)
      table[called + "," + handled[static_cast<std::size_t>(handling)] + "," + names[kind]] = outcomes[kind];
  }
}

/// Prints the rows and compares them with the stored ones.
inline void expect_stored(const Table& table) {
  const auto rows = stored(FAULT_TABLE);
  for (const auto& [key, outcome] : table) {
    std::printf("%s\n", text(key, outcome).c_str());
    const auto row = rows.find(key);
    if (row == rows.end())
      ADD_FAILURE() << "not stored: " << key;
    else
      EXPECT_TRUE(agrees(outcome, row->second))
          << "stored: " << key << "," << row->second[0] << "," << row->second[1] << "," << row->second[2]
          << "," << row->second[3];
  }
}

}  // namespace faults
