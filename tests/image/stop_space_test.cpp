// SPDX-License-Identifier: BSD-3-Clause
// Stopped anywhere: attitudes, whose belief has a point and a chart at every node of a window.
#include "flights.hpp"
#include "models/attitude_in_space.hpp"

namespace {

using namespace flights;

using Vector3 = Vector<double, 3>;
using models::VectorSensor;
const Vector<double, 4> attitude{0.5, 0.5, -0.5, 0.5};

/// Its disturbance is a random walk: Q dt.
struct Walking : models::TurningIn<jml::SO3> {
  Matrix<double, 3, 3> disturbance_covariance(const Vector<double, 4>&, const auto& at) const {
    return at.dt * Matrix<double, 3, 3>(Q);
  }
};
/// A direction with a noise that is not added: m(x, v), whose v a window goes to by itself.
struct NoisyDirection {
  static constexpr int measurements = 3, noises = 3;
  Vector3 direction{1, 0, 0};
  double sigma = 0.1;
  template <typename T>
  Vector<T, 3> measurement(const Vector<T, 4>& x, const Vector<T, 3>& v) const {
    const Vector<T, 3> seen = models::seen_from(x, direction);
    return {seen(0) * (1.0 + v(0)), seen(1) + v(1) + 0.1 * v(1) * v(1), seen(2) + v(2)};
  }
  Matrix<double, 3, 3> noise_covariance() const { return sigma * sigma * Matrix<double, 3, 3>::Identity(); }
};
jml::Estimate<double, 4, 3> attitude_start() {
  return {attitude, (Matrix<double, 3, 3>() << 0.04, 0.01, 0, 0.01, 0.09, 0.02, 0, 0.02, 0.16).finished()};
}
/// One verb; a vector for every instant, of which the sensor object knows.
template <typename S>
const auto turn = [](auto& filter, std::uint64_t seed, int k, Trace& trace) {
  Draw draw(seed, k);
  const double dt = draw.uniform(0.05, 0.2);
  const double angle = draw.uniform(0, 6);
  const S sensor{Vector3(std::sin(angle), std::cos(2 * angle), 0.3).normalized(), draw.uniform(0.05, 0.2)};
  Vector3 y =
      VectorSensor{sensor.direction}.measurement(jml::SO3::plus(attitude, Vector3(0.05 * k, 0.1, -0.02 * k)));
  for (int i = 0; i < 3; ++i) y(i) += draw.uniform(-0.1, 0.1);
  const Vector3 rate(0.3, draw.uniform(-1, 1), 0.5);
  const int verb = draw.below(8);
  if (verb < 4) {
    trace.see_report(filter.step(sensor, y, dt, rate));
  } else if (verb == 4) {
    trace.add(filter.predict(dt, rate));
  } else if (verb == 5) {
    trace.see_report(filter.update(sensor, y));
  } else if (verb == 6) {
    trace.see_report(filter.update(sensor, y, jml::at_time(filter.time() - draw.uniform(0, 0.3))));
  } else {
    trace.see_report(filter.update(sensor, y, jml::age(1)));
  }
};

TEST(StopAndGoOn, StatesInASpace) {
  stop_and_go_on(
      "EKF", [] { return jml::Filter{jml::Ekf{}, Walking{}, attitude_start()}; }, turn<VectorSensor>);
}

TEST(StopAndGoOn, AWindowOfStatesInASpace) {
  stop_and_go_on(
      "fixed lag",
      [] {
        return jml::Filter{jml::FixedLag<4, 3>{}, Walking{}, jml::sensors<VectorSensor>, attitude_start()};
      },
      turn<VectorSensor>, [](const auto& filter) { return filter.depth() == 4 ? 1 : 0; });
}

TEST(StopAndGoOn, AWindowThatRemembersWhereItsNoiseWas) {
  stop_and_go_on(
      "fixed lag, m(x, v)",
      [] {
        return jml::Filter{jml::FixedLag<3, 2>{}, Walking{}, jml::sensors<NoisyDirection>, attitude_start()};
      },
      turn<NoisyDirection>);
}

}  // namespace
