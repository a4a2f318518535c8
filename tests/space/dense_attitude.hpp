// SPDX-License-Identifier: BSD-3-Clause
// A second derivation of attitudes: rotation matrices by Rodrigues' formula, and minima by differences, in
// long double.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <jml/argument.hpp>

namespace oracle {

using Real = long double;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
using Vector3 = Eigen::Matrix<Real, 3, 1>;
using Unknowns = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

inline Matrix3 cross(const Vector3& v) {
  Matrix3 out;
  out << 0, -v(2), v(1), v(2), 0, -v(0), -v(1), v(0), 0;
  return out;
}
inline Matrix3 rodrigues(const Vector3& v) {
  const Real angle = v.norm();
  const Matrix3 K = cross(v);
  if (angle < 1e-12L) return Matrix3::Identity() + K + K * K / 2;
  return Matrix3::Identity() + std::sin(angle) / angle * K + (1 - std::cos(angle)) / (angle * angle) * K * K;
}
/// q as a matrix, by its own formula.
inline Matrix3 matrix_of(const jml::Vector<double, 4>& given) {
  Eigen::Matrix<Real, 4, 1> q = given.cast<Real>();
  q /= q.norm();
  Matrix3 R;
  R << 1 - 2 * (q(2) * q(2) + q(3) * q(3)), 2 * (q(1) * q(2) - q(0) * q(3)), 2 * (q(1) * q(3) + q(0) * q(2)),
      2 * (q(1) * q(2) + q(0) * q(3)), 1 - 2 * (q(1) * q(1) + q(3) * q(3)), 2 * (q(2) * q(3) - q(0) * q(1)),
      2 * (q(1) * q(3) - q(0) * q(2)), 2 * (q(2) * q(3) + q(0) * q(1)), 1 - 2 * (q(1) * q(1) + q(2) * q(2));
  return R;
}
inline double angle_between(const Matrix3& a, const Matrix3& b) {
  const Matrix3 off = a.transpose() * b;
  const Vector3 twice{off(2, 1) - off(1, 2), off(0, 2) - off(2, 0), off(1, 0) - off(0, 1)};
  return static_cast<double>(std::atan2(twice.norm(), off.trace() - 1));
}

/// Newton's method on J by five-point differences, from z, with steps that lower J.
template <typename Cost>
Unknowns dense_minimum(const Cost& J, Unknowns z) {
  const Real h = 1e-3L;
  const auto n = z.size();
  const auto slope = [&](const Unknowns& at, Eigen::Index i) {
    Unknowns a = at;
    const auto value = [&](Real by) {
      a(i) = at(i) + by;
      return J(a);
    };
    return (value(-2 * h) - 8 * value(-h) + 8 * value(h) - value(2 * h)) / (12 * h);
  };
  const auto gradient = [&](const Unknowns& at) {
    Unknowns g(n);
    for (Eigen::Index i = 0; i < n; ++i) g(i) = slope(at, i);
    return g;
  };
  for (int iteration = 0; iteration < 60; ++iteration) {
    const Unknowns g = gradient(z);
    if (g.norm() < 1e-13L) break;
    Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic> H(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      Unknowns a = z;
      a(i) += h;
      Unknowns b = z;
      b(i) -= h;
      H.col(i) = (gradient(a) - gradient(b)) / (2 * h);
    }
    H = (H + H.transpose()).eval() / 2;
    Real more = 0;
    while (H.llt().info() != Eigen::Success) {
      H.diagonal().array() += more == 0 ? 1e-3L * H.cwiseAbs().maxCoeff() : more;
      more = more == 0 ? 1e-3L * H.cwiseAbs().maxCoeff() : 2 * more;
    }
    const Unknowns step = H.ldlt().solve(-g);
    Real share = 1;
    while (share > 1e-9L && J(z + share * step) > J(z)) share /= 2;
    z += share * step;
    if (step.norm() < 1e-15L) break;
  }
  return z;
}

}  // namespace oracle
