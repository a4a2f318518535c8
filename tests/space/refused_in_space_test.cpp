// SPDX-License-Identifier: BSD-3-Clause
// A correction that a fixed lag in a space refuses, by whatever part of its work, leaves everything that a
// later step reads as it was, bit by bit: also the disturbances, noises and covariances about which its
// models were linearised, which the minimisation had moved by then. And a part of a sensor with noise inside
// is that sensor.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstring>
#include <jml/jml.hpp>
#include <vector>

namespace {

using jml::Status, jml::usable;
using Vector1 = jml::Vector<double, 1>;
using Vector2 = jml::Vector<double, 2>;
using Matrix1 = jml::Matrix<double, 1, 1>;
using Matrix2 = jml::Matrix<double, 2, 2>;
constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();

/// Heading and speed of a vehicle. Where the control says so, Q is none beyond that speed.
struct Vehicle {
  using Space = jml::Product<jml::SO2, jml::Euclidean<1>>;
  static constexpr int disturbances = 2, controls = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const jml::Vector<T, 2>& w, const auto& at) const {
    using std::exp;
    return {jml::SO2::plus(jml::Vector<T, 1>(x(0)), jml::Vector<T, 1>((w(0) * x(1) + 0.3) * at.dt))(0),
            x(1) * exp(w(1) * at.dt)};
  }
  Matrix2 disturbance_covariance(const Vector2& x, const auto& at) const {
    const double size = at.control(0) > 0 && x(1) > at.control(0) ? -1 : 0.1 * (1 + 0.1 * x(1) * x(1));
    return (Matrix2() << size, 0.02, 0.02, 0.2).finished() / at.dt;
  }
};

/// Its velocity, with noise of scale and of direction. Beyond a speed of `ends` m is no number; beyond
/// `slope_ends` its derivative is none; beyond `R_ends` R is no covariance.
struct Velocity {
  static constexpr int measurements = 2;
  double r = 0.01, ends = inf, slope_ends = inf, R_ends = inf;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x, const jml::Vector<T, 2>& v) const {
    using std::cos, std::sin;
    using std::sqrt;
    T speed = x(1) * (v(0) + 1.0);
    const T angle = x(0) + v(1);
    if (x(1) > T(ends)) return {T(nan), T(nan)};
    if (x(1) > T(slope_ends)) speed = speed + sqrt(x(1) - x(1));
    return {speed * cos(angle), speed * sin(angle)};
  }
  Matrix2 noise_covariance(const Vector2& x) const {
    return Vector2(x(1) > R_ends ? -1 : r * (1 + 0.1 * x(1) * x(1)), r).asDiagonal();
  }
};
/// Speed, with noise that just adds, and varies.
struct Odometer {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(1));
  }
  Matrix1 noise_covariance(const Vector2& x) const { return Matrix1(0.01 * (1 + x(1) * x(1))); }
};

constexpr int length = 4;
auto make() {
  jml::Filter filter{jml::FixedLag<length, 3>{}, Vehicle{},
                     jml::sensors<Velocity, Odometer, jml::Part<Velocity>>,
                     jml::Estimate{Vector2(3.0, 2.0), (Matrix2() << 0.3, 0.1, 0.1, 0.2).finished()}};
  filter.method().options.sweeps = 6;
  return filter;
}
using Lag = decltype(make());
Vector2 seen(int k) {
  const double angle = 3.1 + 0.06 * k + 0.1 * std::sin(7 * k), speed = 2.2 + 0.2 * std::cos(5 * k);
  return {speed * std::cos(angle), speed * std::sin(angle)};
}
const Vector1 no_fault(0);
Status good_step(Lag& filter, int k) {
  const double dt = k % 2 == 0 ? 0.2 : 0.15;
  return k % 3 == 0 ? filter.step(Odometer{}, 2.2 + 0.1 * std::sin(k), dt, no_fault).status
                    : filter.step(Velocity{}, seen(k), dt, no_fault).status;
}
/// After so many steps, with a measurement late, and a part of one.
Lag after(int steps) {
  Lag filter = make();
  for (int k = 0; k < steps; ++k) {
    EXPECT_TRUE(usable(good_step(filter, k))) << k;
    if (k % 5 != 4) continue;
    EXPECT_TRUE(usable(filter.update(Velocity{}, seen(k - 1), jml::age(1)).status)) << k;
    EXPECT_TRUE(usable(filter.update(Velocity{}, seen(k), jml::only(1)).status)) << k;
  }
  return filter;
}

/// All numbers of a window: of each node its state, its disturbance, its charts, where and how its noise is
/// linearised, its records; and the prior.
class Bits {
 public:
  template <typename Store>
  explicit Bits(Store store) {
    add(store.prior().x, store.prior().L, store.prior().weight, store.prior().a[now(store)]);
    number(store.last());
    for (int j = 0; j <= store.last(); ++j) {
      const auto& node = store.node(j);
      const auto& at = node.context;
      add(node.x[now(store)], at.from, at.to, at.control);
      if (j > 0) add(node.b[now(store)], at.w, node.noise.B, node.noise.mean_effect);  // of the step before
      number(at.time);
      number(at.dt);
      for (const auto count : node.count) number(count);
      store.visit(j, [&](auto& record) {
        add(record.y, record.R.lower, record.R.inverse_diagonal);
        if constexpr (requires { record.sensor.point.v; }) point(record.sensor.point);
        if constexpr (requires { record.sensor.sensor.point.v; }) point(record.sensor.sensor.point);
      });
    }
    for (int age = 0; age <= store.depth(); ++age) add(store.x(age), store.P(age));
  }
  bool operator==(const Bits& other) const {
    return numbers_.size() == other.numbers_.size() &&
           std::memcmp(numbers_.data(), other.numbers_.data(), numbers_.size() * sizeof(double)) == 0;
  }

