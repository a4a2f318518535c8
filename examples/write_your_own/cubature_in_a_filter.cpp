// SPDX-License-Identifier: BSD-3-Clause
// A method of one's own in jml::Filter: a radar with a fine range and a coarse bearing, which the EKF
// believes too much.
#include <cmath>
#include <cstdio>
#include <jml/analysis/nees.hpp>
#include <jml/campaign/noise.hpp>

#include "cubature.hpp"

struct Boat {  // x: east m, north m, and the speeds of both, m/s; one step of 1 s
  static constexpr int states = 4, disturbances = 2;
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x) const {
    return {x(0) + x(2), x(1) + x(3), x(2), x(3)};
  }
  jml::Matrix<double, 4, 2> disturbance_input() const {
    jml::Matrix<double, 4, 2> G;
    G << 0.5, 0, 0, 0.5, 1, 0, 0, 1;
    return G;
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    return 0.01 * jml::Matrix<double, 2, 2>::Identity();
  }
};

struct Radar {  // y: range m, bearing rad
  static constexpr int measurements = 2;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 4>& x) const {
    using std::atan2, std::sqrt;
    return {sqrt(x(0) * x(0) + x(1) * x(1)), atan2(x(1), x(0))};
  }
  template <typename T>
  jml::Vector<T, 2> residual(const jml::Vector<T, 2>& y, const jml::Vector<T, 2>& predicted) const {
    return {y(0) - predicted(0), std::remainder(y(1) - predicted(1), T(6.283185307179586))};
  }
  jml::Matrix<double, 2, 2> noise_covariance() const { return jml::Vector<double, 2>(1, 0.09).asDiagonal(); }
};

/// What 200 voyages of 40 s make of a method.
struct Errors {
  double position = 0, nees = 0;  // RMS in m; mean, 4 where P is right
  bool sound = true;
};
template <typename Method>
Errors sail(const Method& method) {
  Errors out;
  const jml::Vector<double, 4> x0(60, 40, -1, 1.5), variance(400, 400, 4, 4);
  const jml::Matrix<double, 4, 4> P0 = variance.asDiagonal();
  constexpr int voyages = 200, steps = 40;
  for (int voyage = 0; voyage < voyages; ++voyage) {
    jml::Noise noise(static_cast<unsigned>(voyage));
    jml::Vector<double, 4> x = x0 + noise.normal_vector<4>(P0);
    jml::Filter filter{method, Boat{}, jml::Estimate{x0, P0}};
    for (int k = 0; k < steps; ++k) {
      const jml::Vector<double, 2> w = 0.1 * noise.normal_vector<2>();
      x = Boat{}.dynamics(x) + Boat{}.disturbance_input() * w;
      const jml::Vector<double, 2> v = noise.normal_vector<2>(Radar{}.noise_covariance());
      out.sound &= jml::usable(filter.step(Radar{}, Radar{}.measurement(x) + v).status);
      const jml::Vector<double, 4> error = filter.x() - x;
      out.position += (error(0) * error(0) + error(1) * error(1)) / (voyages * steps);
      out.nees += jml::nees(error, filter.P()) / (voyages * steps);
    }
  }
  out.position = std::sqrt(out.position);
  return out;
}

int main() {
  const Errors ekf = sail(jml::Ekf{}), cubature = sail(own::Cubature{});
  std::printf("EKF:      position %.2f m RMS, NEES %.1f where 4 is right\n", ekf.position, ekf.nees);
  std::printf("cubature: position %.2f m RMS, NEES %.1f\n", cubature.position, cubature.nees);

  // Filter refuses for every method, and keeps what it had.
  const jml::Estimate start{jml::Vector<double, 4>(60, 40, 0, 0), jml::Matrix<double, 4, 4>::Identity()};
  jml::Filter filter{own::Cubature{}, Boat{}, start};
  const auto report = filter.step(Radar{}, jml::Vector<double, 2>(std::nan(""), 0.6));
  std::printf("a NaN: %s\n", jml::describe(report.status));

  const bool refused = report.status == jml::Status::invalid_measurement && filter.x() == start.x;
  return ekf.sound && cubature.sound && refused && cubature.position < ekf.position &&
                 cubature.nees < ekf.nees
             ? 0
             : 1;
}
