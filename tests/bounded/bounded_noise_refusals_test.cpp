// SPDX-License-Identifier: BSD-3-Clause
// Every refusal of the bounded-noise estimator has its name and leaves box and time bit by bit as they were;
// and the next good steps never learn of it.
#include <gtest/gtest.h>

#include <cstring>
#include <jml/bounded/bounded_noise.hpp>
#include <vector>

#include "models/bounded.hpp"

namespace {

using namespace jml::operators;

using jml::Box, jml::Guaranteed, jml::Linearised, jml::Status, jml::usable;
using Vector1 = jml::Vector<double, 1>;
using Vector2 = jml::Vector<double, 2>;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

/// What is wrong with one step of the plant; its control input says which.
enum Fault : int {
  none,
  f_nan,
  f_inf,
  f_x_nan,
  mean_nan,
  G_nan,
  G_inf,
  bound_nan,
  bound_inf,
  bound_negative
};

/// Van der Pol over any dt.
struct Plant {
  static constexpr int states = 2, disturbances = 1, controls = 1;
  static bool has(Fault fault, const auto& at) { return at.control(0) == static_cast<double>(fault); }

  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto& at) const {
    jml::Vector<T, 2> f = models::VanDerPol{.dt = at.dt, .c = 0.5}.dynamics(x);
    if (has(f_nan, at)) f(1) = T(nan);
    if (has(f_inf, at)) f(0) = T(inf);
    return f;
  }
  template <typename T>
  jml::Matrix<T, 2, 2> dynamics_jacobian(const jml::Vector<T, 2>& x, const auto& at) const {
    jml::Matrix<T, 2, 2> J = models::VanDerPol{.dt = at.dt, .c = 0.5}.dynamics_jacobian(x);
    if (has(f_x_nan, at)) J(1, 0) = T(nan);
    return J;
  }
  template <typename T>
  jml::Matrix<T, 2, 1> disturbance_input(const jml::Vector<T, 2>& x, const auto& at) const {
    return {T(0), has(G_nan, at) ? T(nan) : has(G_inf, at) ? T(inf) : at.dt * (1.0 + 0.1 * x(1))};
  }
  Vector1 disturbance_bound(const Vector2&, const auto& at) const {
    return Vector1(has(bound_nan, at) ? nan : has(bound_inf, at) ? inf : has(bound_negative, at) ? -1e-9 : 1);
  }
};

/// The same with a known part of the disturbance.
struct Pushed : Plant {
  double push = 0.1;
  Vector1 disturbance_mean() const { return Vector1(push); }
};

/// y = x / sqrt(1 + x²) + v.
struct Gauge {
  static constexpr int measurements = 1;
  double b = 0.5;
  bool m_nan = false, m_x_nan = false;

  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return m_nan ? jml::Vector<T, 1>(T(nan)) : models::SaturatingPosition{}.measurement(x);
  }
  template <typename T>
  jml::Matrix<T, 1, 2> measurement_jacobian(const jml::Vector<T, 2>& x) const {
    if (m_x_nan) return {T(nan), T(0)};
    return models::SaturatingPosition{}.measurement_jacobian(x);
  }
  Vector1 noise_bound() const { return Vector1(b); }
};

/// y = (position, velocity) + v.
struct Both {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  Vector2 b{0.8, 0.9};
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x) const {
    return x;
  }
  Vector2 noise_bound() const { return b; }
};

/// Everything that the estimator shows.
template <typename Filter>
std::vector<double> snapshot(const Filter& filter) {
  std::vector<double> out{filter.time(), static_cast<double>(filter.status())};
  for (int i = 0; i < 2; ++i) {
    out.push_back(filter.box().lower(i));
    out.push_back(filter.box().upper(i));
  }
  return out;
}
bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

const Box<double, 2> good{Vector2(1.2, 0.1), Vector2(1.8, 0.9)};

template <typename Rule>
struct BoundedNoiseRefusals : ::testing::Test {
  using Filter = jml::Filter<Rule, Plant>;
  static constexpr bool guaranteed = !std::is_same_v<Rule, Linearised>;

