// SPDX-License-Identifier: BSD-3-Clause
// Bounds where a filter needs them: the gas reaction 2A -> B seen by its total pressure (Haseltine and
// Rawlings 2005, section 2.1), from a poor guess. An EKF ends at a negative pressure that fits the
// measurements as well.
#include <cmath>
#include <cstdio>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>

struct Reactor {  // x: partial pressures of A and B, atm
  static constexpr int states = 2, disturbances = 2;
  double rate = 0.16, dt = 0.1;  // 1/(min atm), min
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    const T left = 1.0 + 2 * rate * dt * x(0);
    return {x(0) / left, x(1) + rate * dt * x(0) * x(0) / left};
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    return 1e-6 * jml::Matrix<double, 2, 2>::Identity();
  }
};

struct Gauge {  // y: total pressure, atm
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0) + x(1));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.01); }
};

int main() {
  const jml::Estimate start{jml::Vector<double, 2>(0.1, 4.5),
                            jml::Matrix<double, 2, 2>(36 * jml::Matrix<double, 2, 2>::Identity())};
  // [bounds]
  jml::Bounds<2> positive;
  positive.lower << 0, 0;
  // [/bounds]
  jml::Filter ekf{jml::Ekf{}, Reactor{}, start};
  jml::Filter free{jml::FixedLag<10>{}, Reactor{}, jml::sensors<Gauge>, start};
  // [lag]
  jml::Filter lag{jml::Bounded{jml::FixedLag<10>{}, positive}, Reactor{}, jml::sensors<Gauge>, start};
  // [/lag]

  jml::Noise noise(1);
  jml::Vector<double, 2> x(3, 1);
  bool sound = true;
  for (int k = 1; k <= 100; ++k) {
    x = Reactor{}.dynamics(x) + 1e-3 * noise.normal_vector<2>();
    const double y = x(0) + x(1) + 0.1 * noise.normal();
    (void)ekf.step(Gauge{}, y);
    (void)free.step(Gauge{}, y);
    sound &= jml::usable(lag.step(Gauge{}, y).status) && lag.x()(0) >= 0 && lag.x()(1) >= 0;
    if (k == 2 || k % 25 == 0)
      std::printf("%4.1f min: A %.2f; EKF %.2f, fixed lag %.2f, within bounds %.2f\n", 0.1 * k, x(0),
                  ekf.x()(0), free.x()(0), lag.x()(0));
  }
  return sound && std::abs(lag.x()(0) - x(0)) < 0.1 && std::abs(ekf.x()(0) - x(0)) > 0.5 ? 0 : 1;
}
