// SPDX-License-Identifier: BSD-3-Clause
// The guaranteed box with sensors that bend, wrap, end or saturate: what explains the measurement stays.
#include <gtest/gtest.h>

#include "particles.hpp"

namespace {

using jml::Box, jml::Filter, jml::Guaranteed, jml::Status;
using particles::explains, particles::inside, particles::never_outside;
using Vector1 = jml::Vector<double, 1>;
using Vector4 = jml::Vector<double, 4>;
constexpr double inf = std::numeric_limits<double>::infinity(), pi = 3.141592653589793;

TEST(GuaranteedSensors, Range) {
  const models::BoundedVehicle vehicle;
  const Box<double, 4> all{Vector4(-5, -5, -2, -2), Vector4(5, 5, 2, 2)};
  never_outside(Guaranteed{}, vehicle, models::BoundedRange{-20, 3}, all, Vector4(2, 2, 1, 1), 30, 10, 1);
  // The station is inside of many of these boxes: the range has a kink there.
  never_outside(Guaranteed{}, vehicle, models::BoundedRange{0, 0, 0.5}, all, Vector4(4, 4, 1, 1), 30, 10, 2);
}

// The vehicle is west of the station: the bearing jumps from π to -π, often between two steps.
TEST(GuaranteedSensors, BearingAcrossTheCut) {
  const models::BoundedVehicle vehicle;
  const models::BoundedBearing sensor;
  const Box<double, 4> west{Vector4(-20, -1, -1, -3), Vector4(-5, 1, 1, 3)};
  never_outside(Guaranteed{}, vehicle, sensor, west, Vector4(3, 2, 1, 1), 30, 10, 3);
  // Boxes about the station: any bearing, of any turn.
  const Box<double, 4> about{Vector4(-2, -2, -1, -1), Vector4(2, 2, 1, 1)};
  never_outside(Guaranteed{}, vehicle, sensor, about, Vector4(3, 3, 1, 1), 30, 10, 4);
}

// The centre of the box is above the cut, y below it: 2π between them, but the same direction.
TEST(GuaranteedSensors, MeasurementOnTheOtherSideOfTheCut) {
  const models::BoundedBearing sensor{.bound = 0.01};
  const Box<double, 4> box{Vector4(-10.01, -1, 0, 0), Vector4(-9.99, 1.5, 0, 0)};
  for (const double y : {-pi + 0.05, pi - 0.05, pi, -pi}) {
    Filter filter{Guaranteed{}, models::BoundedVehicle{}, box};
    const auto report = filter.update(sensor, y);
    ASSERT_EQ(report.status, Status::ok) << y;
    // north = -10 tan(y ± 0.01), and the innovation from the centre, north 0.25.
    const double off = std::remainder(y - pi, 2 * pi);
    EXPECT_NEAR(report.innovation(0), off + std::atan(0.025), 1e-14);
    EXPECT_TRUE(inside(filter.box(), Vector4(-10, -10 * std::tan(off), 0, 0)));
    EXPECT_NEAR(filter.box().lower(1), -10 * std::tan(off + 0.01), 0.02);
    EXPECT_NEAR(filter.box().upper(1), -10 * std::tan(off - 0.01), 0.02);
  }
  // And what is outside is found: 0.3 rad below the cut, where the box ends at 0.1.
  Filter filter{Guaranteed{}, models::BoundedVehicle{}, box};
  const auto report = filter.update(sensor, -pi + 0.3);
  EXPECT_EQ(report.status, Status::accepted_without_measurement);
  EXPECT_EQ(report.violation.row, 0);
  EXPECT_GT(report.violation.excess, 0.1);
  EXPECT_LT(report.violation.excess, 0.29 - std::atan(1 / 10.01) + 1e-9);
}

// Single measurements of boxes of all sizes about the station, so that most of them wrap.
template <typename S>
void nothing_is_lost(const S& sensor, double largest, std::uint64_t seed) {
  SCOPED_TRACE(seed);
  jml::Noise noise(seed);
  int outside = 0, cut = 0;
  long checked = 0;
  for (int run = 0; run < 2000; ++run) {
    const double size = largest * std::pow(10.0, noise.uniform(-3, 0));
    Box<double, 4> box;
    for (int i = 0; i < 4; ++i) {
      const double middle = size * noise.uniform(-1.5, 1.5);
      box.lower(i) = middle - size * noise.uniform();
      box.upper(i) = middle + size * noise.uniform();
    }
    const Vector4 truth = models::point_of(box, noise, run % 3 == 0);
    const Vector1 y = sensor.measurement(truth) + 0.999999 * models::within(sensor.noise_bound(), noise);
    Filter filter{Guaranteed<0>{}, models::BoundedVehicle{}, box};
    ASSERT_EQ(filter.update(sensor, y).status, Status::ok) << run;
    cut += filter.box().width().sum() < 0.95 * box.width().sum();
    for (int k = 0; k < 300; ++k) {
      const Vector4 x = k == 0 ? truth : models::point_of(box, noise, k % 8 == 1);
      if (!explains(sensor, x, y)) continue;
      ++checked;
      outside += !inside(filter.box(), x);
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_GT(checked, 2000);
  EXPECT_GT(cut, 100);
}
TEST(GuaranteedSensors, NothingIsLostByABearing) {
  nothing_is_lost(models::BoundedBearing{}, 10, 5);
  nothing_is_lost(models::BoundedBearing{.bound = 1.5}, 10, 6);
}
TEST(GuaranteedSensors, NothingIsLostByARange) { nothing_is_lost(models::BoundedRange{}, 10, 7); }

/// y = √east + v: nothing is known beyond the end of its domain.
struct Root {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 4>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(sqrt(x(0)));
  }
  Vector1 noise_bound() const { return Vector1(0.1); }
};
/// y = east³.
struct Cube {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 4>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0) * x(0));
  }
  Vector1 noise_bound() const { return Vector1(1.0); }
};

