// SPDX-License-Identifier: BSD-3-Clause
// One small tracker, as its users of FilterPy, gtsam, Ceres and mherb/kalman would write it here; the numbers
// are those that these libraries print (examples/guide/coming_from/).
#include <cmath>
#include <cstdio>
#include <jml/jml.hpp>

namespace {

// [model]
struct Target {  // x: position m and velocity m/s, east and north
  static constexpr int states = 4, disturbances = 4;

  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x, const auto& at) const {
    return {x(0) + at.dt * x(2), x(1) + at.dt * x(3), x(2), x(3)};
  }
  jml::Matrix<double, 4, 4> disturbance_covariance(const auto&, const auto& at) const {  // Q of the step
    const double q = 0.16, dt = at.dt;  // m²/s³, spectral density of the acceleration
    const auto one = jml::Matrix<double, 2, 2>::Identity();
    jml::Matrix<double, 4, 4> Q;
    Q << q * dt * dt * dt / 3 * one, q * dt * dt / 2 * one, q * dt * dt / 2 * one, q * dt * one;
    return Q;
  }
};

struct Radar {  // y: range m, bearing rad
  static constexpr int measurements = 2;

  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 4>& x) const {
    using std::atan2, std::sqrt;
    return {sqrt(x(0) * x(0) + x(1) * x(1)), atan2(x(1), x(0))};
  }
  jml::Matrix<double, 2, 2> noise_covariance() const { return jml::Vector<double, 2>(4, 1e-4).asDiagonal(); }
};
// [/model]

const double ys[8][2] = {{107.64, 0.5243}, {103.65, 0.5701}, {102.81, 0.6276}, {100.98, 0.6927},
                         {98.04, 0.7793},  {98.27, 0.8544},  {94.97, 0.9369},  {96.2, 1.0203}};
using Y = Eigen::Map<const Eigen::Vector2d>;
constexpr double dt = 1;  // s

const jml::Vector<double, 4> x0(100, 50, -6, 4);
const jml::Matrix<double, 4, 4> P0 = jml::Vector<double, 4>(25, 25, 4, 4).asDiagonal();

// What other libraries print for these numbers.
const jml::Vector<double, 4> filterpy_x(50.423700037738, 81.668818105029, -6.612902889118,
                                        4.341613714581);  // FilterPy 2.0.0
const jml::Vector<double, 4> filterpy_P(0.985290888049, 1.478658919652, 0.336791551864, 0.385639902002);
const jml::Vector<double, 4> gtsam_x(50.418897681432, 81.653647617811, -6.614469779692,
                                     4.338931388637);  // gtsam 4.3.0
const jml::Vector<double, 4> gtsam_start(99.904136380058, 49.474143326320, -5.797907277194, 3.682902753942);
const jml::Vector<double, 4> gtsam_P(2.529754053670, 1.811772003040, 0.460416723960, 0.427262566050);
constexpr double gtsam_cost = 2.890137594137;

bool all_good = true;

void expect(const char* what, double off, double within) {
  const bool good = off <= within;  // a NaN is not
  std::printf("%-58s %.1e%s\n", what, off, good ? "" : "  TOO FAR");
  all_good = all_good && good;
}

}  // namespace

int main() {
  // [filter]
  jml::Filter ekf{jml::Ekf{}, Target{}, jml::Estimate{x0, P0}};
  for (const auto& y : ys) {
    const auto report = ekf.step(Radar{}, Y(y), dt);
    if (!jml::usable(report.status)) std::puts(jml::describe(report.status));  // x, P and time are as before
  }
  // [/filter]
  expect("EKF, x: FilterPy's", (ekf.x() - filterpy_x).cwiseAbs().maxCoeff(), 1e-10);
  expect("EKF, P_ii: FilterPy's", (ekf.P().diagonal() - filterpy_P).cwiseAbs().maxCoeff(), 1e-10);

  // [batch]
  jml::Batch batch{Target{}, jml::sensors<Radar>, jml::Estimate{x0, P0}, {.steps = 8}};
  for (const auto& y : ys) (void)batch.step(Radar{}, Y(y), dt);
  const auto answer = batch.solve();  // batch.x(k), batch.P(k), answer.cost, answer.status
  // [/batch]
  expect("whole flight, x_8: gtsam's", (batch.x(8) - gtsam_x).cwiseAbs().maxCoeff(), 1e-6);
  expect("whole flight, x_0: gtsam's", (batch.x(0) - gtsam_start).cwiseAbs().maxCoeff(), 1e-6);
  expect("whole flight, P_0: gtsam's", (batch.P(0).diagonal() - gtsam_P).cwiseAbs().maxCoeff(), 1e-6);
  expect("whole flight, J: gtsam's", std::abs(answer.cost - gtsam_cost), 1e-9);

  // [late]
  jml::Filter smoother{jml::FixedLag<10>{}, Target{}, jml::sensors<Radar>, jml::Estimate{x0, P0}};
  for (int k = 1; k <= 8; ++k) {
    if (k == 5)
      (void)smoother.predict(dt);  // its measurement is still on its way
    else
      (void)smoother.step(Radar{}, Y(ys[k - 1]), dt);
  }
  const auto late = smoother.update(Radar{}, Y(ys[4]), jml::at_time(5 * dt));  // or jml::age(3)
  // [/late]
  expect("fixed lag with y_5 late, x_8: gtsam's", (smoother.x() - gtsam_x).cwiseAbs().maxCoeff(), 1e-6);
  expect("fixed lag with y_5 late, x_0: gtsam's", (smoother.x(8) - gtsam_start).cwiseAbs().maxCoeff(), 1e-6);
  all_good = all_good && jml::usable(late.status);

  // [more]
  jml::Filter filter{jml::Ekf{}, Target{}, jml::Estimate{x0, P0}};
  filter.gate = {0.999};                                                 // by χ²; off by default
  (void)filter.predict(0.4);                                             // any dt, s
  auto report = filter.update(Radar{}, Y(ys[0]), jml::only(0));          // the range alone
  report = filter.step(Radar{}, jml::Vector<double, 2>(NAN, 0.5), 0.6);  // refused: nothing has changed
  const bool refused = report.status == jml::Status::invalid_measurement && filter.time() == 0.4;
  // [/more]
  expect("a NaN: refused, time as before", refused ? 0 : 1, 0);

  return all_good && answer.status == jml::Status::ok ? 0 : 1;
}
