// SPDX-License-Identifier: BSD-3-Clause
// Two sensors at their own rates, a step length that changes, and gaps, on a linear system.
#include "riccati/linear_run.hpp"

namespace {

using oracle::big;
using oracle::Big;

// Two sensors at their own rates, a step length that changes, gaps: 1000 events on a constant-velocity
// target.
struct Schedule {
  struct Event {
    double dt;
    int sensor;  // 0: none, 1: position, 2: speed, 3: both
  };
  std::vector<Event> events;
  std::vector<jml::Vector<double, 2>> positions;
  std::vector<double> speeds;
  std::vector<linear_run::Reference> wanted;
  models::ConstantVelocity dynamics;
  models::LinearSensor<4, 2> position;
  models::LinearSensor<4, 1> speed;
  jml::Estimate<double, 4> start;

  Schedule() {
    position.M << 1, 0, 0.2, 0, 0, 0.1, 1, 0;
    position.R << 2, 0.5, 0.5, 1;
    speed.M << 0, 1, 0, -1;
    speed.R << 0.1;
    start = {jml::Vector<double, 4>(1, 2, -3, 1), 10 * jml::Matrix<double, 4, 4>::Identity()};
    jml::Noise noise(54);
    linear_run::Reference reference{big(start.x), big(start.P)};
    for (int i = 0; i < linear_run::steps; ++i) {
      const double dt = i % 11 == 0 ? 0.0 : noise.uniform(0.01, 0.5);
      const int which = (i % 3 == 0 ? 1 : 0) + (i % 5 == 0 ? 2 : 0);
      events.push_back({dt, which});
      positions.push_back(5 * noise.normal_vector<2>());
      speeds.push_back(noise.normal());
      Big F = Big::Identity(4, 4), Q = Big::Zero(4, 4);
      const long double h = dt, density = dynamics.q_c;
      for (int a = 0; a < 4; a += 2) {
        F(a, a + 1) = h;
        Q(a, a) = density * h * h * h / 3;
        Q(a, a + 1) = Q(a + 1, a) = density * h * h / 2;
        Q(a + 1, a + 1) = density * h;
      }
      reference.predict(F, Q);
      if (which & 1) reference.update(big(position.M), big(position.R), big(positions.back()));
      if (which & 2) reference.update(big(speed.M), big(speed.R), Big::Constant(1, 1, speeds.back()));
      wanted.push_back(reference);
    }
  }

  template <typename Rule>
  void expect_kalman(const Rule& rule, const char* name) const {
    SCOPED_TRACE(name);
    jml::Filter filter{rule, dynamics, start};
    double worst = 0;
    long double time = 0;  // what was asked, summed without the rounding of a double
    for (std::size_t i = 0; i < linear_run::steps; ++i) {
      const auto [dt, which] = events[i];
      const jml::Status first = which == 0   ? filter.predict(dt)
                                : which == 2 ? filter.step(speed, speeds[i], dt).status
                                             : filter.step(position, positions[i], dt).status;
      ASSERT_TRUE(jml::usable(first)) << jml::describe(first) << " at " << i;
      if (which == 3) {
        ASSERT_TRUE(jml::usable(filter.update(speed, speeds[i]).status));
      }
      time += dt;
      EXPECT_DOUBLE_EQ(filter.time(), static_cast<double>(time));
      worst = std::max(
          {worst, oracle::distance(filter.x(), wanted[i].x), oracle::distance(filter.P(), wanted[i].P)});
    }
    EXPECT_LT(worst, linear_run::tolerance);
  }
};

TEST(LinearEquivalence, TwoSensorsVaryingStepsAndGaps) {
  const Schedule schedule;
  schedule.expect_kalman(jml::Kalman{}, "Kalman");
  schedule.expect_kalman(jml::Jml{}, "JML");
  schedule.expect_kalman(jml::Iekf{}, "IEKF");
  schedule.expect_kalman(jml::IteratedJml{}, "iterated JML");
}

}  // namespace
