// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Dense>
using V6 = Eigen::Matrix<double, 6, 1>;
using M6 = Eigen::Matrix<double, 6, 6>;
using V3 = Eigen::Matrix<double, 3, 1>;
using M3 = Eigen::Matrix<double, 3, 3>;
using H = Eigen::Matrix<double, 3, 6>;
double run(const V3& y, V6& x, M6& P, const M6& F, const H& h, const V3& m, const M6& Q, const M3& R) {
  x = F * x;
  P = F * P * F.transpose() + Q;
  const M3 S = h * P * h.transpose() + R;
  const Eigen::Matrix<double, 6, 3> K = S.llt().solve(h * P).transpose();
  x += K * (y - m);
  P = (M6::Identity() - K * h) * P * (M6::Identity() - K * h).transpose() + K * R * K.transpose();
  return x(0);
}
