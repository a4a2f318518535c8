// SPDX-License-Identifier: BSD-3-Clause
// The strapdown navigation filter as a textbook's author writes it: error state on the right, R = R̂ Exp(δ),
// Jacobians derived on paper, a plain Kalman recursion, a reset after each correction. A second derivation,
// to judge what the library derives from the models alone.
//
// With φ = (rate - b_g - w_g) dt, R_m = R Exp(φ/2), f = force - b_a - w_a and R⁺ = R Exp(φ):
//   δ⁺  = Exp(φ)ᵀ δ - J_r(φ) dt (δb_g + w_g)
//   ψ   = Exp(φ/2)ᵀ δ - J_r(φ/2) dt/2 (δb_g + w_g)       the error of R_m
//   δa  = -R_m [f×] ψ - R_m (δb_a + w_a)
//   δv⁺ = δv + δa dt,   δp⁺ = δp + δv dt + δa dt²/2
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <navigation/sensors.hpp>

namespace models {

namespace by_hand {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Error = jml::Vector<double, 15>;
using Covariance = jml::Matrix<double, 15, 15>;

inline Matrix3 cross(const Vector3& v) {
  Matrix3 out;
  out << 0, -v(2), v(1), v(2), 0, -v(0), -v(1), v(0), 0;
  return out;
}
/// Exp(v) by Rodrigues' formula.
inline Matrix3 rotation(const Vector3& v) {
  const double angle = v.norm();
  if (angle == 0) return Matrix3::Identity();
  const Matrix3 K = cross(v / angle);
  const double s = std::sin(angle / 2);
  return Matrix3::Identity() + std::sin(angle) * K + 2 * s * s * K * K;
}
/// J_r: Exp(v + d) = Exp(v) Exp(J_r(v) d).
inline Matrix3 right_jacobian(const Vector3& v) {
  const double angle = v.norm(), square = angle * angle;
  const Matrix3 K = cross(v);
  if (angle < 1e-2) {
    const double a = 0.5 - square / 24 + square * square / 720;
    const double b = 1.0 / 6 - square / 120 + square * square / 5040;
    return Matrix3::Identity() - a * K + b * K * K;
  }
  return Matrix3::Identity() - (1 - std::cos(angle)) / square * K +
         (angle - std::sin(angle)) / (square * angle) * K * K;
}

/// f_x 15×15 and f_w 15×12 at w = 0.
struct Slopes {
  Covariance f_x = Covariance::Identity();
  jml::Matrix<double, 15, 12> f_w = jml::Matrix<double, 15, 12>::Zero();