/// y = east + 5 tanh(east): beyond ±5 a straight line, but not through zero.
struct Bend {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 4>& x) const {
    using std::tanh;
    return jml::Vector<T, 1>(x(0) + 5.0 * tanh(x(0)));
  }
  Vector1 noise_bound() const { return Vector1(0.1); }
};

// A prior with one bound alone, far from zero, and a sensor that bends: what explains y stays.
template <typename S>
void half_infinite(const S& sensor, bool above) {
  const double near = above ? 5 : -5;
  Box<double, 4> prior{Vector4(-9, -9, -9, -9), Vector4(9, 9, 9, 9)};
  prior.lower(0) = above ? near : -inf;
  prior.upper(0) = above ? inf : near;
  for (const double east : {5.0, 5.5, 9.0, 100.0}) {
    const Vector4 truth(above ? east : -east, 1, 2, 3);
    Filter filter{Guaranteed{}, models::BoundedVehicle{}, prior};
    const auto report = filter.update(sensor, Vector1(sensor.measurement(truth)));
    EXPECT_EQ(report.status, Status::ok) << east;
    EXPECT_EQ(report.violation.row, -1) << east;
    EXPECT_TRUE(filter.box().contains(truth)) << east << ": " << filter.box().lower(0);
  }
}
TEST(GuaranteedSensors, HalfInfinitePrior) {
  half_infinite(Root{}, true);
  half_infinite(Cube{}, true);
  half_infinite(Cube{}, false);
  half_infinite(Bend{}, true);
  half_infinite(Bend{}, false);
  half_infinite(models::BoundedRange{}, true);
  half_infinite(models::BoundedRange{}, false);
  half_infinite(models::BoundedBearing{}, false);
}

// No prior box at all: a sensor that bends may say nothing, and never anything wrong.
TEST(GuaranteedSensors, NoPrior) {
  const Vector4 truth(-7, 0.5, 1, 1);
  const auto check = [&](const auto& sensor) {
    Filter filter{Guaranteed{}, models::BoundedVehicle{}};
    const auto report = filter.update(sensor, Vector1(sensor.measurement(truth)));
    EXPECT_TRUE(report.status == Status::ok || report.status == Status::sensor_not_finite);
    EXPECT_TRUE(filter.box().contains(truth));
  };
  check(Cube{});
  check(models::BoundedRange{});
  check(models::BoundedBearing{});
}

/// y = east, with the chord in place of the difference: near zero almost right.
struct Chord {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 4>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  Vector1 residual(const Vector1& y, const Vector1& predicted) const {
    return Vector1(2 * std::sin((y(0) - predicted(0)) / 2));
  }
  Vector1 noise_bound() const { return Vector1(1e-6); }
};
TEST(GuaranteedSensors, ResidualThatIsNoDifferenceCutsNothingWrong) {
  const Vector4 truth(0.13, 0, 0, 0), reach(0.14, 1, 1, 1);
  Filter filter{Guaranteed{}, models::BoundedVehicle{}, Box<double, 4>{-reach, reach}};
  EXPECT_EQ(filter.update(Chord{}, 0.13).status, Status::ok);
  EXPECT_TRUE(filter.box().contains(truth));
}

/// x⁺ = x + gain w, w within a bound that float cannot hold.
struct Float {
  static constexpr int states = 1, disturbances = 1;
  float gain;
  double bound;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<float, 1, 1> disturbance_input() const { return jml::Matrix<float, 1, 1>(gain); }
  Vector1 disturbance_bound() const { return Vector1(bound); }
};
TEST(GuaranteedSensors, BoundStatedInDoubleHoldsInFloat) {
  jml::Noise noise(31);
  const jml::Vector<float, 1> zero(0.0F);
  for (int run = 0; run < 10'000; ++run) {
    const auto gain = static_cast<float>(noise.uniform(0.1, 1));
    const double bound = noise.uniform(0.1, 1);
    Filter filter{Guaranteed{}, Float{gain, bound}, Box<float, 1>{zero, zero}};
    ASSERT_EQ(filter.predict(), Status::ok);
    ASSERT_GE(double{filter.box().upper(0)}, double{gain} * bound) << run;
    ASSERT_LE(double{filter.box().lower(0)}, -double{gain} * bound) << run;
  }
}

}  // namespace