 private:
  static std::size_t now(const auto& store) { return static_cast<std::size_t>(store.now()); }
  void number(double value) { numbers_.push_back(value); }
  void add(const auto&... values) {
    (numbers_.insert(numbers_.end(), values.data(), values.data() + values.size()), ...);
  }
  void point(const auto& of) {
    add(of.v, of.effect, of.R);
    number(of.frozen);
  }
  std::vector<double> numbers_;
};
Bits bits(const Lag& filter) { return Bits(filter.belief().inside()); }

/// `verb` says `wanted`, and nothing knows of it: neither the window nor what follows.
template <typename Verb>
void refused(Status wanted, const Verb& verb) {
  SCOPED_TRACE(jml::describe(wanted));
  for (const int steps : {1, 3, length, 3 * length}) {
    SCOPED_TRACE(steps);
    Lag filter = after(steps), untroubled = filter;
    const Bits before = bits(filter);
    const Status status = verb(filter);
    EXPECT_EQ(status, wanted) << jml::describe(status);
    EXPECT_TRUE(before == bits(filter));
    filter.gate = {};
    filter.method().options = untroubled.method().options;
    for (int k = 100; k < 106; ++k) {
      ASSERT_TRUE(usable(good_step(filter, k)));
      ASSERT_TRUE(usable(good_step(untroubled, k)));
      ASSERT_TRUE(bits(filter) == bits(untroubled)) << k;
    }
  }
}
/// By a step, a correction, one of part of a measurement, a late one, and one between two nodes.
void refused_everywhere(Status wanted, const auto& sensor, const Vector2& y, double control = 0) {
  const Vector1 u(control);
  refused(wanted, [&](Lag& filter) {
    filter.method().options.sweeps = 20;
    return filter.step(sensor, y, 0.2, u).status;
  });
  if (control != 0) return;
  refused(wanted, [&](Lag& filter) { return filter.update(sensor, y).status; });
  refused(wanted, [&](Lag& filter) { return filter.update(sensor, y, jml::only(0, 1)).status; });
  refused(wanted, [&](Lag& filter) { return filter.update(sensor, y, jml::age(filter.depth() / 2)).status; });
  refused(wanted, [&](Lag& filter) {
    return filter.update(sensor, y, jml::at_time(filter.time() - (filter.depth() > 1 ? 0.2 : 0.1))).status;
  });
}
const Vector2 faster{-4.5, -0.3};

TEST(RefusedInSpace, BeforeTheMinimisation) {
  refused_everywhere(Status::invalid_measurement, Velocity{}, {nan, 0});
  refused_everywhere(Status::sensor_not_finite, Velocity{.ends = 1}, faster);
  refused_everywhere(Status::invalid_noise_covariance, Velocity{.R_ends = 1}, faster);
  refused_everywhere(Status::invalid_noise_covariance, Velocity{.r = 0}, faster);  // an exact constraint
  refused(Status::ok, [](Lag& filter) {
    filter.gate = {0.99};
    const auto report = filter.update(Velocity{}, Vector2(5, 5));
    EXPECT_EQ(report.gate, jml::Verdict::rejected);
    return report.status;
  });
}

// The measurement pulls the speed from 2.2 to 3 and more, where m is no number, or R or Q is none.
TEST(RefusedInSpace, ByItsMinimisation) {
  refused_everywhere(Status::invalid_noise_covariance, Velocity{.R_ends = 2.7}, faster);
  refused_everywhere(Status::sensor_not_finite, Velocity{.slope_ends = 2.7}, faster);
  refused_everywhere(Status::invalid_disturbance_covariance, Velocity{}, faster, 2.35);
  refused(Status::not_converged, [](Lag& filter) {
    filter.method().options.sweeps = 1;
    return filter.update(Velocity{.ends = 2.7}, faster).status;
  });
}

// The model of a part is that of the sensor: v of x (1 + v) is not that of its first linearisation.
TEST(RefusedInSpace, APartOfASensorHasItsNoiseInside) {
  Lag whole = make();
  jml::Filter parts{jml::FixedLag<length, 3>{}, Vehicle{}, jml::sensors<jml::Part<Velocity>>,
                    jml::Estimate{Vector2(3.0, 2.0), (Matrix2() << 0.3, 0.1, 0.1, 0.2).finished()}};
  whole.method().options.sweeps = parts.method().options.sweeps = 50;
  for (int k = 0; k < 3 * length; ++k) {
    const auto report = whole.step(Velocity{}, seen(k), 0.2, no_fault);
    const auto of_part = parts.step(Velocity{}, seen(k), 0.2, no_fault);
    ASSERT_TRUE(usable(report.status) && usable(of_part.status));
    EXPECT_EQ(of_part.cost, report.cost);
    EXPECT_EQ(parts.x(), whole.x());
  }
}

}  // namespace
