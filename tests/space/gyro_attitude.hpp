// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An attitude driven by a gyroscope, with the gyroscope's bias: the model in the space SO(3) × ℝ³, and the
/// same estimate written out by hand, without a chart, in the axes of the body as it turns:
///   q̇ = ½ q ∘ (0, ω), ω = ω_m(t) - b;   δθ̇ = -ω × δθ - δb + w_θ,  δḃ = w_b   (δ right of q),
/// with Ṗ = A P + P Aᵀ + Q by many small steps of Runge and Kutta.
#pragma once

#include <Eigen/LU>
#include <jml/continuous/continuous.hpp>
#include <jml/model/rotation.hpp>

namespace gyro_attitude {

using Vector3 = jml::Vector<double, 3>;
using Vector4 = jml::Vector<double, 4>;
using Vector6 = jml::Vector<double, 6>;
using Vector7 = jml::Vector<double, 7>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using Matrix6 = jml::Matrix<double, 6, 6>;

/// rad/s
inline Vector3 gyro(double t) {
  return {0.9 * std::sin(1.3 * t) + 0.4, 0.7 * std::cos(2.1 * t), -0.8 + 0.3 * t};
}
inline Matrix6 density() {
  Matrix6 Q = Matrix6::Zero();
  Q.diagonal() << 4e-4, 1e-4, 9e-4, 1e-6, 4e-6, 2e-6;
  Q(0, 1) = Q(1, 0) = 1e-4;
  Q(2, 3) = Q(3, 2) = -1e-5;
  return Q;
}

struct Gyro {
  using Space = jml::Product<jml::SO3, jml::Euclidean<3>>;
  using time_domain = jml::ContinuousTime;
  static constexpr int disturbances = 6;
  template <typename T>
  jml::Vector<T, 6> dynamics(const jml::Vector<T, 7>& x, const auto& at) const {
    const Vector3 rate = gyro(at.time);
    jml::Vector<T, 6> out = jml::Vector<T, 6>::Zero();
    for (int i = 0; i < 3; ++i) out(i) = rate(i) - x(4 + i);
    return out;
  }
  Matrix6 disturbance_spectral_density() const { return density(); }
};
/// A direction known in the axes of navigation, as the body sees it: by samples, or all the time.
inline const Vector3 direction{0.6, 0, 0.8};
struct Look {
  static constexpr int measurements = 3;
  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 7>& x) const {
    return jml::rotate_back(jml::Vector<T, 4>(x.template head<4>()), jml::Vector<T, 3>(direction.cast<T>()));
  }
};
struct Samples : Look {
  Matrix3 noise_covariance() const { return 0.01 * Matrix3::Identity(); }
};
struct Signal : Look {
  Matrix3 noise_spectral_density() const { return 0.02 * Matrix3::Identity(); }
};

inline jml::Estimate<double, 7, 6> start() {
  Vector7 x;
  x << 0.5, -0.5, 0.1, std::sqrt(0.49), 0.02, -0.03, 0.05;
  Matrix6 L = Matrix6::Zero();
  for (int j = 0; j < 6; ++j) {
    for (int i = j; i < 6; ++i)
      L(i, j) = (i == j ? 0.3 : 0.08 * std::sin(1.0 + 3 * i + 5 * j)) * (i < 3 ? 1 : 0.2);
  }
  return {x, L * L.transpose()};
}

/// ---- by hand
inline Matrix3 cross(const Vector3& a) {
  Matrix3 out;
  out << 0, -a(2), a(1), a(2), 0, -a(0), -a(1), a(0), 0;
  return out;
}
inline Matrix3 rotation(const Vector4& q) {
  const Vector3 v = q.tail<3>();
  return (q(0) * q(0) - v.squaredNorm()) * Matrix3::Identity() + 2 * v * v.transpose() + 2 * q(0) * cross(v);
}
inline Matrix3 exponential(const Vector3& a) {  // of cross(a)
  Matrix3 sum = Matrix3::Identity(), term = sum;
  for (int k = 1; k < 30; ++k) sum += term = term * cross(a) / k;
  return sum;
}

struct ByHand {
  Vector7 x;
  Matrix6 P;