  static Status good_step(Filter& filter, int k) {
    const double position = filter.x()(0);
    const double y = position / std::sqrt(1 + position * position) + 0.1 * std::sin(k);
    return filter.step(Gauge{}, y, k % 2 == 0 ? 0.1 : 0.07).status;
  }
  static Filter after(int steps) {
    Filter filter{Rule{}, Plant{}, good, 3.0};
    for (int k = 0; k < steps; ++k) {
      EXPECT_EQ(good_step(filter, k), Status::ok);
    }
    return filter;
  }
  /// `act` must answer `wanted` and change nothing, now and later.
  template <typename Act>
  static void refused(Status wanted, const Act& act) {
    SCOPED_TRACE(jml::describe(wanted));
    for (const int steps : {0, 1, 6}) {
      SCOPED_TRACE(steps);
      Filter filter = after(steps), undisturbed = filter;
      const auto before = snapshot(filter);
      const Status status = act(filter);
      EXPECT_EQ(status, wanted) << jml::describe(status);
      EXPECT_FALSE(usable(wanted));
      EXPECT_TRUE(same_bits(before, snapshot(filter)));
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(good_step(filter, k), Status::ok);
        EXPECT_EQ(good_step(undisturbed, k), Status::ok);
        EXPECT_TRUE(same_bits(snapshot(filter), snapshot(undisturbed)));
      }
    }
  }
  template <typename S, typename Y>
  static void refused_measurement(Status wanted, const S& sensor, const Y& y) {
    refused(wanted, [&](Filter& filter) { return filter.step(sensor, y, 0.1).status; });
    refused(wanted, [&](Filter& filter) { return filter.update(sensor, y).status; });
  }
  static void refused_motion(Status wanted, double dt, double control) {
    SCOPED_TRACE(control);
    refused(wanted, [&](Filter& filter) { return filter.step(Gauge{}, 0.5, dt, Vector1(control)).status; });
    refused(wanted, [&](Filter& filter) { return filter.predict(dt, Vector1(control)); });
  }
};
using Rules = ::testing::Types<Linearised, Guaranteed<>, Guaranteed<0>>;
TYPED_TEST_SUITE(BoundedNoiseRefusals, Rules);

TYPED_TEST(BoundedNoiseRefusals, Measurements) {
  for (const double bad : {nan, inf, -inf}) {
    this->refused_measurement(Status::invalid_measurement, Gauge{}, bad);
    this->refused_measurement(Status::invalid_measurement, Both{}, Vector2(1.5, bad));
    this->refused_measurement(Status::invalid_measurement, Both{}, Vector2(bad, 0.5));
  }
}

TYPED_TEST(BoundedNoiseRefusals, NoiseBounds) {
  for (const double bad : {nan, inf, -inf, -1.0, -1e-300}) {
    this->refused_measurement(Status::invalid_noise_bound, Gauge{.b = bad}, 0.8);
    this->refused_measurement(Status::invalid_noise_bound, Both{{0.8, bad}}, Vector2(1.5, 0.5));
    this->refused_measurement(Status::invalid_noise_bound, Both{{bad, 0.8}}, Vector2(1.5, 0.5));
  }
}

TYPED_TEST(BoundedNoiseRefusals, Motion) {
  for (const double dt : {-1e-9, -1.0, nan, inf, -inf})
    this->refused_motion(Status::invalid_time_step, dt, 0);
  for (const double bad : {nan, inf, -inf}) this->refused_motion(Status::invalid_control, 0.1, bad);
}

TYPED_TEST(BoundedNoiseRefusals, Dynamics) {
  for (const Fault fault : {f_nan, f_inf}) this->refused_motion(Status::dynamics_not_finite, 0.1, fault);
  for (const double bad : {nan, inf}) {
    jml::Filter filter{TypeParam{}, Pushed{{}, bad}, good, 3.0};
    const auto before = snapshot(filter);
    EXPECT_EQ(filter.predict(0.1), Status::dynamics_not_finite);
    EXPECT_EQ(filter.step(Gauge{}, 0.8, 0.1).status, Status::dynamics_not_finite);
    EXPECT_TRUE(same_bits(before, snapshot(filter)));
    EXPECT_EQ(filter.update(Gauge{}, 0.8).status, Status::ok);
  }
}
TYPED_TEST(BoundedNoiseRefusals, DisturbanceBounds) {
  for (const Fault fault : {bound_nan, bound_inf, bound_negative, G_nan, G_inf})
    this->refused_motion(Status::invalid_disturbance_bound, 0.1, fault);
}
TYPED_TEST(BoundedNoiseRefusals, Sensors) {
  this->refused_measurement(Status::sensor_not_finite, Gauge{.m_nan = true}, 0.8);
}

