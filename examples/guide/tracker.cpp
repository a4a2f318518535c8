// SPDX-License-Identifier: BSD-3-Clause
// A tracker of six states and two sensors at different rates: time, parts of a measurement, a gate.
#include <cmath>
#include <cstdio>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <numbers>

// [model]
struct Target {  // x: position m and velocity m/s, each east, north, up
  static constexpr int states = 6, disturbances = 3;

  template <typename T>
  jml::Vector<T, 6> dynamics(const jml::Vector<T, 6>& x, const auto& at) const {
    jml::Vector<T, 6> next = x;
    for (int i = 0; i < 3; ++i) next(i) += at.dt * x(3 + i);
    return next;
  }
  jml::Matrix<double, 6, 3> disturbance_input(const auto&, const auto& at) const {  // an acceleration, held
    jml::Matrix<double, 6, 3> G = jml::Matrix<double, 6, 3>::Zero();
    for (int i = 0; i < 3; ++i) {
      G(i, i) = 0.5 * at.dt * at.dt;
      G(3 + i, i) = at.dt;
    }
    return G;
  }
  jml::Matrix<double, 3, 3> disturbance_covariance() const {
    return 4 * jml::Matrix<double, 3, 3>::Identity();
  }
};
// [/model]

// [radar]
struct Radar {  // y: range m, azimuth rad, elevation rad
  static constexpr int measurements = 3;

  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 6>& x) const {
    using std::atan2, std::sqrt;
    const T ground = sqrt(x(0) * x(0) + x(1) * x(1));
    return {sqrt(ground * ground + x(2) * x(2)), atan2(x(1), x(0)), atan2(x(2), ground)};
  }
  template <typename T>
  jml::Vector<T, 3> residual(const jml::Vector<T, 3>& y, const jml::Vector<T, 3>& predicted) const {
    using std::remainder;
    jml::Vector<T, 3> out = y - predicted;
    out(1) = remainder(out(1), T(2 * std::numbers::pi));  // the azimuth: the short way round
    return out;
  }
  jml::Matrix<double, 3, 3> noise_covariance() const {
    return jml::Vector<double, 3>(400, 1e-5, 1e-5).asDiagonal();
  }
};
// [/radar]

// [fix]
struct Transponder {  // y: position m
  static constexpr int measurements = 3;
  double sigma = 50;  // m

  template <typename T>
  jml::Vector<T, 3> measurement(const jml::Vector<T, 6>& x) const {
    return x.template head<3>();
  }
  jml::Matrix<double, 3, 3> noise_covariance() const {
    return sigma * sigma * jml::Matrix<double, 3, 3>::Identity();
  }
};
// [/fix]

int main() {
  // [filter]
  jml::Vector<double, 6> x0, variances;
  x0 << 20000, 5000, 3000, -200, 0, 0;
  variances << 1e6, 1e6, 1e6, 1e4, 1e4, 1e4;
  jml::Filter filter{jml::Ekf{}, Target{},
                     jml::Estimate{x0, jml::Matrix<double, 6, 6>(variances.asDiagonal())}};
  filter.gate = {0.9999};
  const Radar radar;
  const Transponder transponder{.sigma = 50};
  // [/filter]

  jml::Noise noise(1);
  jml::Vector<double, 6> truth = x0 + filter.P().cwiseSqrt() * noise.normal_vector<6>();
  bool sound = true;
  int rejected = 0;
  const jml::Matrix<double, 3, 3> R = radar.noise_covariance();
  const auto move = [&](double dt) {
    const jml::ContextOf<Target> at{.time = 0, .dt = dt};
    truth = Target{}.dynamics(truth, at) + Target{}.disturbance_input(0, at) * 2 * noise.normal_vector<3>();
  };
  for (int k = 1; k <= 60; ++k) {  // a turn of the radar each second
    move(1.0);
    jml::Vector<double, 3> y = radar.measurement(truth) + noise.normal_vector<3>(R);
    if (k == 30) y(0) += 3000;  // a wrong echo
    // [steps]
    const auto report = filter.step(radar, y, 1.0);  // predict over 1 s, and correct
    if (report.gate == jml::Verdict::rejected) ++rejected;
    // [/steps]
    sound &= jml::usable(report.status);
    if (k % 10 != 0) continue;

    move(0.4);
    const double t = filter.time() + 0.4;
    const jml::Vector<double, 3> fix = transponder.measurement(truth) + 50 * noise.normal_vector<3>();
    y = radar.measurement(truth);
    // [fixes]
    // Predict to t, in seconds on the filter's clock, and correct.
    const auto second = filter.step(transponder, fix, jml::at_time(t));
    // The radar has seen range and elevation at this time: no azimuth, and no time passes.
    const auto third = filter.update(radar, y, jml::only(0, 2));
    // [/fixes]
    sound &= jml::usable(second.status) && jml::usable(third.status);
  }
  // [parts]
  jml::Vector<double, 3> y = radar.measurement(truth);
  y(2) = std::nan("");  // this radar says NaN where it has not measured
  const auto finite = filter.update(radar, y, jml::finite_rows(y));
  const auto none = filter.update(radar, y);  // refused: nobody said that a NaN means anything
  // [/parts]
  std::printf("a NaN of which nobody speaks: %s\n", jml::describe(none.status));

  // [channel]
  jml::Channel channel{
      Radar{}, jml::Lockout<6>{.after = 20, .recovery = jml::Recovery::inflate, .variances = variances},
      jml::blocks(jml::only(0), jml::only(1, 2))};  // the range alone, the angles together
  channel.gate = {0.999};
  y = radar.measurement(truth);
  y(0) += 5000;                                   // a wrong range
  const auto judged = channel.update(filter, y);  // for filter.update(radar, y): the angles are used
  const jml::Status other = channel.retune(Radar{}, filter);  // other parameters of the sensor
  channel.use = jml::Use::inhibit;                            // from here on it is not listened to
  // [/channel]
  sound &= jml::usable(judged.status) && jml::usable(other) && channel.tally().partial == 1;

  const jml::Vector<double, 6> error = filter.x() - truth;
  std::printf("%.1f s: position off by %.0f m, speed by %.1f m/s; rejected %d\n", filter.time(),
              error.head<3>().norm(), error.tail<3>().norm(), rejected);
  for (int i = 0; i < 6; ++i) sound &= std::abs(error(i)) < 5 * std::sqrt(filter.P()(i, i));
  return sound && jml::usable(finite.status) && none.status == jml::Status::invalid_measurement &&
                 rejected == 1
             ? 0
             : 1;
}
