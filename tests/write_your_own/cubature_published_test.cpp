// SPDX-License-Identifier: BSD-3-Clause
// The cubature filter of examples/write_your_own against published figures of others (the EKF/UKF toolbox
// manual, Hartikainen, Solin and Särkkä 2011), and the EKF beside it on the same runs.
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "published/bearings_only_track.hpp"
#include "published/growth_track.hpp"
#include "write_your_own/cubature.hpp"

namespace {

// Mean square error 72.3 published; 72.28 ± 0.09 recomputed elsewhere.
TEST(CubatureFigures, Growth) {
  campaign::Score cubature{"cubature"}, ekf{"EKF"};
  for (unsigned run = 0; run < 100000; ++run) {
    const growth::Track track(run);
    growth::score(own::Cubature{}, track, cubature);
    if (run < 500) growth::score(jml::Ekf{}, track, ekf);
  }
  cubature.print("", "growth");
  ekf.print("");
  EXPECT_EQ(cubature.refused, 0);
  EXPECT_EQ(cubature.lost, 0);
  EXPECT_LT(cubature.error.figure().standard_error, 0.05) << "too few runs to say anything";
  campaign::expect_agreement(cubature, {72.28, 0.09});
}

/// The filter of the paper line by line, in matrices of any size: weighted sums, Cholesky, an inverse.
/// Bearings are unwrapped about that of the prediction. The points depend on the root of P, so the states are
/// put into the order in which the library's factor takes them.
class Textbook {
  using Big = Eigen::MatrixXd;

 public:
  Big x = Big::Zero(4, 1), P = Big::Zero(4, 4);

  void step(const jml::Vector<double, 2>& y) {
    constexpr double turn = 2 * 3.141592653589793;
    Big F = Big::Identity(4, 4);
    F(0, 2) = F(1, 3) = 0.01;
    x = F * x;
    P = F * P * F.transpose() + models::WhiteAcceleration{}.disturbance_covariance();
    const jml::kernel::SemidefiniteFactor<double, 4> order{jml::Matrix<double, 4, 4>(P)};
    Big permutation = Big::Zero(4, 4);
    for (int i = 0; i < 4; ++i) permutation(i, order.pivot[i]) = 1;
    const Big sorted = permutation * P * permutation.transpose();
    const Big L = permutation.transpose() * Big(sorted.llt().matrixL());
    Big X(4, 8), Z(2, 8);
    for (int j = 0; j < 8; ++j) {
      X.col(j) = x + (j < 4 ? 2 : -2) * L.col(j % 4);
      for (int i = 0; i < 2; ++i)
        Z(i, j) = bearing(i, x) + std::remainder(bearing(i, X.col(j)) - bearing(i, x), turn);
    }
    const Big z = Z.rowwise().mean();
    const Big S = Z * Z.transpose() / 8 - z * z.transpose() + 0.0025 * Big::Identity(2, 2);
    const Big K = (X * Z.transpose() / 8 - x * z.transpose()) * S.inverse();
    Big innovation = y - z;
    for (int i = 0; i < 2; ++i) innovation(i) = std::remainder(innovation(i), turn);
    x += K * innovation;
    P -= K * S * K.transpose();
  }

 private:
  static double bearing(int i, const Big& x) {
    return i == 0 ? std::atan2(x(1) + 2, x(0) + 1) : std::atan2(x(1) - 1, x(0) - 1);
  }
};

TEST(CubatureFigures, BearingsOnlyAsInThePaper) {
  double worst = 0;
  for (unsigned run = 0; run < 200; ++run) {
    const bearings_only::Track track(run);
    Textbook wanted;
    wanted.P.diagonal() << 0.1, 0.1, 10, 10;
    jml::Filter filter{own::Cubature{}, models::WhiteAcceleration{},
                       jml::Estimate<double, 4>{wanted.x, wanted.P}};
    for (const auto& y : track.y) {
      wanted.step(y);
      ASSERT_EQ(filter.step(models::DirectionFinders{}, y).status, jml::Status::ok);
      worst = std::max(worst, (filter.x() - wanted.x).cwiseAbs().maxCoeff());
      worst = std::max(worst, (filter.P() - wanted.P).cwiseAbs().maxCoeff());
    }
  }
  EXPECT_LT(worst, 1e-9);
  figure::print("bearings_only_from_textbook", worst);
}

// RMSE 0.108 published, rounded to 0.0005 and taken for a mean of 100 runs that scatter as these do (0.0027).
// It is on the low side of that: 0.1125 ± 0.0004 with 5000 runs, where the EKF has 0.1123.
TEST(CubatureFigures, BearingsOnly) {
  campaign::Score cubature{"cubature"}, ekf{"EKF"};
  for (unsigned run = 0; run < 1000; ++run) {
    const bearings_only::Track track(run);
    bearings_only::score(own::Cubature{}, track, cubature);
    bearings_only::score(jml::Ekf{}, track, ekf);
  }
  cubature.print("", "bearings_only");
  ekf.print("", "bearings_only_ekf");
  EXPECT_EQ(cubature.refused, 0);
  EXPECT_EQ(cubature.lost, 0);
  const double ours = cubature.error.figure().standard_error;
  EXPECT_LT(ours, 0.001) << "too few runs to say anything";
  campaign::expect_agreement(cubature, {0.108, std::hypot(ours * std::sqrt(10.0), 0.0005)});
}

}  // namespace
