// SPDX-License-Identifier: BSD-3-Clause
// The bounded-noise estimator never touches the heap, its constructor included; and it works in single
// precision, in which its guarantee holds too.
#include <gtest/gtest.h>

#include <cstdlib>
#include <jml/bounded/bounded_noise.hpp>

#include "heap_trap.hpp"
#include "models/bounded.hpp"

namespace {

using namespace jml::operators;

using heap_trap::allocations, heap_trap::Armed;
using jml::Box, jml::Filter, jml::Guaranteed, jml::Linearised, jml::usable;
using Vector1 = jml::Vector<double, 1>;
using Vector2 = jml::Vector<double, 2>;
using Vector4 = jml::Vector<double, 4>;

TEST(BoundedNoiseNoHeap, TheTrapWorks) {
  Armed trap;
  void* volatile block = std::malloc(8);
  std::free(block);
  EXPECT_EQ(allocations, 1);
}

/// Construction, every verb, a refusal, a violation, a copy, a new start, a start without a prior box.
template <typename Rule, typename D, typename S, typename Scalar, int n, int p>
void expect_no_allocation(const Rule& rule, const D& dynamics, const S& sensor, const Box<Scalar, n>& start,
                          const jml::Vector<Scalar, p>& y) {
  int done = 0, refused = 0, violated = 0;
  bool finite = true;
  {
    Armed trap;
    Filter filter{rule, dynamics, start};
    for (int k = 0; k < 5; ++k) {
      done += usable(filter.step(sensor, y).status);
      done += usable(filter.predict());
      done += usable(filter.update(sensor, y).status);
      finite &= jml::all_finite(filter.x()) && jml::all_finite(filter.box().error_variance());
    }
    jml::Vector<Scalar, p> bad = y;
    bad(0) = std::numeric_limits<Scalar>::quiet_NaN();
    refused += filter.step(sensor, bad).status == jml::Status::invalid_measurement;
    bad(0) = Scalar(1e6);
    violated += filter.step(sensor, bad).status == jml::Status::accepted_without_measurement;
    auto copy = filter;
    violated += copy.update(sensor, bad).status == jml::Status::accepted_without_measurement;
    done += usable(filter.reset(start, 0));
    Filter<Rule, D, Scalar> fresh{rule, dynamics, {}};
    refused += fresh.predict() == jml::Status::state_unbounded;
    refused += fresh.step(sensor, y).status == jml::Status::state_unbounded;
    (void)fresh.update(sensor, y);
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(done, 16);
  EXPECT_EQ(refused, 3);
  EXPECT_EQ(violated, 2);
  EXPECT_TRUE(finite);
}

TEST(BoundedNoiseNoHeap, VanDerPol) {
  const Box<double, 2> start{Vector2(0.7, -0.3), Vector2(1.2, 0.3)};
  const models::BoundedVanDerPol oscillator;
  expect_no_allocation(Linearised{}, oscillator, models::BoundedSaturatingPosition{}, start, Vector1(0.68));
  expect_no_allocation(Guaranteed{}, oscillator, models::BoundedSaturatingPosition{}, start, Vector1(0.68));
  expect_no_allocation(Guaranteed<0>{}, oscillator, models::BoundedSaturatingPosition{}, start,
                       Vector1(0.68));
  expect_no_allocation(jml::Paved<4>{}, oscillator, models::BoundedSaturatingPosition{}, start,
                       Vector1(0.68));
}

TEST(BoundedNoiseNoHeap, FourStates) {
  const Box<double, 4> start{Vector4(3, 1, -0.2, -0.2), Vector4(5, 3, 0.2, 0.2)};
  const Vector1 y(std::sqrt(20.0));
  expect_no_allocation(Linearised{}, models::BoundedVehicle{}, models::BoundedRange{}, start, y);
  expect_no_allocation(Guaranteed{}, models::BoundedVehicle{}, models::BoundedRange{}, start, y);
}

/// The oscillator in float, with its Jacobians derived.
struct FloatVanDerPol {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    const T acceleration = -x(0) - 0.2F * (x(0) * x(0) - 1.0F) * x(1);
    return {x(0) + 0.05F * x(1), x(1) + 0.05F * acceleration};
  }
  jml::Matrix<float, 2, 1> disturbance_input() const { return {0.0F, 0.05F}; }
  jml::Vector<float, 1> disturbance_bound() const { return jml::Vector<float, 1>(1.0F); }
};
struct FloatSaturatingPosition {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::sqrt;
    return jml::Vector<T, 1>(x(0) / sqrt(1.0F + x(0) * x(0)));
  }
  jml::Vector<float, 1> noise_bound() const { return jml::Vector<float, 1>(0.05F); }
};
const Box<float, 2> float_start{jml::Vector<float, 2>(0.7F, -0.3F), jml::Vector<float, 2>(1.2F, 0.3F)};

TEST(BoundedNoiseFloat, NoHeap) {
  const jml::Vector<float, 1> y(0.68F);
  expect_no_allocation(Linearised{}, FloatVanDerPol{}, FloatSaturatingPosition{}, float_start, y);
  expect_no_allocation(Guaranteed{}, FloatVanDerPol{}, FloatSaturatingPosition{}, float_start, y);
}

// The truth in double, of the model with float's own constants: inside the float box at every step. Outward
// rounding makes that exact; no slack but 1e-9 of the bounds, for the truth's own rounding.
TEST(BoundedNoiseFloat, GuaranteeHolds) {
  constexpr double h = 0.05F, c = 0.2F;
  constexpr double b = 0.05F;
  int outside = 0;
  double width = 0;
  for (int seed = 0; seed < 10; ++seed) {
    jml::Noise noise(40 + seed);
    Vector2 truth(noise.uniform(0.7, 1.2), noise.uniform(-0.3, 0.3));
    Filter filter{Guaranteed{}, FloatVanDerPol{}, float_start};
    for (int k = 0; k < 500; ++k) {
      const double w = 0.999999 * models::within(Vector1(1.0), noise, k / 50 % 2 == 0)(0);
      const double acceleration = -truth(0) - c * (truth(0) * truth(0) - 1) * truth(1);
      truth = Vector2(truth(0) + h * truth(1), truth(1) + h * acceleration + h * w);
      const double v = 0.999 * models::within(Vector1(b), noise, k % 3 == 0)(0);
      const double y = truth(0) / std::sqrt(1 + truth(0) * truth(0)) + v;
      ASSERT_EQ(filter.step(FloatSaturatingPosition{}, static_cast<float>(y)).status, jml::Status::ok) << k;
      const Vector2 lower = filter.box().lower.cast<double>(), upper = filter.box().upper.cast<double>();
      outside += (truth.array() < lower.array()).any() || (truth.array() > upper.array()).any();
      width = std::max(width, upper(0) - lower(0));
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_LT(width, 2);
}

}  // namespace
