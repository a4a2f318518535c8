// SPDX-License-Identifier: BSD-3-Clause
// The chapter's claims measured (Rusnak 2018): how far its filter ends above the least J of (8), and how many
// sweeps along the smoothed trajectory make it exact.
#include <gtest/gtest.h>

#include <cstdio>
#include <jml/continuous/continuous.hpp>

#include "continuous/two_point_flight.hpp"
#include "figure.hpp"

namespace {

using namespace jml::operators;
using namespace two_point_flight;

using jml::Status;

/// Mean excess and rms distance to the optimum at the ends of flights.
struct Distance {
  double excess = 0, square = 0;
  int count = 0;
  [[nodiscard]] double mean() const { return excess / count; }
  [[nodiscard]] double rms() const { return std::sqrt(square / count); }
};

/// The EKF, SDDRE and RNLS filters at five times of a flight.
void add_filters(const std::vector<double>& y, double dt, const Case& of, std::array<Distance, 3>& out) {
  const int steps = static_cast<int>(y.size()) - 1;
  jml::Filter ekf{jml::Continuous{jml::Ekf{}}, of.oscillator, of.start};
  jml::Filter sddre{jml::Continuous{jml::Sddre{}}, of.oscillator, of.start};
  jml::Filter rnls{jml::Continuous{jml::Rnls{}}, of.oscillator, of.start};
  Smoother smoother{of.oscillator, of.sensor, of.start, {.steps = steps}};
  for (int k = 0; k < steps; ++k) {
    const jml::Line line{y[std::size_t(k)], y[std::size_t(k) + 1]};
    EXPECT_EQ(smoother.step(line, dt), Status::ok);
    EXPECT_EQ(ekf.step(of.sensor, line, dt).status, Status::ok);
    EXPECT_EQ(sddre.step(of.sensor, line, dt).status, Status::ok);
    EXPECT_EQ(rnls.step(of.sensor, line, dt).status, Status::ok);
    if ((k + 1) % (steps / 5) != 0) continue;
    EXPECT_TRUE(usable(smoother.solve().status));
    const std::array<X, 3> estimates{ekf.x(), sddre.x(), rnls.x()};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto excess = jml::excess_cost(smoother, estimates[i]);
      EXPECT_EQ(excess.status, Status::ok);
      out[i].excess += excess.value;
      out[i].square += jml::kernel::squared_norm(estimates[i] - smoother.x());
      ++out[i].count;
    }
  }
}

void print(const char* what, const std::array<Distance, 3>& of) {
  std::printf("%s: excess EKF %.2e, SDDRE %.2e, RNLS %.2e; rms distance %.1e, %.1e, %.1e\n", what,
              of[0].mean(), of[1].mean(), of[2].mean(), of[0].rms(), of[1].rms(), of[2].rms());
}

TEST(TwoPointClaims, FiltersAboveTheLeastCriterion) {  // 20 s at 1 ms, and 3 s
  std::array<Distance, 3> noisy, consistent, smooth;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) add_filters(flight(20000, 1e-3, seed), 1e-3, {}, noisy);
  add_filters(flight(20000, 1e-3, 0), 1e-3, {}, consistent);
  std::vector<double> y;
  for (int k = 0; k <= 3000; ++k) y.push_back(0.8 * std::cos(0.9e-3 * k) + 0.05 * std::sin(3e-3 * k));
  add_filters(y, 1e-3, gentle(), smooth);
  print("both noises", noisy);
  print("no noise", consistent);
  print("a smooth y that no trajectory has", smooth);
  const char* const names[] = {"ekf", "sddre", "rnls"};
  for (std::size_t i = 0; i < 3; ++i) {
    figure::print(std::string(names[i]) + "_excess", noisy[i].mean());
    figure::print(std::string(names[i]) + "_distance", noisy[i].rms());
  }
  EXPECT_LT(noisy[0].mean(), 0.05);
  EXPECT_GT(noisy[1].mean(), 0.1);
  EXPECT_GT(noisy[2].mean(), 0.1);
  EXPECT_LT(noisy[2].mean(), 10);
  for (const Distance& of : consistent) EXPECT_LT(of.mean(), 1e-5);
  for (const Distance& of : smooth) {
    EXPECT_GT(of.mean(), 1e-6);
    EXPECT_LT(of.mean(), 0.1);
  }
}