// A Jacobian that is NaN: Linearised has no box. Guaranteed has the interval evaluation of f, and says no
// more; of a sensor it uses nothing.
TYPED_TEST(BoundedNoiseRefusals, Jacobians) {
  if constexpr (!TestFixture::guaranteed) {
    this->refused_motion(Status::dynamics_not_finite, 0.1, f_x_nan);
    this->refused_measurement(Status::sensor_not_finite, Gauge{.m_x_nan = true}, 0.8);
  } else {
    jml::Noise noise(13);
    auto filter = this->after(0);
    ASSERT_EQ(filter.predict(0.1, Vector1(f_x_nan)), Status::ok);
    EXPECT_TRUE(filter.box().bounded());
    for (int k = 0; k < 1000; ++k) {
      const Vector2 x = models::point_of(good, noise, k % 2 == 0);
      const Vector2 push(0, 0.1 * (1 + 0.1 * x(1)) * noise.uniform(-1, 1));
      ASSERT_TRUE(filter.box().contains(models::VanDerPol{.dt = 0.1, .c = 0.5}.dynamics(x) + push));
    }
    const auto before = snapshot(filter);
    EXPECT_EQ(filter.update(Gauge{.m_x_nan = true}, 0.8).status, Status::ok);
    EXPECT_TRUE(same_bits(before, snapshot(filter)));
    EXPECT_EQ(this->good_step(filter, 0), Status::ok);
  }
}

TYPED_TEST(BoundedNoiseRefusals, BadBoxes) {
  const auto bad_box = [](const Box<double, 2>& box, double time, Status wanted) {
    SCOPED_TRACE(jml::describe(wanted));
    jml::Filter filter{TypeParam{}, Plant{}, box, time};
    const auto before = snapshot(filter);
    EXPECT_EQ(filter.status(), wanted);
    EXPECT_EQ(filter.step(Gauge{}, 0.8, 0.1).status, wanted);
    EXPECT_EQ(filter.step(Gauge{}, nan, 0.1).status, wanted);
    EXPECT_EQ(filter.update(Both{}, Vector2(1.5, 0.5)).status, wanted);
    EXPECT_EQ(filter.update(Gauge{.m_nan = true}, 0.8).status, wanted);
    EXPECT_EQ(filter.predict(0.1), wanted);
    EXPECT_EQ(filter.predict(nan), wanted);
    EXPECT_TRUE(same_bits(before, snapshot(filter)));
    EXPECT_EQ(filter.reset(good, 3.0), Status::ok);
    EXPECT_EQ(filter.status(), Status::ok);
    auto fresh = TestFixture::after(0);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(TestFixture::good_step(filter, k), Status::ok);
      EXPECT_EQ(TestFixture::good_step(fresh, k), Status::ok);
      EXPECT_TRUE(same_bits(snapshot(filter), snapshot(fresh)));
    }
    // A used estimator too.
    EXPECT_EQ(filter.reset(box, time), wanted);
    EXPECT_EQ(filter.status(), wanted);
    EXPECT_EQ(filter.predict(0.1), wanted);
  };
  for (int i = 0; i < 2; ++i) {
    const auto with = [i](double lower, double upper) {
      Box<double, 2> box = good;
      box.lower(i) = lower;
      box.upper(i) = upper;
      return box;
    };
    bad_box(with(nan, 1), 0, Status::invalid_box);
    bad_box(with(0, nan), 0, Status::invalid_box);
    bad_box(with(nan, nan), 0, Status::invalid_box);
    bad_box(with(1, std::nextafter(1.0, 0.0)), 0, Status::invalid_box);
    bad_box(with(1, -1), 0, Status::invalid_box);
    bad_box(with(inf, inf), 0, Status::invalid_box);
    bad_box(with(-inf, -inf), 0, Status::invalid_box);
    bad_box(with(inf, -inf), 0, Status::invalid_box);
  }
  for (const double bad : {nan, inf, -inf}) bad_box(good, bad, Status::invalid_time_step);
  // A point is a box.
  EXPECT_EQ((jml::Filter{TypeParam{}, Plant{}, Box{Vector2(1, 2), Vector2(1, 2)}}.status()), Status::ok);
}

