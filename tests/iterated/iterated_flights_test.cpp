// SPDX-License-Identifier: BSD-3-Clause
// Exact steps of every condition against the root in 113-bit arithmetic: a usable status never stands over a wrong
// x or P.
#include <gtest/gtest.h>

#include <cstdio>
#include <jml/campaign/noise.hpp>
#include <jml/filter/filter.hpp>
#include <jml/iterated/factored_iterated.hpp>

#include "iterated/quad_root.hpp"

namespace {

using quad_root::Column;
using quad_root::Quad;
using quad_root::Shape;
using quad_root::Table;

template <int n>
Column<n> state_of(const jml::Vector<double, n>& x) {
  Column<n> out;
  for (int i = 0; i < n; ++i) out[i] = x(i);
  return out;
}
template <int n>
Table<n, n> covariance_of(const jml::Estimate<double, n>& belief) {
  Table<n, n> out;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) out[i][j] = belief.P(i, j);
  }
  return out;
}
template <int n>
Table<n, n> covariance_of(const jml::FactoredBelief<double, n>& belief) {
  Table<n, n> out{};
  for (int k = 0; k < n; ++k) {
    const Quad d = Quad(belief.D(k)) + (belief.extended ? belief.D_low(k) : 0);
    Column<n> u;
    for (int i = 0; i < n; ++i) u[i] = Quad(belief.U(i, k)) + (belief.extended ? belief.U_low(i, k) : 0);
    for (int i = 0; i <= k; ++i) {
      for (int j = 0; j <= k; ++j) out[i][j] += u[i] * d * u[j];
    }
  }
  return out;
}
template <int n>
Column<n> exact_state(const jml::Estimate<double, n>& belief) {
  return state_of<n>(belief.x);
}
template <int n>
Column<n> exact_state(const jml::FactoredBelief<double, n>& belief) {
  Column<n> out = state_of<n>(belief.x);
  for (int i = 0; i < n; ++i) out[i] += belief.extended ? belief.x_low(i) : 0;
  return out;
}

struct Tally {
  int steps = 0, ok = 0, at_rounding = 0, refused = 0, redone = 0, unjudged = 0, wrong = 0;
  double worst_x = 0, worst_P = 0, worst_loose = 0;
};

/// A usable answer against the root next to it.
template <int n, int p, typename Belief, typename Report>
void judge(quad_root::Step<n, p> step, const Belief& prior, const Belief& next, const Report& report,
           Tally& tally) {
  ++tally.steps;
  tally.redone += report.redone;
  if (!jml::usable(report.status)) {
    ++tally.refused;
    return;
  }
  const bool ok = report.status == jml::Status::ok;
  ++(ok ? tally.ok : tally.at_rounding);
  const Column<n> x = exact_state(next);
  using Kind = typename quad_root::Step<n, p>::Kind;
  step.anchor(step.kind == Kind::before ? prior.x : report.smoothed, next.x);
  const auto exact = step.find(state_of<n>(report.smoothed), x);
  const auto far = quad_root::distance<n>(x, covariance_of(next), exact.x, exact.P);
  if (!exact.converged || far.P < 0) {
    ++tally.unjudged;
    return;
  }
  // Rounding of x itself, in the standard deviations of each state: what the doubles of x cannot say.
  bool by_component = true;
  for (int i = 0; i < n; ++i) {
    const Quad off = fabsq(x[i] - exact.x[i]);
    by_component = by_component && (off <= 1e-3 * sqrtq(exact.P[i][i]) || off <= 256 * 2.3e-16 * (1 + fabsq(x[i])));
  }
  const bool right = (ok ? far.x <= 3e-3 : by_component) && far.P <= 3e-3;
  if (ok) tally.worst_x = std::max(tally.worst_x, far.x);
  else tally.worst_loose = std::max(tally.worst_loose, far.x);
  tally.worst_P = std::max(tally.worst_P, far.P);
  if (!right && ++tally.wrong <= 10)
    ADD_FAILURE() << "step " << tally.steps << (ok ? " ok" : " at rounding") << (report.redone ? " redone" : "") << ": x " << far.x
                  << " sd, P " << far.P << " rounding " << report.rounding << " kind " << int(step.kind) << " shape "
                  << int(step.rows.kind);
}

