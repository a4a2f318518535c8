// SPDX-License-Identifier: BSD-3-Clause
// Ranks of pairs whose reachable subspace is known by construction, in any units, and where the rank of the
// printed matrices goes wrong; the examination of models against hand calculations.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <jml/analysis/observability.hpp>

#include "models/continuous.hpp"
#include "models/linear.hpp"
#include "models/stability.hpp"

namespace {

using namespace jml::operators;

template <int rows, int cols>
using M = jml::Matrix<double, rows, cols>;

TEST(PrintedMatrices, AreStackedAsPrinted) {
  const M<2, 2> F{{1, 2}, {3, 4}};
  const M<1, 2> H{5, 6};
  EXPECT_EQ(jml::observability_matrix(F, H), (M<2, 2>{{5, 6}, {23, 34}}));
  const M<2, 1> L{5, 6};
  EXPECT_EQ(jml::controllability_matrix(F, L), (M<2, 2>{{5, 17}, {6, 39}}));
  const M<2, 2> two{{1, 0}, {1, 1}};
  EXPECT_EQ(jml::controllability_matrix(F, two), (M<2, 4>{{1, 0, 3, 2}, {1, 1, 7, 4}}));
  EXPECT_EQ(jml::observability_matrix(F, two), (M<4, 2>{{1, 0}, {1, 1}, {1, 2}, {4, 6}}));
}

/// A pair of 6 states and 2 inputs that reaches exactly `reached` of them, in a random basis.
struct Pair {
  M<6, 6> F;
  M<6, 2> L;
};
Pair random_pair(jml::Noise& noise, int reached) {
  Pair out{models::random_matrix<6, 6>(noise), models::random_matrix<6, 2>(noise)};
  for (int i = reached; i < 6; ++i) {
    out.L.row(i).setZero();
    for (int j = 0; j < reached; ++j) out.F(i, j) = 0;
  }
  const M<6, 6> T = Eigen::HouseholderQR<M<6, 6>>(models::random_matrix<6, 6>(noise)).householderQ();
  return {T * out.F * T.transpose(), T * out.L};
}

TEST(Rank, IsTheDimensionReachedByConstruction) {
  jml::Noise noise(7);
  for (int run = 0; run < 200; ++run) {
    const int reached = run % 7;
    const Pair pair = random_pair(noise, reached);
    const auto found = jml::controllability_rank(pair.F, pair.L);
    EXPECT_EQ(found.rank, reached) << run;
    EXPECT_LT(found.rejected, 1e-13) << run;
    EXPECT_GT(found.margin, reached > 0 ? 1e-5 : -1) << run;
    const auto dual = jml::observability_rank(M<6, 6>(pair.F.transpose()), M<2, 6>(pair.L.transpose()));
    EXPECT_EQ(dual.rank, reached) << run;
    EXPECT_EQ(dual.margin, found.margin) << run;
  }
}

// Ranks and margins belong to the pair, not to metres, degrees or milliseconds.
TEST(Rank, DependsOnNoUnit) {
  jml::Noise noise(8);
  for (int run = 0; run < 100; ++run) {
    M<6, 6> F = models::random_matrix<6, 6>(noise);
    M<6, 2> L = models::random_matrix<6, 2>(noise);
    const int reached = 2 + run % 5;  // in the coordinates of the states: units can be changed one by one
    for (int i = reached; i < 6; ++i) {
      L.row(i).setZero();
      for (int j = 0; j < reached; ++j) F(i, j) = 0;
    }
    const auto plain = jml::controllability_rank(F, L);
    EXPECT_EQ(plain.rank, reached);
    jml::Vector<double, 6> unit;
    for (int i = 0; i < 6; ++i) unit(i) = std::exp(5 * noise.normal());
    const double time = std::exp(8 * noise.normal());
    const M<6, 6> scaled = time * (unit.asDiagonal() * F * unit.cwiseInverse().asDiagonal());
    const auto other = jml::controllability_rank(scaled, M<6, 2>(1e-9 * (unit.asDiagonal() * L)));
    EXPECT_EQ(other.rank, reached);
    EXPECT_NEAR(other.margin, plain.margin, 1e-9 * plain.margin);
  }
}

/// Six units between 10^-spread and 10^spread.
jml::Vector<double, 6> random_units(jml::Noise& noise, double spread) {
  jml::Vector<double, 6> unit;
  for (int i = 0; i < 6; ++i) unit(i) = std::pow(10.0, spread * std::erf(noise.normal() / std::sqrt(2.0)));
  return unit;
}

// A pair in a random basis, where no entry is zero, reaches what it was made to reach in all units.
TEST(Rank, OfHiddenPairsInUnitsFarApart) {
  for (const double spread : {3.0, 9.0, 12.0}) {
    jml::Noise noise(17);
    int wrong = 0;
    for (int run = 0; run < 500; ++run) {
      const int reached = 1 + run % 6;
      const Pair pair = random_pair(noise, reached);
      const auto unit = random_units(noise, spread);
      const M<6, 6> F = unit.asDiagonal() * pair.F * unit.cwiseInverse().asDiagonal();
      const M<6, 2> L = unit.asDiagonal() * pair.L;
      wrong += jml::controllability_rank(F, L).rank != reached;
      wrong += jml::observability_rank(M<6, 6>(F.transpose()), M<2, 6>(L.transpose())).rank != reached;
    }
    EXPECT_EQ(wrong, 0) << spread;
  }
}

// Blocks in a row, each driven by the one before and by nothing else: the coupling has a size in no units but
// the states' own. Where a coupling is missing, the row ends.
TEST(Rank, OfARowOfBlocksInUnitsFarApart) {
  for (const bool nilpotent : {false, true}) {
    jml::Noise noise(18);
    int wrong = 0;
    for (int run = 0; run < 500; ++run) {
      M<6, 6> F = models::random_matrix<6, 6>(noise);
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
          if (nilpotent ? j >= i : j / 2 > i / 2) F(i, j) = 0;
        }
      }
      const int reached = 2 * (1 + run % 3);
      for (int i = reached; i < 6; ++i) {
        for (int j = 0; j < reached; ++j) F(i, j) = 0;
      }
      M<6, 1> L = M<6, 1>::Zero();
      L(0) = 1;
      const auto unit = random_units(noise, 9);
      const M<6, 6> scaled = unit.asDiagonal() * F * unit.cwiseInverse().asDiagonal();
      wrong += jml::controllability_rank(scaled, M<6, 1>(unit.asDiagonal() * L)).rank != reached;
    }
    EXPECT_EQ(wrong, 0) << nilpotent;
  }
}