/// How the sweeps of a rule end on a thousand flights of 3 s.
struct Share {
  int converged = 0, there = 0;
  std::array<std::vector<double>, 5> after;  // 1, 2, 5, 10, 20 sweeps
  std::vector<double> sweeps;
};
template <typename Rule>
void run(const Rule& rule, const Smoother& smoother, Share& out) {
  Smoother swept = smoother;
  const auto report = jml::sweep(swept, rule, {}, [&](const auto& so_far) {
    constexpr std::array counts{1, 2, 5, 10, 20};
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (so_far.sweeps == counts[i]) out.after[i].push_back(distance(swept, smoother));
    }
  });
  out.sweeps.push_back(report.sweeps);
  if (report.status != Status::ok) return;
  ++out.converged;
  out.there += distance(swept, smoother) < 1e-7;
}
double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[values.size() / 2];
}
/// Of the distance, by the medians after 10 and 20 sweeps.
double a_sweep_leaves(const Share& of) { return std::pow(median(of.after[4]) / median(of.after[3]), 0.1); }
void print(const char* what, const Share& of) {
  std::printf(
      "%s: %d converged, %d of them at the optimum, median of %.0f sweeps; median distance after 1, 2, 5, "
      "10, "
      "20:",
      what, of.converged, of.there, median(of.sweeps));
  for (const auto& values : of.after) std::printf(" %.1e", median(values));
  std::printf("\n");
}

TEST(TwoPointClaims, SweptOnAThousandFlights) {
  constexpr int flights = 1000;
  const Case of = gentle();
  Share rnls, gauss_newton;
  std::vector<double> passes;
  for (std::uint64_t seed = 1; seed <= flights; ++seed) {
    Smoother smoother = smoother_of(flight(300, 0.01, seed, of), 0.01, of);
    const auto least = smoother.solve();
    ASSERT_EQ(least.status, Status::ok) << seed;
    passes.push_back(least.iterations);
    run(jml::Rnls{}, smoother, rnls);
    run(jml::Ekf{}, smoother, gauss_newton);
  }
  print("RNLS swept", rnls);
  print("Gauss-Newton", gauss_newton);
  figure::print("rnls_swept_there", rnls.there);
  figure::print("rnls_swept_sweeps", median(rnls.sweeps));
  figure::print("gauss_newton_there", gauss_newton.there);
  figure::print("gauss_newton_sweeps", median(gauss_newton.sweeps));
  figure::print("rnls_sweep_leaves", a_sweep_leaves(rnls));
  figure::print("solve_passes", median(passes));
  EXPECT_GE(rnls.there, 990);
  EXPECT_GE(gauss_newton.there, 990);
  EXPECT_LT(median(rnls.sweeps), 40);
  EXPECT_LT(median(rnls.after[4]), 1e-5);
}

// The chapter's own example, where the sensor is flat and R small: a sweep of (19) leaves most of the
// distance.
TEST(TwoPointClaims, SweptOnTheChaptersExample) {
  Share rnls;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Smoother smoother = smoother_of(flight(500, 0.01, seed), 0.01);
    ASSERT_EQ(smoother.solve().status, Status::ok) << seed;
    run(jml::Rnls{}, smoother, rnls);
  }
  print("RNLS swept, chapter's example", rnls);
  figure::print("chapter/rnls_swept_converged", rnls.converged);
  figure::print("chapter/rnls_swept_there", rnls.there);
  figure::print("chapter/rnls_sweep_leaves", a_sweep_leaves(rnls));
  EXPECT_EQ(rnls.sweeps.size(), 100);
}

}  // namespace
