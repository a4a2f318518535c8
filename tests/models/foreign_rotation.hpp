// SPDX-License-Identifier: BSD-3-Clause
// A rotation type of another library, as it comes to jml: by a specialisation of SpaceTraits. It stands for
// those of Sophus and manif, which keep an Eigen::Quaternion: the numbers are (x, y, z, w), and exp and log
// are its own.
#pragma once

#include <Eigen/Geometry>
#include <jml/jml.hpp>

namespace foreign {

/// Nothing here knows of jml.
template <typename T>
class Rotation {
 public:
  explicit Rotation(const Eigen::Quaternion<T>& q) : q_(q) {}

  static Rotation exp(const Eigen::Matrix<T, 3, 1>& omega) {
    using std::cos, std::sin, std::sqrt;
    const T square = omega(0) * omega(0) + omega(1) * omega(1) + omega(2) * omega(2);
    T imaginary, real;
    if (square < T(1e-6)) {
      imaginary = T(0.5) - square / T(48) + square * square / T(3840);
      real = T(1) - square / T(8) + square * square / T(384);
    } else {
      const T angle = sqrt(square), half = T(0.5) * angle;
      imaginary = sin(half) / angle;
      real = cos(half);
    }
    return Rotation({real, imaginary * omega(0), imaginary * omega(1), imaginary * omega(2)});
  }
  Eigen::Matrix<T, 3, 1> log() const {
    using std::atan2, std::sqrt;
    const T square = q_.x() * q_.x() + q_.y() * q_.y() + q_.z() * q_.z(), w = q_.w();
    T factor;
    if (square < T(1e-6)) {
      const T t = square / (w * w);
      factor = (T(2) - t * (T(2) / T(3) - t * T(0.4))) / w;
    } else {
      const T n = sqrt(square);
      factor = T(2) * (w < T(0) ? atan2(-n, -w) : atan2(n, w)) / n;
    }
    return {factor * q_.x(), factor * q_.y(), factor * q_.z()};
  }
  Rotation inverse() const { return Rotation({q_.w(), -q_.x(), -q_.y(), -q_.z()}); }
  friend Rotation operator*(const Rotation& a, const Rotation& b) {
    const auto &p = a.q_, &q = b.q_;
    return Rotation({p.w() * q.w() - p.x() * q.x() - p.y() * q.y() - p.z() * q.z(),
                     p.w() * q.x() + p.x() * q.w() + p.y() * q.z() - p.z() * q.y(),
                     p.w() * q.y() - p.x() * q.z() + p.y() * q.w() + p.z() * q.x(),
                     p.w() * q.z() + p.x() * q.y() - p.y() * q.x() + p.z() * q.w()});
  }
  const Eigen::Quaternion<T>& quaternion() const { return q_; }

 private:
  Eigen::Quaternion<T> q_;
};

/// What names the space; there is nothing in it.
struct Rotations {};

}  // namespace foreign

/// Neither contains() nor origin(): both are optional. (The origin of this one is not used: no SDC about it.)
template <>
struct jml::SpaceTraits<foreign::Rotations> {
  static constexpr int numbers = 4, tangent = 3;
  template <typename T>
  static foreign::Rotation<T> rotation(const Vector<T, 4>& x) {
    return foreign::Rotation<T>(Eigen::Quaternion<T>(x(3), x(0), x(1), x(2)));
  }
  template <typename T>
  static Vector<T, 4> plus(const Vector<T, 4>& x, const Vector<T, 3>& delta) {
    return (rotation(x) * foreign::Rotation<T>::exp(delta)).quaternion().coeffs();
  }
  template <typename T>
  static Vector<T, 3> minus(const Vector<T, 4>& a, const Vector<T, 4>& b) {
    return (rotation(b).inverse() * rotation(a)).log();
  }
};

namespace models {

/// (w, x, y, z) of (x, y, z, w), and back.
template <typename T>
jml::Vector<T, 4> as_ours(const jml::Vector<T, 4>& x) {
  return {x(3), x(0), x(1), x(2)};
}
inline jml::Vector<double, 4> as_foreign(const jml::Vector<double, 4>& q) { return {q(1), q(2), q(3), q(0)}; }

}  // namespace models