  struct Slope {
    Vector7 x;
    Matrix6 P;
  };
  /// y(t): null where nothing measures. A push K ν of the attitude turns its axes as a correction's does:
  /// half.
  template <typename Y>
  static Slope slope(double t, const Vector7& x, const Matrix6& P, const Y& y) {
    Vector3 omega = gyro(t) - Vector3(x.tail<3>()), push = Vector3::Zero();
    Slope out;
    Matrix6 A = Matrix6::Zero();
    A.topLeftCorner<3, 3>() = -cross(omega);
    A.topRightCorner<3, 3>() = -Matrix3::Identity();
    out.x.setZero();
    out.P = density();
    if constexpr (!std::is_same_v<Y, std::nullptr_t>) {
      const Vector3 seen = rotation(x.head<4>()).transpose() * direction;
      jml::Matrix<double, 3, 6> H = jml::Matrix<double, 3, 6>::Zero();
      H.leftCols<3>() = cross(seen);
      const jml::Matrix<double, 6, 3> K = P * H.transpose() / 0.02;
      const Vector6 Kv = K * (y(t) - seen);
      push = Kv.head<3>();
      out.x.tail<3>() = Kv.tail<3>();
      A.topLeftCorner<3, 3>() -= 0.5 * cross(push);
      out.P -= 0.02 * K * K.transpose();
    }
    out.P += A * P + P * A.transpose();
    const Vector3 turn = omega + push;
    const Vector4 q = x.head<4>();
    const Vector3 v = q.tail<3>();
    out.x(0) = -0.5 * v.dot(turn);
    out.x.segment<3>(1) = 0.5 * (q(0) * turn + cross(v) * turn);
    return out;
  }
  template <typename Y = std::nullptr_t>
  void move(double from, double dt, int steps, const Y& y = nullptr) {
    const double h = dt / steps;
    for (int k = 0; k < steps; ++k) {
      const double t = from + k * h;
      const Slope a = slope(t, x, P, y), b = slope(t + h / 2, x + h / 2 * a.x, P + h / 2 * a.P, y),
                  c = slope(t + h / 2, x + h / 2 * b.x, P + h / 2 * b.P, y),
                  d = slope(t + h, x + h * c.x, P + h * c.P, y);
      x += h / 6 * (a.x + 2 * b.x + 2 * c.x + d.x);
      P += h / 6 * (a.P + 2 * b.P + 2 * c.P + d.P);
      x.head<4>().normalize();
    }
  }
  void correct(const Vector3& y) {
    const Vector3 seen = rotation(x.head<4>()).transpose() * direction;
    jml::Matrix<double, 3, 6> H = jml::Matrix<double, 3, 6>::Zero();
    H.leftCols<3>() = cross(seen);
    const Matrix3 S = H * P * H.transpose() + 0.01 * Matrix3::Identity();
    const jml::Matrix<double, 6, 3> K = P * H.transpose() * S.inverse();
    const Vector6 delta = K * (y - seen);
    const Matrix6 left = Matrix6::Identity() - K * H;
    P = left * P * left.transpose() + 0.01 * K * K.transpose();
    const Vector3 turn = delta.head<3>();
    const double angle = turn.norm();
    const Vector4 q = x.head<4>();
    const double c = std::cos(angle / 2);
    const Vector3 s = std::sin(angle / 2) * turn / angle, v = q.tail<3>();
    x(0) = q(0) * c - v.dot(s);
    x.segment<3>(1) = q(0) * s + c * v + cross(v) * s;
    x.tail<3>() += delta.tail<3>();
    Matrix6 J = Matrix6::Identity();  // ∫ Exp(-s turn) ds, by its series
    Matrix3 term = Matrix3::Identity();
    for (int k = 1; k < 30; ++k) J.topLeftCorner<3, 3>() += term = -term * cross(turn) / (k + 1);
    P = J * P * J.transpose();
  }
};

/// Of the attitude, rad, and of the bias, by their largest; of P relative to √(P_ii P_jj).
struct Error {
  double x, P;
};
inline Error off(const Vector7& x, const Matrix6& P, const ByHand& right) {
  const Matrix3 between = rotation(right.x.head<4>()).transpose() * rotation(x.head<4>());
  const double turn = 0.5 * Vector3(between(2, 1) - between(1, 2), between(0, 2) - between(2, 0),
                                    between(1, 0) - between(0, 1))
                                .norm();
  Error out{std::max(turn, (x - right.x).tail<3>().cwiseAbs().maxCoeff()), 0};
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j)
      out.P = std::max(out.P, std::abs(P(i, j) - right.P(i, j)) / std::sqrt(right.P(i, i) * right.P(j, j)));
  }
  return out;
}

}  // namespace gyro_attitude
