// SPDX-License-Identifier: BSD-3-Clause
// Which test sees which mistake: a Kalman filter that is right passes; with a wrong Q, R or P_0 it fails
// where, and by as much as, the covariance of a filter with that gain says.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <jml/analysis/whiteness.hpp>
#include <jml/jml.hpp>
#include <vector>

#include "models/linear.hpp"

namespace {

using namespace jml::operators;

using jml::CovarianceVerdict;
using jml::WhitenessVerdict;
using Matrix4 = jml::Matrix<double, 4, 4>;
using Vector4 = jml::Vector<double, 4>;
using Matrix2 = jml::Matrix<double, 2, 2>;
using Vector2 = jml::Vector<double, 2>;

constexpr double dt = 1;  // s

/// What the filter believes, as multiples of the truth.
struct Belief {
  const char* name;
  double Q = 1, R = 1, P = 1;
};

struct Truth {
  models::ConstantVelocity dynamics{0.1};
  models::LinearSensor<4, 2> sensor;
  Matrix4 P = Matrix4::Identity();

  Truth() {
    sensor.M << 1, 0, 0, 0, 0, 0, 1, 0;
    sensor.R << 1, 0.3, 0.3, 0.5;
  }
  Matrix4 Q() const {
    return dynamics.disturbance_covariance(Vector4(Vector4::Zero()), jml::StepContext<double, 0>{0, dt, {}});
  }
};

auto filter_of(const Truth& truth, const Belief& belief) {
  models::ConstantVelocity dynamics = truth.dynamics;
  dynamics.q_c *= belief.Q;
  return jml::Filter{jml::Kalman{}, dynamics,
                     jml::Estimate{Vector4(Vector4::Zero()), Matrix4(belief.P * truth.P)}};
}

/// A campaign of independent runs, and what each test says of it.
struct Campaign {
  std::vector<jml::Consistency> nees;      // by step, over runs
  std::vector<double> run_nees;            // by run, over steps
  jml::Consistency nis;                    // of all
  jml::Whiteness<2> whiteness;             // of all
  int nis_fails = 0, whiteness_fails = 0;  // of single runs
  int run_nees_fails = 0;                  // of single runs, where the χ² interval does not belong

  Campaign(const Truth& truth, const Belief& belief, int runs, int steps, jml::Noise& noise)
      : nees(static_cast<std::size_t>(steps)) {
    auto sensor = truth.sensor;
    sensor.R *= belief.R;
    const Matrix4 Q = truth.Q();
    for (int run = 0; run < runs; ++run) {
      Vector4 x = noise.normal_vector(truth.P);
      auto filter = filter_of(truth, belief);
      jml::Consistency one_nis, one_nees;
      jml::Whiteness<2> one;
      whiteness.start_run();
      for (auto& at_step : nees) {
        x = (truth.dynamics.dynamics(x, jml::StepContext<double, 0>{0, dt, {}}) + noise.normal_vector(Q)).eval();
        const Vector2 y = truth.sensor.M * x + noise.normal_vector(truth.sensor.R);
        const auto report = filter.step(sensor, y, dt);
        const double value = jml::nees(x - filter.x(), filter.P());
        at_step.add(value, 4);
        one_nees.add(value, 4);
        for (auto* test : {&nis, &one_nis}) test->add(report);
        for (auto* test : {&whiteness, &one}) test->add(report);
      }
      run_nees.push_back(one_nees.average());
      if (one_nees.verdict() != CovarianceVerdict::consistent) ++run_nees_fails;
      if (one_nis.verdict() != CovarianceVerdict::consistent) ++nis_fails;
      if (one.verdict() == WhitenessVerdict::coloured) ++whiteness_fails;
    }
  }
  void print(const Belief& belief) const {
    std::printf("  %-14s NEES fails at %zu of %zu times; of %zu runs alone: NIS %d, whiteness %d\n",
                belief.name, static_cast<std::size_t>(nees_fails()), nees.size(), run_nees.size(), nis_fails,
                whiteness_fails);
  }
  int nees_fails() const {
    return count_nees(CovarianceVerdict::optimistic) + count_nees(CovarianceVerdict::pessimistic);
  }
  int count_nees(CovarianceVerdict verdict) const {
    int count = 0;
    for (const auto& at_step : nees) count += at_step.verdict() == verdict ? 1 : 0;
    return count;
  }
};

/// Means of NEES and NIS at each step and the autocorrelation at lag 1 at the end, from the covariance of the
/// error of the filter's gain in Joseph's form: no random number.
struct Theory {
  std::vector<double> nees, nis;
  Matrix2 autocorrelation;

