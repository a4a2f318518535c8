// SPDX-License-Identifier: BSD-3-Clause
// The systems of the bounded-noise dissertation, chapter IV, and its Tables 2 to 5 as printed.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <jml/linear_algebra.hpp>

namespace demo::dissertation {

/// The bound of a uniform density about zero.
inline double bound_of(double variance) { return std::sqrt(3 * variance); }

/// Eq. (4.1), x⁺ = a x + b u. With a = 1, b = 0 the constant of the second part of example 1.
struct FirstOrder {
  static constexpr int states = 1, disturbances = 1;
  static constexpr bool linear = true;
  double a = 1, b = 0;
  double variance = 0, bound = 0;  ///< of u

  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return a * x;
  }
  [[nodiscard]] jml::Matrix<double, 1, 1> dynamics_jacobian(const jml::Vector<double, 1>&) const {
    return jml::Matrix<double, 1, 1>(a);
  }
  [[nodiscard]] jml::Matrix<double, 1, 1> disturbance_input() const { return jml::Matrix<double, 1, 1>(b); }
  [[nodiscard]] jml::Matrix<double, 1, 1> disturbance_covariance() const {
    return jml::Matrix<double, 1, 1>(variance);
  }
  [[nodiscard]] jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(bound); }
};

/// Eqs. (4.7)-(4.11), position and velocity every 0.1 s of x'' + x' + 0.24 x = u, u held. The scan lost the
/// minus of the second row: with a plus the poles would not be those of a stable oscillator, nor Table 5 what
/// it is.
struct SecondOrder {
  static constexpr int states = 2, disturbances = 1;
  static constexpr bool linear = true;
  double variance = 0, bound = 0;  ///< of u

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return {.99884 * x(0) + .09512 * x(1), -.02283 * x(0) + .90371 * x(1)};
  }
  [[nodiscard]] jml::Matrix<double, 2, 2> dynamics_jacobian(const jml::Vector<double, 2>&) const {
    return jml::Matrix<double, 2, 2>{{.99884, .09512}, {-.02283, .90371}};
  }
  [[nodiscard]] jml::Matrix<double, 2, 1> disturbance_input() const { return {.00484, .09512}; }
  [[nodiscard]] jml::Matrix<double, 1, 1> disturbance_covariance() const {
    return jml::Matrix<double, 1, 1>(variance);
  }
  [[nodiscard]] jml::Vector<double, 1> disturbance_bound() const { return jml::Vector<double, 1>(bound); }
};

/// Eqs. (4.2), (4.8): the first state with uniform noise of variance r.
template <int n>
struct FirstState {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  double r, bound = bound_of(r);

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, n>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  [[nodiscard]] jml::Matrix<double, 1, n> measurement_jacobian(const jml::Vector<double, n>&) const {
    jml::Matrix<double, 1, n> M = jml::Matrix<double, 1, n>::Zero();
    M(0) = 1;
    return M;
  }
  [[nodiscard]] jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(r); }
  [[nodiscard]] jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(bound); }
};

inline constexpr std::size_t rows = 25;

/// A column pair of a printed table: mean squared errors of the Kalman filter.
struct Printed {
  std::array<double, rows> optimum, actual;  ///< by hand from the Riccati equation; mean of the 100 runs
};

// Tables 2 to 4: samples 1 to 25 of a constant. Table 5: 0 to 2.4 s of example 2. The scan writes some 4 as
// A, nothing is unreadable. In Tables 2 to 4 the 100 runs are the same draws, scaled: from any two entries of
// a row follows the third, and does to the last digit in 23 of 24 rows. In row 6 it does with .0536 in Table
// 3: the .0556 there is one wrong digit (or the optimum beside it, written twice).
inline constexpr Printed table2{
    {1.3333, .2667, .1481, .1026, .0784, .0635, .0533, .0460, .0404, .0360, .0325, .0296, .0272,
     .0252,  .0234, .0219, .0205, .0193, .0183, .0173, .0165, .0157, .0150, .0143, .0137},
    {1.3633, .2743, .1524, .0904, .0682, .0620, .0553, .0503, .0475, .0401, .0397, .0329, .0330,
     .0297,  .0288, .0269, .0246, .0239, .0219, .0205, .0185, .0171, .0165, .0154, .0147}};
inline constexpr Printed table3{
    {.3333, .1667, .1111, .0833, .0667, .0556, .0476, .0417, .0370, .0333, .0303, .0278, .0256,
     .0238, .0222, .0208, .0196, .0185, .0175, .0167, .0159, .0152, .0145, .0139, .0133},
    {.3408, .1804, .1171, .0719, .0576, .0556, .0492, .0451, .0429, .0367, .0365, .0308, .0309,
     .0281, .0273, .0255, .0234, .0229, .0211, .0198, .0180, .0169, .0162, .0152, .0144}};
inline constexpr Printed table4{
    {.3333, .2667, .2222, .1905, .1667, .1481, .1333, .1212, .1111, .1026, .0952, .0889, .0833,
     .0784, .0741, .0702, .0667, .0635, .0606, .0580, .0556, .0533, .0513, .0494, .0476},
    {.3408, .2910, .2367, .1674, .1482, .1423, .1372, .1285, .1241, .1103, .1107, .0972, .0979,
     .0913, .0893, .0838, .0783, .0779, .0725, .0693, .0641, .0614, .0589, .0553, .0525}};
inline constexpr Printed table5_position{
    {.6950, .2253, .1348, .0972, .0776, .0662, .0594, .0554, .0531, .0519, .0512, .0510, .0509,
     .0509, .0509, .0509, .0508, .0507, .0506, .0505, .0504, .0503, .0502, .0501, .0500},
    {.6950, .2398, .1437, .1120, .0956, .0900, .0876, .0776, .0672, .0626, .0668, .0669, .0639,
     .0608, .0591, .0562, .0443, .0408, .0445, .0414, .0374, .0394, .0362, .0395, .0373}};
inline constexpr Printed table5_velocity{
    {.1667, .1666, .1662, .1649, .1629, .1601, .1567, .1528, .1487, .1447, .1409, .1375, .1345,
     .1320, .1300, .1284, .1271, .1262, .1256, .1251, .1248, .1246, .1245, .1245, .1244},
    {.1667, .1543, .1495, .1406, .1222, .1306, .1201, .1318, .1265, .1530, .1479, .1261, .1368,
     .1287, .1614, .1466, .1212, .1194, .1181, .1104, .0992, .1140, .1360, .1082, .1193}};

}  // namespace demo::dissertation
