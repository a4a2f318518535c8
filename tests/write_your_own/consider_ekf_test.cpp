// SPDX-License-Identifier: BSD-3-Clause
// The consider filter of examples/write_your_own against the joint Kalman filter whose gain rows are struck
// out, in long double, and against numbers worked out by hand.
#include "write_your_own/consider_ekf.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <iterator>
#include <jml/campaign/noise.hpp>

#include "figure.hpp"
#include "models/linear.hpp"

namespace {

using jml::Status;
template <int n>
using V = jml::Vector<double, n>;
template <int n, int m = n>
using M = jml::Matrix<double, n, m>;
using Big = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

template <int rows, int cols>
Big big(const M<rows, cols>& a) {
  return a.template cast<long double>();
}

/// All states in one filter, in long double; the correction multiplied out, P - K H P - (K H P)ᵀ + K S Kᵀ.
struct Joint {
  Big x, P;
  long considered;

  void predict(const Big& F, const Big& noise) {
    x = Big(F * x);
    P = Big(F * P * F.transpose()) + noise;
  }
  void correct(const Big& H, const Big& R, const Big& y) {
    const Big S = H * P * H.transpose() + R;
    Big K = S.llt().solve(H * P).transpose();
    for (long i = K.rows() - considered; i < K.rows(); ++i) K.row(i).setZero();
    const Big KHP = K * (H * P);
    x = Big(x + K * (y - H * x));
    P = Big(P - KHP - KHP.transpose() + K * S * K.transpose());
  }
};

// Out of the templates below, for the compiler's sake: each is made once.
bool no_eigenvalue_below(const Eigen::MatrixXd& P, double bound) {  // exactly where P - bound I has a root
  const Big shifted = P.cast<long double>() - static_cast<long double>(bound) * Big::Identity(P.rows(), P.rows());
  return shifted.llt().info() == Eigen::Success;
}
double distance(const Eigen::MatrixXd& a, const Big& b) {
  return static_cast<double>((a.cast<long double>() - b).norm());
}
Big product(const Big& a, const Big& b, const Big& c) { return a * b * c; }

/// The largest difference over the runs, of x and P in units of the largest deviation, or of x, that the run
/// has seen.
template <int n, int k, int p>
double worst_of_runs(unsigned seed, int runs, int steps) {
  jml::Noise noise(seed);
  double worst = 0;
  for (int run = 0; run < runs; ++run) {
    auto dynamics = models::random_linear_dynamics<n, 2>(noise);
    if (run % 2 ==
        0) {  // the considered ones are constants, as biases are; in odd runs they move like the others
      dynamics.F.bottomRows(k).setZero();
      for (int i = n - k; i < n; ++i) dynamics.F(i, i) = 1;
      dynamics.G.bottomRows(k).setZero();
    }
    const auto sensor = models::random_linear_sensor<n, p>(noise);
    M<n> L = models::random_matrix<n, n>(noise);
    if (run % 3 == 1) L.leftCols(n - 1).setZero();         // rank one
    if (run % 3 == 2) L.topRows(run % (n + 1)).setZero();  // some known, or all
    const M<n> P = L * L.transpose();
    const jml::Estimate<double, n> start{models::random_matrix<n, 1>(noise), jml::kernel::symmetric_part(P)};
    jml::Filter filter{own::ConsiderEkf<k>{}, dynamics, start};
    Joint wanted{big(start.x), big(start.P), k};
    const Big F = big(dynamics.F), G = big(dynamics.G), Q = product(G, big(dynamics.Q), G.transpose()),
              H = big(sensor.M);
    double x_scale = start.x.norm(), P_scale = start.P.norm() + 1e-300;
    for (int step = 0; step < steps; ++step) {
      const V<p> y = sensor.M * filter.x() + noise.template normal_vector<p>(sensor.R);
      const double draw = noise.uniform();
      if (draw < 0.8) wanted.predict(F, Q);
      if (draw < 0.2) {
        EXPECT_EQ(filter.predict(), Status::ok);
      } else {
        const auto before = filter.estimate();
        const auto report = draw < 0.8 ? filter.step(sensor, y) : filter.update(sensor, y);
        EXPECT_EQ(report.status, Status::ok) << run << ", " << step;
        wanted.correct(H, big(sensor.R), big(y));
        EXPECT_TRUE(report.gain.template bottomRows<k>().isZero(0));
        if (draw >= 0.8) {  // a correction alone: not a bit of the considered block moves
          EXPECT_EQ((filter.x().template tail<k>()), (before.x.template tail<k>()));
          EXPECT_EQ((filter.P().template bottomRightCorner<k, k>()),
                    (before.P.template bottomRightCorner<k, k>()));
        }
      }
      EXPECT_EQ(filter.P(), filter.P().transpose());
      x_scale = std::max(x_scale, filter.x().norm());
      P_scale = std::max(P_scale, filter.P().norm());
      EXPECT_TRUE(no_eigenvalue_below(filter.P(), -1e-14 * P_scale)) << run << ", " << step;
      worst = std::max(worst, distance(filter.x(), wanted.x) / x_scale);
      worst = std::max(worst, distance(filter.P(), wanted.P) / P_scale);
    }
  }
  return worst;
}

TEST(ConsiderEkf, IsTheJointFilterWithStruckGain) {
  const double worst[] = {worst_of_runs<2, 1, 1>(1, 100, 300), worst_of_runs<4, 2, 2>(2, 100, 300),
                          worst_of_runs<5, 4, 3>(3, 60, 300)};
  for (const double one : worst) {
    EXPECT_LT(one, 1e-12);
  }
  figure::print("difference", *std::max_element(std::begin(worst), std::end(worst)));
}

TEST(ConsiderEkf, NothingConsideredIsTheKalmanFilter) {
  jml::Noise noise(5);
  const auto dynamics = models::random_linear_dynamics<3, 2>(noise);
  const auto sensor = models::random_linear_sensor<3, 2>(noise);
  const jml::Estimate<double, 3> start{V<3>(1, 2, 3), models::random_covariance<3>(noise, 0.1)};
  jml::Filter kalman{jml::Kalman{}, dynamics, start};
  jml::Filter none{own::ConsiderEkf<0>{}, dynamics, start};
  jml::Filter all{own::ConsiderEkf<3>{}, dynamics, start}, blind = all;
  for (int k = 0; k < 100; ++k) {
    const V<2> y = noise.normal_vector<2>();
    ASSERT_EQ(kalman.step(sensor, y).status, Status::ok);
    ASSERT_EQ(none.step(sensor, y).status, Status::ok);
    ASSERT_EQ(all.step(sensor, y).status, Status::ok);
    ASSERT_EQ(blind.predict(), Status::ok);
    ASSERT_LT((none.x() - kalman.x()).norm(), 1e-14);
    ASSERT_LT((none.P() - kalman.P()).norm(), 1e-14);
    ASSERT_EQ(all.x(), blind.x()) << "all considered: no measurement changes anything";
    ASSERT_EQ(all.P(), blind.P());
  }
}

/// x⁺ = x + 0.3 sin x + b x, b⁺ = b.
struct Bent {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    using std::sin;
    return {x(0) + 0.3 * sin(x(0)) + x(1) * x(0), x(1)};
  }
  M<2, 1> disturbance_input() const { return {1, 0}; }
  V<1> disturbance_covariance() const { return V<1>(0.05); }
};
/// y = x² + b.
struct Biased {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0) + x(1));
  }
  V<1> noise_covariance() const { return V<1>(0.2); }
};
// One step in single numbers: f_x = [1 + 0.3 cos x + b, x; 0, 1], m_x = [2 x̄, 1].
TEST(ConsiderEkf, ANonlinearStepByHand) {
  const double x = 0.9, b = 0.1, pxx = 0.4, pxb = 0.07, pbb = 0.09, q = 0.05, r = 0.2, y = 2.5;
  jml::Filter filter{own::ConsiderEkf<1>{}, Bent{},
                     jml::Estimate{V<2>(x, b), (M<2>() << pxx, pxb, pxb, pbb).finished()}};
  const auto report = filter.step(Biased{}, y);
  ASSERT_EQ(report.status, Status::ok);

  const double x1 = x + 0.3 * std::sin(x) + b * x, slope = 1 + 0.3 * std::cos(x) + b;
  const double nxx = slope * slope * pxx + 2 * slope * x * pxb + x * x * pbb + q, nxb = slope * pxb + x * pbb;
  const double h = 2 * x1, S = h * h * nxx + 2 * h * nxb + pbb + r, gain = (h * nxx + nxb) / S;
  const double innovation = y - x1 * x1 - b, keep = 1 - gain * h;
  EXPECT_NEAR(report.innovation(0), innovation, 1e-14);
  EXPECT_NEAR(report.innovation_matrix(0), S, 1e-14);
  EXPECT_NEAR(report.gain(0), gain, 1e-15);
  EXPECT_EQ(report.gain(1), 0);
  EXPECT_NEAR(filter.x()(0), x1 + gain * innovation, 1e-14);
  EXPECT_EQ(filter.x()(1), b);
  EXPECT_NEAR(filter.P()(0, 0), keep * keep * nxx - 2 * keep * gain * nxb + gain * gain * (pbb + r), 1e-15);
  EXPECT_NEAR(filter.P()(0, 1), keep * nxb - gain * pbb, 1e-15);
  EXPECT_EQ(filter.P()(1, 1), pbb);
}

TEST(ConsiderEkf, ARejectedMeasurementLeavesThePrediction) {
  const M<2> P = 0.1 * M<2>::Identity();
  jml::Filter filter{own::ConsiderEkf<1>{}, Bent{}, jml::Estimate{V<2>(0.9, 0.1), P}}, predicted = filter;
  filter.gate = {0.99};
  ASSERT_EQ(predicted.predict(), Status::ok);
  const auto report = filter.step(Biased{}, 1e3);
  EXPECT_EQ(report.status, Status::ok);
  EXPECT_EQ(report.gate, jml::Verdict::rejected);
  EXPECT_EQ(filter.x(), predicted.x());
  EXPECT_EQ(filter.P(), predicted.P());
}

}  // namespace
