// SPDX-License-Identifier: BSD-3-Clause
// An unknown constant is a state without disturbance: g/l of a pendulum, found by a filter, by a fixed lag
// and from the whole flight.
#include <cmath>
#include <cstdio>
#include <jml/campaign/noise.hpp>
#include <jml/interval/batch.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <jml/jml.hpp>

// [model]
struct Pendulum {  // x: angle rad, rate rad/s, and g/l in 1/s², which stays what it is
  static constexpr int states = 3, disturbances = 1;
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x) const {
    using std::sin;
    const T rate = x(1) - 0.05 * (x(2) * sin(x(0)) + 0.1 * x(1));
    return {x(0) + 0.05 * rate, rate, x(2)};
  }
  jml::Matrix<double, 3, 1> disturbance_input() const { return {0, 0.05, 0}; }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.25); }
};
// [/model]

struct Sideways {  // y: horizontal place of the bob in rod lengths
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 3>& x) const {
    using std::sin;
    return jml::Vector<T, 1>(sin(x(0)));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.001); }
};

int main() {
  constexpr double truth = 6;
  jml::Vector<double, 3> x(1, 0, truth);
  const jml::Vector<double, 3> guess(0.5, 0, 10), variance(0.25, 0.25, 9);
  const jml::Estimate start{guess, jml::Matrix<double, 3, 3>(variance.asDiagonal())};
  jml::Filter ekf{jml::Ekf{}, Pendulum{}, start};
  jml::Filter lag{jml::FixedLag<20>{}, Pendulum{}, jml::sensors<Sideways>, start};
  jml::Batch flight{Pendulum{}, jml::sensors<Sideways>, start, {200}};

  jml::Noise noise(1);
  bool sound = true;
  for (int k = 1; k <= 200; ++k) {
    x = Pendulum{}.dynamics(x) + Pendulum{}.disturbance_input() * 0.5 * noise.normal();
    const double y = std::sin(x(0)) + std::sqrt(0.001) * noise.normal();
    sound &= jml::usable(ekf.step(Sideways{}, y).status) && jml::usable(lag.step(Sideways{}, y).status) &&
             flight.step(Sideways{}, y) == jml::Status::ok;
    if (k % 40 == 0) {
      std::printf("after %2.0f s: EKF %.3f ± %.3f, fixed lag %.3f ± %.3f\n", 0.05 * k, ekf.x()(2),
                  std::sqrt(ekf.P()(2, 2)), lag.x()(2), std::sqrt(lag.P()(2, 2)));
    }
  }
  sound &= jml::usable(flight.solve().status);
  const double found = flight.x(0)(2), deviation = std::sqrt(flight.P(0)(2, 2));
  std::printf("whole flight: %.3f ± %.3f at every instant; truth %.3f\n", found, deviation, truth);

  sound &= std::abs(found - truth) < 3 * deviation && std::abs(flight.x(200)(2) - found) < 1e-9;
  return sound && std::abs(lag.x()(2) - found) < std::abs(ekf.x()(2) - found) ? 0 : 1;
}
