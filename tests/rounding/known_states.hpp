// SPDX-License-Identifier: BSD-3-Clause
// Problems of states that are known exactly, or far better than a number of the scalar can say, and of dynamics
// that make more of what rounding left: x̂_0 lies where F contracts, an error of it grows by up to 3 a step.
#pragma once

#include "rounding/problems.hpp"

namespace rounding {

/// Problem `number` of n states and sensors of p rows.
inline Problem make_known_states(std::uint64_t number, int n, int p, bool single) {
  Random random(131, number);
  Problem out;
  out.n = n;
  out.p = p;
  out.single = single;
  out.number = number;
  out.family = "known states";
  const auto fit = [&](Quad v) { return single ? double(static_cast<float>(v)) : static_cast<double>(v); };
  // F = V diag(λ) Vᵀ of random reflections' V: the last λ are below one, and x̂_0 is of their directions.
  std::array<QuadVector, most_states> V{};
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) V[j][i] = random.normal();
    for (int k = 0; k < 2 * j; ++k) {  // twice is enough
      Quad dot = 0;
      for (int i = 0; i < n; ++i) dot += V[j][i] * V[k % j][i];
      for (int i = 0; i < n; ++i) V[j][i] -= dot * V[k % j][i];
    }
    Quad sum = 0;
    for (int i = 0; i < n; ++i) sum += V[j][i] * V[j][i];
    for (int i = 0; i < n; ++i) V[j][i] /= sqrtq(sum);
  }
  const int expanding = (n + 1) / 2;
  const double size = random.decade(-2, 2);
  QuadVector start{}, lambda{};
  for (int j = 0; j < n; ++j) {
    lambda[j] = (random.chance(0.5) ? -1 : 1) * (j < expanding ? random.uniform(1.2, 3) : random.uniform(0.3, 0.9));
    for (int i = 0; i < n && (j >= expanding || n == 1); ++i) start[i] += size * V[j][i];
  }
  const int known = random.below(4);  // all; all but the last; nearly; nearly but the last
  const double nearly = Random::power_of_ten(single ? -14 : -28) * size * size;
  for (int i = 0; i < n; ++i) {
    out.x0[static_cast<std::size_t>(i)] = fit(start[i]);
    for (int j = 0; j < n; ++j) {
      Quad sum = 0;
      for (int k = 0; k < n; ++k) sum += lambda[k] * V[k][i] * V[k][j];
      out.F[static_cast<std::size_t>(i * n + j)] = fit(sum);
    }
    out.G[static_cast<std::size_t>(i * n + i)] = 1;
    const bool other = known % 2 == 1 && i == n - 1;
    out.P0[static_cast<std::size_t>(i * n + i)] = fit(other ? size * size * 0.01 : known > 1 ? nearly : 0);
  }
  const int driven = random.below(4);  // nothing, all, one, all by hardly anything
  for (int i = 0; i < n; ++i) {
    const double q = driven == 0 || (driven == 2 && i > 0) ? 0 : driven == 3 ? nearly : 1e-4 * size * size;
    out.Q[static_cast<std::size_t>(i * n + i)] = fit(q);
  }
  for (auto& sensor : out.sensors) {
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j < n; ++j) sensor.H[static_cast<std::size_t>(i * n + j)] = fit(random.normal());
      sensor.R[static_cast<std::size_t>(i * p + i)] = fit(size * size * random.decade(single ? -6 : -12, 0));
    }
  }
  const QuadMatrix S = out.prior_root(), B = out.noise_root();
  QuadVector x{};
  const auto drive = [&](const QuadMatrix& root) {
    QuadVector e{};
    for (int j = 0; j < n; ++j) e[j] = random.normal();
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) x[i] += root[i][j] * e[j];
    }
  };
  for (int i = 0; i < n; ++i) x[i] = out.x0[static_cast<std::size_t>(i)];
  drive(S);
  const bool fused = random.chance(0.5);
  out.events.resize(24);
  for (Event& event : out.events) {
    const QuadVector old = x;
    for (int i = 0; i < n; ++i) {
      x[i] = 0;
      for (int j = 0; j < n; ++j) x[i] += Quad(out.F[static_cast<std::size_t>(i * n + j)]) * old[j];
    }
    drive(B);
    event.rows = random.chance(0.6) ? Rows::together : random.chance(0.5) ? Rows::apart : Rows::none;
    event.fused = fused && event.rows == Rows::together;
    event.sensor = random.below(2);
    const auto& sensor = out.sensors[static_cast<std::size_t>(event.sensor)];
    for (int i = 0; i < p; ++i) {
      Quad y = std::sqrt(sensor.R[static_cast<std::size_t>(i * p + i)]) * random.normal();
      for (int j = 0; j < n; ++j) y += Quad(sensor.H[static_cast<std::size_t>(i * n + j)]) * x[j];
      event.y[static_cast<std::size_t>(i)] = fit(y);
    }
  }
  return out;
}

}  // namespace rounding