  Theory(const Truth& truth, const Belief& belief, int steps) {
    auto filter = filter_of(truth, belief);
    auto sensor = truth.sensor;
    sensor.R *= belief.R;
    Matrix4 F = Matrix4::Identity(), spread = truth.P;
    F(0, 1) = F(2, 3) = dt;
    const auto& M = truth.sensor.M;
    for (int i = 0; i < steps; ++i) {
      const auto report = filter.step(sensor, Vector2(0, 0), dt);
      const jml::Matrix<double, 4, 2> K = report.gain;
      const Matrix4 predicted = F * spread * F.transpose() + truth.Q(), left = Matrix4::Identity() - K * M;
      const Matrix2 S = M * predicted * M.transpose() + truth.sensor.R;
      spread = left * predicted * left.transpose() + K * truth.sensor.R * K.transpose();
      nees.push_back((filter.P().inverse() * spread).trace());
      nis.push_back((report.innovation_matrix.inverse() * S).trace());
      // ν⁺ = M F [(I - K M) e⁻ - K v] + …, ν = M e⁻ + v: E ν⁺ νᵀ = M F (E e⁻ e⁻ᵀ Mᵀ - K S).
      const Matrix2 lag = M * F * (predicted * M.transpose() - K * S);
      const double l00 = std::sqrt(report.innovation_matrix(0, 0)),
                   l10 = report.innovation_matrix(1, 0) / l00;
      Matrix2 L;
      L << l00, 0, l10, std::sqrt(report.innovation_matrix(1, 1) - l10 * l10);
      const Matrix2 variance = L.inverse() * S * L.inverse().transpose();
      const Vector2 unit = variance.diagonal().cwiseSqrt().cwiseInverse();
      autocorrelation = unit.asDiagonal() * (L.inverse() * lag * L.inverse().transpose()) * unit.asDiagonal();
    }
  }
};

/// The standard error of an average of correlated or scaled χ² is not that of the test: from the spread of
/// the runs.
double standard_error(const std::vector<double>& values, double& mean) {
  double sum = 0, squares = 0;
  for (const double value : values) sum += value;
  const auto count = static_cast<double>(values.size());
  mean = sum / count;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / (count - 1) / count);
}

double mean_of(const std::vector<double>& values) {
  double mean;
  (void)standard_error(values, mean);
  return mean;
}

TEST(RightFilter, PassesAsOftenAsPromised) {
  const Truth truth;
  jml::Noise noise(1);
  constexpr int campaigns = 100, runs = 50, steps = 100;
  std::vector<double> shares;
  int nis_fails = 0, whiteness_fails = 0;
  for (int c = 0; c < campaigns; ++c) {
    const Campaign campaign(truth, {"right"}, runs, steps, noise);
    shares.push_back(static_cast<double>(campaign.count_nees(CovarianceVerdict::consistent)) / steps);
    nis_fails += campaign.nis_fails;
    whiteness_fails += campaign.whiteness_fails;
  }
  double share;
  const double error = standard_error(shares, share);  // times of one campaign are correlated
  EXPECT_NEAR(share, 0.95, 3 * error);
  EXPECT_LT(error, 0.006);
  constexpr double all = campaigns * runs;
  EXPECT_NEAR(nis_fails / all, 0.05, 3 * std::sqrt(0.05 * 0.95 / all));
  EXPECT_NEAR(whiteness_fails / all, 0.05, 0.015);  // asymptotic, at N = 5 p lags
}

TEST(RightFilter, NeesAlongOneRunIsNoSampleOfChiSquare) {
  const Truth truth;
  jml::Noise noise(2);
  const Campaign campaign(truth, {"right"}, 1000, 200, noise);
  EXPECT_GT(campaign.run_nees_fails, 150) << "not 50: the values of a run are correlated";
  EXPECT_NEAR(campaign.nis_fails, 50, 21);
  double mean;
  const double error = standard_error(campaign.run_nees, mean);
  EXPECT_TRUE(jml::mean_interval(mean, error, 1000, 0.99).contains(4)) << mean << " +- " << error;
  EXPECT_EQ(campaign.nis.verdict(), CovarianceVerdict::consistent);
  EXPECT_EQ(campaign.whiteness.verdict(), WhitenessVerdict::white);
}