template <typename Rule, int n, int p>
void fly(const Rule& rule, std::uint64_t seed, int flights, bool joint, Tally& tally) {
  jml::Noise noise(seed);
  for (int run = 0; run < flights; ++run) {
    const double condition = noise.uniform(0, 20);  // decades
    quad_root::Motion<n> motion;
    for (int i = 0; i < n; ++i) {
      motion.F[i * n + i] = 1;
      if (i + 1 < n) motion.F[i * n + i + 1] = std::pow(10, noise.uniform(-2, 1));
      motion.a[i] = noise.uniform(-1, 1);
      motion.b[i] = noise.uniform(-1, 1);
      motion.q[i] = noise.uniform() < 0.5 ? 0 : std::pow(10, noise.uniform(-condition, 0));
    }
    motion.c = noise.uniform() < 0.3 ? 0 : noise.uniform(0, 0.3);
    const double large = std::pow(10, noise.uniform(-2, condition / 2 < 6 ? condition / 2 : 6));
    const double small = std::pow(10, noise.uniform(-condition, 0));
    jml::Estimate<double, n> start;
    Column<n> truth{};
    for (int i = 0; i < n; ++i) {
      const double sd = i == 0 ? large : large * std::pow(small, 0.5 * i / n);
      start.x(i) = noise.uniform(-2, 2);
      start.P(i, i) = sd * sd;
      truth[i] = start.x(i) + (sd < 1 ? sd : 1) * noise.uniform(-1, 1);
    }
    jml::Filter filter{rule, motion, start};
    if (run % 3 == 1) filter.gate = {0.9999};
    for (int k = 0; k < 4; ++k) {
      quad_root::Rows<n, p> rows;
      rows.kind = static_cast<Shape>(noise.uniform() < 0.2 ? 0 : 1 + static_cast<int>(noise.uniform(0, 2.999)));
      const double apart = std::pow(10, -noise.uniform(0, condition / 2 < 8 ? condition / 2 : 8));
      const double r = noise.uniform() < 0.5 ? apart * apart : std::pow(10, noise.uniform(-condition, 0));
      for (int l = 0; l < p; ++l) {
        for (int j = 0; j < n; ++j) rows.h[l * n + j] = l == 0 ? noise.uniform(-1, 1) : rows.h[j];
        if (l > 0) rows.h[l * n + n - l] += apart;
        rows.r[l] = r;
      }
      const bool moves = k % 2 == 0;
      quad_root::Step<n, p> step{motion, rows, {}, {}, {}};
      step.kind = !moves  ? quad_root::Step<n, p>::Kind::none
                  : joint ? quad_root::Step<n, p>::Kind::joint
                          : quad_root::Step<n, p>::Kind::before;
      step.x_hat = exact_state(filter.belief());
      step.P = covariance_of(filter.belief());
      if (moves) truth = step.f(truth);
      jml::Vector<double, p> y;
      for (int l = 0; l < p; ++l) {
        y(l) = static_cast<double>(quad_root::shape(rows.kind, rows.along(l, truth))[0]) + std::sqrt(r) * noise.uniform(-1.7, 1.7);
        step.y[l] = y(l);
      }
      const auto before = filter.belief();
      const auto report = moves ? filter.step(rows, y) : filter.update(rows, y);
      if (report.gate == jml::Verdict::rejected) continue;
      judge<n, p>(step, before, filter.belief(), report, tally);
      if (!jml::usable(report.status)) {
        ASSERT_EQ(filter.x(), before.x);
        if (k == 0) break;
      }
    }
  }
}

template <typename Rule>
Tally fly_all(const char* name, const Rule& rule, bool joint) {
  Tally tally;
  fly<Rule, 2, 1>(rule, 11, 1700, joint, tally);
  fly<Rule, 2, 2>(rule, 12, 1700, joint, tally);
  fly<Rule, 3, 2>(rule, 13, 1600, joint, tally);
  std::printf("%-24s %d steps: %d ok (x %.2g sd, P %.2g), %d at rounding (%.2g sd), %d refused, %d redone, %d not judged, %d wrong\n", name,
              tally.steps, tally.ok, tally.worst_x, tally.worst_P, tally.at_rounding, tally.worst_loose, tally.refused,
              tally.redone, tally.unjudged, tally.wrong);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_LT(tally.unjudged, tally.steps / 500);
  EXPECT_GT(tally.redone, tally.steps / 40);  // the generator reaches them
  return tally;
}

TEST(IteratedFlights, Iekf) {
  const Tally tally = fly_all("Iekf", jml::Iekf{}, false);
  EXPECT_LT(tally.refused, tally.steps / 4);
}
TEST(IteratedFlights, IteratedEkf) {
  const Tally tally = fly_all("Iterated<Ekf>", jml::Iterated<jml::Ekf<>>{}, true);
  EXPECT_LT(tally.refused, tally.steps / 4);
}
TEST(IteratedFlights, FactoredIekf) {
  const Tally tally = fly_all("Factored{Iekf}", jml::Factored{jml::Iekf{}}, false);
  EXPECT_LT(tally.refused, tally.steps / 10);
}
TEST(IteratedFlights, FactoredIteratedEkf) {
  const Tally tally = fly_all("Factored{Iterated<Ekf>}", jml::Factored{jml::Iterated<jml::Ekf<>>{}}, true);
  EXPECT_LT(tally.refused, tally.steps / 10);
}

}  // namespace