  Slopes(const Matrix3& R, const navigation::State<double>& x, const jml::Vector<double, 6>& sample,
         double dt) {
    const Vector3 phi = (sample.head<3>() - x.segment<3>(navigation::gyro_bias)) * dt;
    const Vector3 f = sample.tail<3>() - x.segment<3>(navigation::force_bias);
    const Matrix3 R_m = R * rotation(phi / 2);
    const Matrix3 turned = -dt * right_jacobian(phi);                            // δ⁺ by a rate
    const Matrix3 a_delta = -R_m * cross(f) * rotation(phi / 2).transpose();     // δa by δ
    const Matrix3 a_rate = R_m * cross(f) * right_jacobian(phi / 2) * (dt / 2);  // by δb_g, w_g
    f_x.block<3, 3>(0, 0) = rotation(phi).transpose();
    f_x.block<3, 3>(0, 9) = turned;
    f_x.block<3, 3>(3, 6) = dt * Matrix3::Identity();
    f_w.block<3, 3>(0, 0) = turned;
    for (int which = 0; which < 2; ++which) {  // position, velocity
      const int row = 3 + 3 * which;
      const double share = which == 0 ? dt * dt / 2 : dt;
      f_x.block<3, 3>(row, 0) = share * a_delta;
      f_x.block<3, 3>(row, 9) = f_w.block<3, 3>(row, 0) = share * a_rate;
      f_x.block<3, 3>(row, 12) = f_w.block<3, 3>(row, 3) = -share * R_m;
    }
    f_w.bottomRightCorner<6, 6>().setIdentity();
  }
};

inline jml::Matrix<double, 3, 15> position_slope(const Matrix3& R, const Vector3& arm) {
  jml::Matrix<double, 3, 15> m_x = jml::Matrix<double, 3, 15>::Zero();
  m_x.leftCols<3>() = -R * cross(arm);
  m_x.block<3, 3>(0, 3).setIdentity();
  return m_x;
}
/// `rate`: less the bias, rad/s.
inline jml::Matrix<double, 3, 15> velocity_slope(const Matrix3& R, const Vector3& arm, const Vector3& rate) {
  jml::Matrix<double, 3, 15> m_x = jml::Matrix<double, 3, 15>::Zero();
  m_x.leftCols<3>() = -R * cross(rate.cross(arm));
  m_x.block<3, 3>(0, 6).setIdentity();
  m_x.block<3, 3>(0, 9) = R * cross(arm);
  return m_x;
}
/// Of a vector of the local axes as seen in the body's.
inline jml::Matrix<double, 3, 15> vector_slope(const Matrix3& R, const Vector3& vector) {
  jml::Matrix<double, 3, 15> m_x = jml::Matrix<double, 3, 15>::Zero();
  m_x.leftCols<3>() = cross(R.transpose() * vector);
  return m_x;
}
inline jml::Matrix<double, 1, 15> height_slope() {
  jml::Matrix<double, 1, 15> m_x = jml::Matrix<double, 1, 15>::Zero();
  m_x(5) = 1;
  return m_x;
}

}  // namespace by_hand

/// The filter. `resets`: P ← J P Jᵀ after a correction, with J_r of the correction of the attitude.
struct StrapdownByHand {
  navigation::Strapdown unit;
  navigation::State<double> x;
  by_hand::Covariance P;
  bool resets = true;
  by_hand::Vector3 rate = by_hand::Vector3::Zero();  // of the last sample, with its bias

  [[nodiscard]] by_hand::Matrix3 R() const {
    return Eigen::Quaterniond(x(0), x(1), x(2), x(3)).toRotationMatrix();
  }

  void predict(const jml::Vector<double, 6>& sample, double dt) {
    const by_hand::Slopes slope(R(), x, sample, dt);
    const jml::StepContext<double, 6> at{0, dt, sample};
    const jml::Matrix<double, 12, 12> Q = unit.disturbance_covariance(x, at);
    x = unit.dynamics(x, jml::Vector<double, 12>(jml::Vector<double, 12>::Zero()), at);
    x.head<4>().normalize();
    P = (slope.f_x * P * slope.f_x.transpose() + slope.f_w * Q * slope.f_w.transpose()).eval();
    rate = sample.head<3>();
  }
  template <int p>
  void correct(const jml::Vector<double, p>& y, const jml::Vector<double, p>& m,
               const jml::Matrix<double, p, 15>& m_x, const jml::Matrix<double, p, p>& R) {
    const jml::Matrix<double, p, p> S = m_x * P * m_x.transpose() + R;
    const jml::Matrix<double, 15, p> K = S.llt().solve(m_x * P).transpose();
    const by_hand::Error z = K * (y - m);
    by_hand::Covariance left = by_hand::Covariance::Identity() - K * m_x;
    P = (left * P * left.transpose() + K * R * K.transpose()).eval();
    x.head<4>() = (Eigen::Quaterniond(x(0), x(1), x(2), x(3)) *
                   Eigen::Quaterniond(Eigen::AngleAxisd(z.head<3>().norm(), z.head<3>().normalized())))
                      .coeffs()({3, 0, 1, 2});
    x.tail<12>() += z.tail<12>();
    if (!resets) return;
    left.setIdentity();
    left.topLeftCorner<3, 3>() = by_hand::right_jacobian(z.head<3>());
    P = (left * P * left.transpose()).eval();
  }
};

}  // namespace models