// Six integrators at a time unit of a millisecond: observable, with every coupling 1 in its own units. The
// printed matrix has entries from 1 to 1e-15, and less than full rank by its singular values.
TEST(Rank, OfAChainOfIntegratorsWhereThePrintedMatrixFails) {
  M<6, 6> F = M<6, 6>::Zero();
  for (int i = 0; i + 1 < 6; ++i) F(i, i + 1) = 1e-3;
  M<1, 6> H = M<1, 6>::Zero();
  H(0) = 1;
  const auto found = jml::observability_rank(F, H);
  EXPECT_EQ(found.rank, 6);
  EXPECT_GT(found.margin, 0.1);
  const M<6, 6> printed = jml::observability_matrix(F, H);
  const Eigen::JacobiSVD<M<6, 6>> decomposed(printed);
  EXPECT_LT(decomposed.rank(), 6);
  EXPECT_EQ(jml::observability_rank(F, M<1, 6>(M<1, 6>::Unit(5))).rank, 1);  // the last alone sees itself
}

// Two modes that the input drives alike, δ apart: the distance to an uncontrollable pair is of order δ.
TEST(Rank, MarginFollowsTheDistanceToAnUncontrollablePair) {
  double before = 0;
  for (const double delta : {1e-3, 1e-6, 1e-9}) {
    const M<2, 2> F{{1, 0}, {0, 1 + delta}};
    const M<2, 1> L{1, 1};
    const auto found = jml::controllability_rank(F, L);
    EXPECT_EQ(found.rank, 2);
    // min_s σ_min[F - s, L] is δ/2 at s = 1 + δ/2, up to O(δ²); the scaling halves L and keeps F.
    EXPECT_GT(found.margin, 0.2 * delta);
    EXPECT_LT(found.margin, 2 * delta);
    if (before > 0) {
      EXPECT_NEAR(found.margin / before, 1e-3, 1e-5);
    }
    before = found.margin;
  }
  EXPECT_EQ(jml::controllability_rank(M<2, 2>(M<2, 2>::Identity()), M<2, 1>(1, 1)).rank, 1);
}

// Rounding is what closes a cycle with nothing in it. A single coupling of 1e-17 is one of 1 in other units.
TEST(Rank, TakesRoundingForZeroAndNothingForNothing) {
  const M<2, 2> F{{-1, 1}, {1e-17, -2}};
  EXPECT_EQ(jml::controllability_rank(F, M<2, 1>(1, 0)).rank, 1);
  EXPECT_EQ(jml::controllability_rank(M<2, 2>{{-1, 0}, {1e-17, -2}}, M<2, 1>(1, 0)).rank, 2);
  EXPECT_EQ(jml::controllability_rank(M<2, 2>{{-1, 0}, {1, -2}}, M<2, 1>(1, 0)).rank, 2);
  const auto none = jml::controllability_rank(F, M<2, 1>(0, 0));
  EXPECT_EQ(none.rank, 0);
  EXPECT_EQ(none.margin, 0);
  EXPECT_EQ(jml::controllability_rank(M<2, 2>(M<2, 2>::Zero()), M<2, 2>(M<2, 2>::Identity())).rank, 2);
}