constexpr int runs = 200, steps = 200;

/// Averages against the theory, whatever the verdicts.
void expect_theory(const Campaign& campaign, const Theory& theory) {
  double mean;
  const double error = standard_error(campaign.run_nees, mean);
  EXPECT_NEAR(mean, mean_of(theory.nees), 4 * error);
  const double nis = mean_of(theory.nis);
  EXPECT_NEAR(campaign.nis.average(), nis, 0.02 * nis);  // 3 to 4 standard errors
  EXPECT_LT((campaign.whiteness.autocorrelation(1) - theory.autocorrelation).cwiseAbs().maxCoeff(), 0.03);
}

TEST(WrongFilter, TenthsAndTensFailEveryTest) {
  const struct {
    Belief belief;
    CovarianceVerdict verdict;
    double lag_one;  // sign of the first entry
  } cases[] = {{{"Q / 10", 0.1, 1, 1}, CovarianceVerdict::optimistic, 1},
               {{"R / 10", 1, 0.1, 1}, CovarianceVerdict::optimistic, -1},
               {{"10 Q", 10, 1, 1}, CovarianceVerdict::pessimistic, -1},
               {{"10 R", 1, 10, 1}, CovarianceVerdict::pessimistic, 1}};
  const Truth truth;
  for (const auto& wrong : cases) {
    SCOPED_TRACE(wrong.belief.name);
    jml::Noise noise(3);
    const Campaign campaign(truth, wrong.belief, runs, steps, noise);
    campaign.print(wrong.belief);
    EXPECT_GE(campaign.count_nees(wrong.verdict), steps - 5) << "Q is not felt in the first steps";
    EXPECT_EQ(campaign.nis.verdict(), wrong.verdict);
    EXPECT_EQ(campaign.nis_fails, runs) << "each single run shows it";
    EXPECT_GE(campaign.whiteness_fails, runs - 2);
    EXPECT_GT(wrong.lag_one * campaign.whiteness.autocorrelation(1)(0, 0), 0.2);
    expect_theory(campaign, Theory(truth, wrong.belief, steps));
  }
}

TEST(WrongFilter, QTooSmallAndRTooLargeCancelInNisButAreColoured) {
  const Truth truth;
  const Belief belief{"Q / 10, 5.4 R", 0.1, 5.4, 1};
  const Theory theory(truth, belief, steps);
  EXPECT_NEAR(theory.nis.back(), 2, 0.06) << "the case is made so";
  jml::Noise noise(4);
  const Campaign campaign(truth, belief, runs, steps, noise);
  campaign.print(belief);
  EXPECT_LT(campaign.nis_fails, runs / 2);
  EXPECT_EQ(campaign.whiteness_fails, runs);
  EXPECT_GE(campaign.count_nees(CovarianceVerdict::optimistic), steps - 5);
  expect_theory(campaign, theory);
}

TEST(WrongFilter, OneFactorOnAllLeavesTheInnovationsWhite) {
  const Truth truth;
  jml::Noise noise(5), same(5);
  const Campaign right(truth, {"right"}, runs, steps, noise);
  const Belief belief{"all / 1.5", 1 / 1.5, 1 / 1.5, 1 / 1.5};
  const Campaign campaign(truth, belief, runs, steps, same);
  campaign.print(belief);
  EXPECT_EQ(campaign.whiteness.verdict(), WhitenessVerdict::white);
  EXPECT_NEAR(campaign.whiteness.statistic(), right.whiteness.statistic(), 1e-9);
  EXPECT_EQ(campaign.count_nees(CovarianceVerdict::optimistic), steps);
  EXPECT_EQ(campaign.nis_fails, runs);
  EXPECT_NEAR(campaign.nis.average(), 1.5 * right.nis.average(), 1e-9);
}

TEST(WrongFilter, AWrongStartIsSeenByNeesWhileItIsRemembered) {
  const Truth truth;
  const Belief belief{"P_0 / 10", 1, 1, 0.1};
  jml::Noise noise(6);
  const Campaign campaign(truth, belief, runs, steps, noise);
  campaign.print(belief);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(campaign.nees[i].verdict(), CovarianceVerdict::optimistic) << i;
  EXPECT_LT(campaign.nees_fails(), steps / 5);
  EXPECT_LT(campaign.nis_fails, runs / 5) << "a whole run has forgotten it";
  EXPECT_LT(campaign.whiteness_fails, runs / 8);
}

}  // namespace