TYPED_TEST(BoundedNoiseRefusals, UnboundedState) {
  for (int i = 0; i < 2; ++i) {
    for (const bool below : {true, false}) {
      Box<double, 2> box = good;
      (below ? box.lower : box.upper)(i) = below ? -inf : inf;
      jml::Filter filter{TypeParam{}, Plant{}, box, 3.0};
      EXPECT_EQ(filter.status(), Status::ok);
      const auto before = snapshot(filter);
      EXPECT_EQ(filter.predict(0.1), Status::state_unbounded);
      EXPECT_EQ(filter.step(Gauge{}, 0.8, 0.1).status, Status::state_unbounded);
      EXPECT_EQ(filter.step(Both{}, Vector2(1.5, 0.5), 0.1).status, Status::state_unbounded);
      if (!TestFixture::guaranteed) {  // no point to linearise at
        EXPECT_EQ(filter.update(Gauge{}, 0.8).status, Status::state_unbounded);
      }
      EXPECT_EQ(filter.update(Both{}, Vector2(nan, 0.5)).status, Status::invalid_measurement);
      EXPECT_EQ(filter.update(Both{{-1, 1}}, Vector2(1.5, 0.5)).status, Status::invalid_noise_bound);
      EXPECT_TRUE(same_bits(before, snapshot(filter)));
      EXPECT_EQ(filter.update(Both{}, Vector2(1.5, 0.5)).status, Status::ok);
      EXPECT_TRUE(filter.box().bounded());
      EXPECT_EQ(filter.predict(0.1), Status::ok);
    }
  }
}

// An overflow on the way is refused, not carried on.
TYPED_TEST(BoundedNoiseRefusals, Overflow) {
  const Box<double, 2> huge{Vector2(-1e300, -1e300), Vector2(1e300, 1e300)};
  jml::Filter filter{TypeParam{}, Plant{}, huge, 3.0};
  const auto before = snapshot(filter);
  EXPECT_EQ(filter.status(), Status::ok);
  if (TestFixture::guaranteed) {  // its Jacobian over the whole box is infinite
    EXPECT_EQ(filter.predict(1.0), Status::dynamics_not_finite);
    EXPECT_TRUE(same_bits(before, snapshot(filter)));
  } else {  // at the centre all is sound
    EXPECT_EQ(filter.predict(1.0), Status::ok);
    EXPECT_TRUE(filter.box().bounded());
  }
  EXPECT_EQ(filter.update(Both{}, Vector2(1.5, 0.5)).status, Status::ok);
  EXPECT_TRUE(filter.box().contains(Vector2(1.5, 0.5)));
}

// Twice the same, and a used estimator after reset() is a new one.
TYPED_TEST(BoundedNoiseRefusals, SameInputSameBits) {
  auto once = this->after(0), twice = this->after(0), used = this->after(7);
  ASSERT_EQ(used.predict(0.3), Status::ok);
  ASSERT_EQ(used.reset(good, 3.0), Status::ok);
  for (int k = 0; k < 10; ++k) {
    for (auto* filter : {&once, &twice, &used}) {
      ASSERT_EQ(this->good_step(*filter, k), Status::ok);
      if (k % 3 != 0) continue;
      ASSERT_TRUE(usable(filter->update(Both{}, filter->x()).status));
    }
    ASSERT_TRUE(same_bits(snapshot(once), snapshot(twice)));
    ASSERT_TRUE(same_bits(snapshot(once), snapshot(used)));
  }
}

}  // namespace