TEST(Rank, InSinglePrecision) {
  using F6 = jml::Matrix<float, 6, 6>;
  jml::Noise noise(9);
  for (int reached = 1; reached <= 6; ++reached) {
    const Pair pair = random_pair(noise, reached);
    const auto found =
        jml::controllability_rank(F6(pair.F.cast<float>()), jml::Matrix<float, 6, 2>(pair.L.cast<float>()));
    EXPECT_EQ(found.rank, reached);
  }
}

TEST(Examination, OfTheChaptersOscillator) {
  const models::Oscillator oscillator;
  const models::SaturatingSignal signal;
  const jml::Vector<double, 2> x(2, 0.7);
  const auto found = jml::examine_sdc(oscillator, signal, x);
  ASSERT_EQ(found.status, jml::Status::ok);
  EXPECT_EQ(found.observable_sdc.rank, 2);
  EXPECT_EQ(found.observable_jacobian.rank, 2);
  EXPECT_EQ(found.controllable_sdc.rank, 2);
  EXPECT_EQ(found.controllable_jacobian.rank, 2);
  // f_x - F = [0 0; -4 c x1 x2, 0];  m_x - M = (1 + x1²)^{-3/2} - (1 + x1²)^{-1/2} = -x1² (1 + x1²)^{-3/2}
  EXPECT_NEAR(found.dynamics_gap, 4 * 0.01 * 2 * 0.7, 1e-15);
  EXPECT_NEAR(found.sensor_gap, 4 * std::pow(5, -1.5), 1e-15);
}

// h = x - x³ at ±1: H = 0 but h_x = -2; at 1/√3 the other way round. One pair is blind, the other is not.
TEST(Examination, TellsTheTwoPairsApart) {
  const models::Copies<1> d{M<1, 1>(0.5), M<1, 1>(1)};
  const models::TurningSignals<1> s{M<1, 1>(0.3)};
  const auto at_one = jml::examine_sdc(d, s, jml::Vector<double, 1>(1));
  EXPECT_EQ(at_one.observable_sdc.rank, 0);
  EXPECT_EQ(at_one.observable_jacobian.rank, 1);
  EXPECT_NEAR(at_one.sensor_gap, 2, 1e-15);
  EXPECT_EQ(at_one.dynamics_gap, 0);
  const auto at_turn = jml::examine_sdc(d, s, jml::Vector<double, 1>(0));
  EXPECT_EQ(at_turn.observable_sdc.rank, 1);
  EXPECT_EQ(at_turn.observable_jacobian.rank, 1);
}

TEST(Examination, AllowsASingularDensity) {
  models::Oscillator still;
  still.q = 0;
  const jml::Vector<double, 2> x(1, 1);
  const auto found = jml::examine_sdc(still, models::SaturatingSignal{}, x);
  EXPECT_EQ(found.status, jml::Status::ok);
  EXPECT_EQ(found.controllable_sdc.rank, 0);
  EXPECT_EQ(found.observable_sdc.rank, 2);
  const models::Copies<2> half{{0.5, 0.5}, {1, 0}};  // Q = diag(1, 0), the states not coupled
  const models::TurningSignals<2> signals{{1, 1}};
  EXPECT_EQ(jml::examine_sdc(half, signals, x).controllable_jacobian.rank, 1);
}

TEST(Examination, RefusesByName) {
  const jml::Vector<double, 2> x(1, 1), nowhere(NAN, 0);
  models::Oscillator d;
  models::SaturatingSignal s;
  EXPECT_EQ(jml::examine_sdc(d, s, nowhere).status, jml::Status::invalid_state);
  d.q = -1;
  EXPECT_EQ(jml::examine_sdc(d, s, x).status, jml::Status::invalid_disturbance_covariance);
  d = {};
  s.r = 0;
  EXPECT_EQ(jml::examine_sdc(d, s, x).status, jml::Status::invalid_noise_covariance);
  s = {};
  d.mu = 0;
  EXPECT_EQ(jml::examine_sdc(d, s, x).status, jml::Status::dynamics_not_finite);
}

TEST(AlongATrajectory, TheWorstIsKeptWithItsTime) {
  const models::Copies<1> d{M<1, 1>(0.5), M<1, 1>(1)};
  const models::TurningSignals<1> s{M<1, 1>(0.3)};
  jml::SdcAlongTrajectory<double> along;
  for (int k = 0; k <= 200; ++k) {
    const double x = k == 150 ? NAN : 0.01 * k;  // passes x = 1 at k = 100
    along.add(jml::examine_sdc(d, s, jml::Vector<double, 1>(x)), 0.1 * k);
  }
  EXPECT_EQ(along.points, 201);
  EXPECT_EQ(along.refused, 1);
  EXPECT_EQ(along.refusal, jml::Status::invalid_state);
  EXPECT_EQ(along.observable_sdc.rank, 0);
  EXPECT_DOUBLE_EQ(along.observable_sdc.time, 10);
  EXPECT_EQ(along.controllable_sdc.rank, 1);
  EXPECT_NEAR(along.sensor_gap.value, 2 * 4, 1e-12);  // |h_x - H| = 2x², largest at the end
  EXPECT_DOUBLE_EQ(along.sensor_gap.time, 20);
}

}  // namespace
