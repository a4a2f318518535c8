// SPDX-License-Identifier: BSD-3-Clause
// Estimators along the log of a car (car_log.hpp), and their errors at the fixes that were held out.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "car_models.hpp"
#include "statistics.hpp"

namespace demo {

/// The start: the position of a fix, the velocity from the one before to it and the heading of that velocity,
/// the car level; or, coarse, no velocity and a heading that is 150° off.
inline CarEstimate start_of(const CarLog& log, bool coarse) {
  const Vector3 v = log.first_velocity();
  const double degree = 3.14159265358979 / 180;
  CarState x = CarState::Zero();
  x.head<4>() = jml::exp_quaternion(Vector3(0, 0, std::atan2(v(1), v(0)) + (coarse ? 150 : 0) * degree));
  x.segment<3>(navigation::position) = log.fixes[CarLog::first].position;
  if (!coarse) x.segment<3>(navigation::velocity) = v;
  jml::Vector<double, navigation::degrees> deviation;
  deviation << 5 * degree, 5 * degree, (coarse ? 100 : 5) * degree, Vector3::Constant(1),
      Vector3::Constant(coarse ? 10 : 1), Vector3::Constant(5e-5), Vector3::Constant(0.1);
  return {x, deviation.cwiseAbs2().asDiagonal()};
}

/// Distances from the fixes that were held out, m.
struct CarErrors {
  std::vector<double> horizontal, all;
  void add(const Fix& fix, const CarState& x) {
    const Vector3 error = x.segment<3>(navigation::position) - fix.position;
    horizontal.push_back(error.head<2>().norm());
    all.push_back(error.norm());
  }
  static double rmse(const std::vector<double>& errors) {
    Mean squares;
    for (double e : errors) squares.add(e * e);
    return squares.root();
  }
};

struct CarRun {
  std::string name, key;
  CarErrors causal, later;  // later: of a state when `lag` more fixes were there, or the whole flight
  int lag = 0, refused = 0, iterations = 0;
  double cost = NAN;
  jml::Status status = jml::Status::ok;
  Stopwatch second;    // from a fix to the next
  double whole = NAN;  // s, of a solve of the whole flight
};

/// use(dt, control, fix or null) for each step of a model.
template <typename D, typename Use>
void for_each_step(const CarLog& log, const Use& use) {
  for (std::size_t i = CarLog::first + 1; i < log.fixes.size(); ++i) {
    const Fix &before = log.fixes[i - 1], &fix = log.fixes[i];
    if constexpr (D::controls == 6) {
      for (std::size_t k = before.sample + 1; k <= fix.sample; ++k)
        use(log.samples[k].dt, D::control_of(log, k, 1), k == fix.sample ? &fix : nullptr);
    } else {
      use(fix.time - before.time, D::control_of(log, before.sample + 1, fix.sample - before.sample), &fix);
    }
  }
}

/// A filter, or a fixed lag of so many fixes.
template <typename D, typename F>
void fly(const CarLog& log, const navigation::GnssPosition& sensor, F& filter, CarRun& out) {
  std::vector<int> nodes;  // at each fix
  int node = 0;
  out.second.start();
  for_each_step<D>(log, [&](double dt, const auto& control, const Fix* fix) {
    ++node;
    const auto status = fix == nullptr || fix->held_out
                            ? filter.predict(dt, control)
                            : filter.step(sensor, fix->position, dt, control).status;
    out.refused += !jml::usable(status);
    if (fix == nullptr) return;
    out.second.stop();
    if (fix->held_out) out.causal.add(*fix, filter.x());
    nodes.push_back(node);
    if constexpr (requires { filter.x(1); }) {
      const auto lag = static_cast<std::size_t>(out.lag);
      if (nodes.size() > lag && (fix - lag)->held_out)
        out.later.add(*(fix - lag), filter.x(node - nodes[nodes.size() - 1 - lag]));
    }
    out.second.start();
  });
}

/// The whole flight at once.
template <typename D, typename B>
void solve(const CarLog& log, const navigation::GnssPosition& sensor, B& batch, CarRun& out) {
  std::vector<std::pair<const Fix*, int>> held;
  int node = 0;
  Stopwatch watch;
  watch.start();
  for_each_step<D>(log, [&](double dt, const auto& control, const Fix* fix) {
    ++node;
    const bool used = fix != nullptr && !fix->held_out;
    if (fix != nullptr && fix->held_out) held.emplace_back(fix, node);
    out.refused += !jml::usable(used ? batch.step(sensor, fix->position, dt, control).status
                                     : batch.predict(dt, control));
  });
  const auto report = batch.solve();
  watch.stop();
  out.whole = watch.median() * 1e-9;
  out.status = report.status;
  out.refused += !jml::usable(report.status);
  out.cost = report.cost;
  out.iterations = report.iterations;
  for (const auto& [fix, at] : held) out.later.add(*fix, batch.x(at));
}

}  // namespace demo
