// SPDX-License-Identifier: BSD-3-Clause
// What Batch refuses, by which name, and that a refusal leaves no trace; and what it answers at the edges: no
// measurement, no step, out of iterations, a model that is not finite everywhere, solve() again.
#include <gtest/gtest.h>

#include <jml/interval/batch.hpp>
#include <limits>

#include "jml/campaign/noise.hpp"

namespace {

using namespace jml::operators;

using jml::Matrix, jml::Status, jml::Vector;
const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();

enum class Fault { none, f, f_x, G, Q, m, m_x, R };

/// A damped oscillator with one control; goes wrong where x(0) is above `beyond`.
struct Plant {
  static constexpr int states = 2, disturbances = 1, controls = 1;
  Fault fault = Fault::none;
  double beyond = -infinity;

  template <typename X>
  [[nodiscard]] double broken(Fault f, const X& x) const {
    return fault == f && jml::plain_value(x(0)) > beyond ? nan : 0.0;
  }
  template <typename T, typename At>
  Vector<T, 2> dynamics(const Vector<T, 2>& x, const At& at) const {
    return {x(0) + at.dt * x(1) + broken(Fault::f, x),
            x(1) + at.dt * (at.control(0) - x(0) - 0.2 * (x(0) * x(0) - 1.0) * x(1))};
  }
  template <typename T, typename At>
  Matrix<T, 2, 2> dynamics_jacobian(const Vector<T, 2>& x, const At& at) const {
    Matrix<T, 2, 2> J;
    J << T(1 + broken(Fault::f_x, x)), T(at.dt), at.dt * (-1.0 - 0.4 * x(0) * x(1)),
        1.0 - at.dt * 0.2 * (x(0) * x(0) - 1.0);
    return J;
  }
  template <typename X, typename At>
  Matrix<double, 2, 1> disturbance_input(const X& x, const At& at) const {
    return {0, at.dt + broken(Fault::G, x)};
  }
  template <typename X>
  Matrix<double, 1, 1> disturbance_covariance(const X& x) const {
    return Matrix<double, 1, 1>(std::isnan(broken(Fault::Q, x)) ? -1.0 : 1.0);
  }
};

/// R is asked for at a state.
struct Saturating {
  static constexpr int measurements = 1;
  Fault fault = Fault::none;
  double beyond = -infinity;

  template <typename X>
  [[nodiscard]] double broken(Fault f, const X& x) const {
    return fault == f && jml::plain_value(x(0)) > beyond ? nan : 0.0;
  }
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 2>& x) const {
    using std::sqrt;
    return Vector<T, 1>(x(0) / sqrt(1.0 + x(0) * x(0)) + broken(Fault::m, x));
  }
  template <typename T>
  Matrix<T, 1, 2> measurement_jacobian(const Vector<T, 2>& x) const {
    using std::sqrt;
    const T s = 1.0 + x(0) * x(0);
    return {1.0 / (s * sqrt(s)) + broken(Fault::m_x, x), T(0)};
  }
  template <typename X>
  Matrix<double, 1, 1> noise_covariance(const X& x) const {
    return Matrix<double, 1, 1>(std::isnan(broken(Fault::R, x)) ? -0.02 : 0.02);
  }
};

/// Both states; R is a constant.
struct Both {
  static constexpr int measurements = 2;
  Matrix<double, 2, 2> R = 0.1 * Matrix<double, 2, 2>::Identity();
  template <typename T>
  Vector<T, 2> measurement(const Vector<T, 2>& x) const {
    return x;
  }
  Matrix<double, 2, 2> noise_covariance() const { return R; }
};

constexpr auto all_sensors = jml::sensors<Saturating, Both>;
constexpr double dt = 0.1;
const Vector<double, 1> no_torque{0.0};

jml::Estimate<double, 2> prior() { return {{1, 0}, 0.1 * Matrix<double, 2, 2>::Identity()}; }

auto batch_of(const Plant& plant, jml::Capacity capacity = {60}) {
  return jml::Batch{plant, all_sensors, prior(), capacity, 5.0};
}

/// Steps [first, last) of a flight, with a guess at each node; the truth goes up to x(0) = 1.7.
template <typename Batch>
void fly(Batch& batch, const Saturating& sensor = {}, int first = 0, int last = 60) {
  jml::Noise noise(51);
  Vector<double, 2> x(1.2, 0.1);
  for (int k = 0; k < last; ++k) {
    x = Plant{}.dynamics(x, jml::StepContext<double, 1>{0, dt, no_torque});
    x(1) += dt * noise.normal();
    const double y = Saturating{}.measurement(x)(0) + 0.14 * noise.normal();
    if (k < first) continue;
    ASSERT_EQ(batch.step(sensor, y, dt), Status::ok);
    batch.guess(x);
  }
}

/// Bit by bit.
template <typename Batch>
void expect_same_answer(const Batch& a, const Batch& b) {
  ASSERT_EQ(a.steps(), b.steps());
  for (int k = 0; k <= a.steps(); ++k) {
    EXPECT_EQ(a.x(k), b.x(k)) << k;
    EXPECT_EQ(a.time(k), b.time(k)) << k;
    if (k < a.steps()) {
      EXPECT_EQ(a.w(k), b.w(k)) << k;
    }
  }
}

template <typename Batch>
void expect_every_verb_to_answer(Batch& batch, Status status) {
  EXPECT_EQ(batch.status(), status);
  EXPECT_EQ(batch.step(Saturating{}, 0.5, dt), status);
  EXPECT_EQ(batch.predict(dt), status);
  EXPECT_EQ(batch.update(Both{}, {0.5, 0}), status);
  const auto report = batch.solve();
  EXPECT_EQ(report.status, status);
  EXPECT_EQ(report.iterations, 0);
  EXPECT_TRUE(std::isnan(report.cost) && std::isnan(report.gradient) && std::isnan(report.step));
  EXPECT_EQ(batch.steps(), 0);
}

TEST(BatchRefusals, BadPrior) {
  const auto refused = [](const Vector<double, 2>& x, const Matrix<double, 2, 2>& P, double time,
                          Status status) {
    jml::Batch batch{Plant{}, all_sensors, jml::Estimate<double, 2>{x, P}, {3}, time};
    expect_every_verb_to_answer(batch, status);
  };
  Matrix<double, 2, 2> good = Matrix<double, 2, 2>::Identity(), P = good;
  refused({nan, 0}, good, 0, Status::invalid_state);
  refused({0, infinity}, good, 0, Status::invalid_state);
  refused({0, 0}, good, nan, Status::invalid_time_step);
  P << 1, 2, 2, 1;
  refused({0, 0}, P, 0, Status::invalid_covariance);
  P << 1, 0.1, 0, 1;
  refused({0, 0}, P, 0, Status::invalid_covariance);
  P << 1, 0, 0, nan;
  refused({0, 0}, P, 0, Status::invalid_covariance);
  P << -1e-9, 0, 0, 1;
  refused({0, 0}, P, 0, Status::invalid_covariance);
}

TEST(BatchRefusals, BadCapacity) {
  for (const jml::Capacity capacity :
       {jml::Capacity{-1}, jml::Capacity{-1000000}, jml::Capacity{-3, 5},
        jml::Capacity{std::numeric_limits<int>::max()}, jml::Capacity{3, -2}}) {
    SCOPED_TRACE(testing::Message() << capacity.steps << ", " << capacity.measurements);
    auto batch = batch_of(Plant{}, capacity);
    expect_every_verb_to_answer(batch, Status::invalid_option);
  }
  auto nothing = batch_of(Plant{}, {0, 0});
  EXPECT_EQ(nothing.status(), Status::ok);
  EXPECT_EQ(nothing.predict(dt), Status::memory_full);
  EXPECT_EQ(nothing.update(Saturating{}, 0.5), Status::memory_full);
  EXPECT_EQ(nothing.solve().status, Status::ok);
}

/// x⁺ = x + w in one dimension, G = I.
struct Walk {
  static constexpr int states = 1, disturbances = 1;
  double q = 0.5;
  template <typename T>
  Vector<T, 1> dynamics(const Vector<T, 1>& x) const {
    return x;
  }
  Matrix<double, 1, 1> disturbance_covariance() const { return Matrix<double, 1, 1>(q); }
};
struct Direct {
  static constexpr int measurements = 1;
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 1>& x) const {
    return x;
  }
  Matrix<double, 1, 1> noise_covariance() const { return Matrix<double, 1, 1>(0.25); }
};
const jml::Estimate<double, 1> near_one{Vector<double, 1>(1.0), Matrix<double, 1, 1>(0.5)};

TEST(BatchRefusals, ConstantQIsRefusedAtOnce) {
  for (const double q : {-0.1, nan, infinity}) {
    jml::Batch batch{Walk{q}, jml::sensors<Direct>, near_one, {3}};
    EXPECT_EQ(batch.status(), Status::invalid_disturbance_covariance);
    EXPECT_EQ(batch.step(Direct{}, 0.5), Status::invalid_disturbance_covariance);
    EXPECT_EQ(batch.solve().status, Status::invalid_disturbance_covariance);
    EXPECT_EQ(batch.steps(), 0);
  }
}

// Every refused verb here leaves the batch as it was: it then has the answer of one that was never asked.
TEST(BatchRefusals, LeaveNoTrace) {
  auto asked = batch_of(Plant{}), untouched = batch_of(Plant{});
  fly(untouched);
  fly(asked, {}, 0, 30);
  const auto nothing_happened = [&, steps = asked.steps()](Status got, Status expected) {
    EXPECT_EQ(got, expected);
    EXPECT_EQ(asked.steps(), steps);
  };
  for (const double bad : {nan, infinity, -infinity}) {
    nothing_happened(asked.step(Saturating{}, bad, dt), Status::invalid_measurement);
    nothing_happened(asked.update(Saturating{}, bad), Status::invalid_measurement);
    nothing_happened(asked.step(Both{}, {0.1, bad}, dt), Status::invalid_measurement);
    nothing_happened(asked.step(Saturating{}, 0.1, bad), Status::invalid_time_step);
    nothing_happened(asked.predict(bad), Status::invalid_time_step);
    nothing_happened(asked.predict(dt, Vector<double, 1>(bad)), Status::invalid_control);
    nothing_happened(asked.step(Saturating{}, 0.1, dt, Vector<double, 1>(bad)), Status::invalid_control);
  }
  nothing_happened(asked.step(Saturating{}, 0.1, -1e-9), Status::invalid_time_step);
  nothing_happened(asked.predict(-1e-9), Status::invalid_time_step);
  Both both;
  for (const auto& [a, b, c, d] :
       {std::array{0.0, 0.0, 0.0, 1.0}, std::array{1.0, 0.2, 0.1, 1.0}, std::array{1.0, 2.0, 2.0, 1.0},
        std::array{1.0, 0.0, 0.0, nan}, std::array{-1.0, 0.0, 0.0, -1.0}, std::array{1.0, 1.0, 1.0, 1.0}}) {
    both.R << a, b, c, d;
    nothing_happened(asked.step(both, {0.1, 0.1}, dt), Status::invalid_noise_covariance);
    nothing_happened(asked.update(both, {0.1, 0.1}), Status::invalid_noise_covariance);
  }
  fly(asked, {}, 30, 60);
  EXPECT_EQ(asked.solve().status, Status::ok);
  EXPECT_EQ(untouched.solve().status, Status::ok);
  expect_same_answer(asked, untouched);
}

TEST(BatchRefusals, MemoryFull) {
  auto nodes = batch_of(Plant{}, {5, 20}), enough = batch_of(Plant{}, {6, 20});
  fly(nodes, {}, 0, 5);
  fly(enough, {}, 0, 5);
  EXPECT_EQ(nodes.predict(dt), Status::memory_full);
  EXPECT_EQ(nodes.step(Saturating{}, 0.5, dt), Status::memory_full);
  EXPECT_EQ(nodes.steps(), 5);
  EXPECT_EQ(nodes.update(Both{}, {0.5, 0}), Status::ok);
  EXPECT_EQ(enough.update(Both{}, {0.5, 0}), Status::ok);
  EXPECT_EQ(nodes.solve().status, Status::ok);
  EXPECT_EQ(enough.solve().status, Status::ok);
  expect_same_answer(nodes, enough);

  auto measurements = batch_of(Plant{}, {20, 5});
  enough = batch_of(Plant{}, {20, 20});
  fly(measurements, {}, 0, 5);
  fly(enough, {}, 0, 5);
  EXPECT_EQ(measurements.update(Saturating{}, 0.5), Status::memory_full);
  EXPECT_EQ(measurements.step(Saturating{}, 0.5, dt), Status::memory_full);
  EXPECT_EQ(measurements.steps(), 5);  // and not half of a step
  for (int k = 0; k < 5; ++k) {        // the other type has room of its own
    EXPECT_EQ(measurements.step(Both{}, {0.5, 0.1 * k}, dt), Status::ok);
    EXPECT_EQ(enough.step(Both{}, {0.5, 0.1 * k}, dt), Status::ok);
  }
  EXPECT_EQ(measurements.step(Both{}, {0.5, 0}, dt), Status::memory_full);
  EXPECT_EQ(measurements.solve().status, Status::ok);
  EXPECT_EQ(enough.solve().status, Status::ok);
  expect_same_answer(measurements, enough);

  auto by_default = batch_of(Plant{}, {2});  // one a node, the first included
  EXPECT_EQ(by_default.update(Saturating{}, 0.5), Status::ok);
  EXPECT_EQ(by_default.step(Saturating{}, 0.5, dt), Status::ok);
  EXPECT_EQ(by_default.step(Saturating{}, 0.5, dt), Status::ok);
  EXPECT_EQ(by_default.update(Saturating{}, 0.5), Status::memory_full);
}

TEST(BatchRefusals, InvalidOptions) {
  auto batch = batch_of(Plant{});
  fly(batch);
  ASSERT_EQ(batch.solve().status, Status::ok);
  const auto before = batch;
  const auto refused = [&](const jml::BatchOptions& options) {
    batch.options = options;
    const auto report = batch.solve();
    EXPECT_EQ(report.status, Status::invalid_option);
    EXPECT_EQ(report.iterations, 0);
    EXPECT_TRUE(std::isnan(report.cost));
    expect_same_answer(batch, before);
  };
  for (const int limit : {0, -1, std::numeric_limits<int>::min()}) refused({.max_iterations = limit});
  for (const double tolerance : {-1e-9, 1.0, nan, infinity}) refused({.tolerance = tolerance});
  for (const double width : {0.0, -2.0, nan, infinity}) {
    refused({.loss = jml::Loss::huber(width)});
    refused({.loss = jml::Loss::cauchy(width)});
  }
}

TEST(BatchRefusals, ModelIsNotFiniteAnywhere) {
  const std::pair<Fault, Status> cases[] = {{Fault::f, Status::dynamics_not_finite},
                                            {Fault::f_x, Status::dynamics_not_finite},
                                            {Fault::G, Status::invalid_disturbance_covariance},
                                            {Fault::Q, Status::invalid_disturbance_covariance},
                                            {Fault::m, Status::sensor_not_finite},
                                            {Fault::m_x, Status::sensor_not_finite},
                                            {Fault::R, Status::invalid_noise_covariance}};
  for (const auto& [fault, status] : cases) {
    for (const auto start : {jml::Start::filter, jml::Start::prediction, jml::Start::given}) {
      SCOPED_TRACE(testing::Message()
                   << "fault " << static_cast<int>(fault) << ", start " << static_cast<int>(start));
      auto batch = batch_of({fault});
      if (fault == Fault::m) {  // where it comes
        EXPECT_EQ(batch.step(Saturating{fault}, 1.0, dt).status, status);
        EXPECT_EQ(batch.steps(), 0);
        continue;
      }
      fly(batch, {fault});
      batch.start = start;
      EXPECT_EQ(batch.solve().status, status);
    }
  }
}

// Where the answer lies in the broken region, any name will do but none that says it is usable.
TEST(BatchRefusals, ModelIsNotFiniteAtTheAnswer) {
  auto good = batch_of(Plant{});
  fly(good);
  ASSERT_EQ(good.solve().status, Status::ok);
  double top = 0;
  for (int k = 0; k <= good.steps(); ++k) top = std::max(top, good.x(k)(0));
  for (const Fault fault : {Fault::f, Fault::f_x, Fault::G, Fault::Q, Fault::m, Fault::m_x, Fault::R}) {
    for (const auto start : {jml::Start::filter, jml::Start::prediction, jml::Start::given}) {
      SCOPED_TRACE(testing::Message()
                   << "fault " << static_cast<int>(fault) << ", start " << static_cast<int>(start));
      auto batch = batch_of({fault, top - 0.1});
      fly(batch, {fault, top - 0.1});
      batch.start = start;
      batch.options.accept_at_limit = true;
      EXPECT_FALSE(jml::usable(batch.solve().status));
    }
  }
}

// Not finite only where nobody has to go: the same answer, to the last bit.
TEST(BatchRefusals, ModelIsNotFiniteFarAway) {
  for (const auto start : {jml::Start::filter, jml::Start::prediction, jml::Start::given}) {
    auto good = batch_of(Plant{});
    fly(good);
    good.start = start;
    ASSERT_EQ(good.solve().status, Status::ok);
    for (const Fault fault : {Fault::f, Fault::f_x, Fault::G, Fault::Q, Fault::m, Fault::m_x, Fault::R}) {
      auto batch = batch_of({fault, 4});
      fly(batch, {fault, 4});
      batch.start = start;
      EXPECT_EQ(batch.solve().status, Status::ok);
      expect_same_answer(batch, good);
    }
  }
}

TEST(BatchRefusals, OutOfIterations) {
  for (const auto start : {jml::Start::filter, jml::Start::prediction, jml::Start::given}) {
    auto refused = batch_of(Plant{}), accepted = batch_of(Plant{}), full = batch_of(Plant{});
    for (auto* batch : {&refused, &accepted, &full}) {
      fly(*batch);
      batch->start = start;
      batch->options.max_iterations = 1;
    }
    accepted.options.accept_at_limit = true;
    full.options.max_iterations = 100;
    const auto no = refused.solve(), yes = accepted.solve(), best = full.solve();
    EXPECT_EQ(no.status, Status::not_converged);
    EXPECT_EQ(yes.status, Status::accepted_at_limit);
    EXPECT_EQ(best.status, Status::ok);
    EXPECT_EQ(no.iterations, 1);
    EXPECT_EQ(yes.iterations, 1);
    EXPECT_GT(best.iterations, 1);
    expect_same_answer(refused, accepted);  // the best trajectory found, and its own figures
    EXPECT_TRUE(std::isfinite(no.cost) && std::isfinite(no.gradient) && std::isfinite(no.step));
    EXPECT_GT(no.cost, best.cost);
    EXPECT_GT(no.gradient, 100 * best.gradient);
    EXPECT_GT(no.step, 1e-6);
    // Going on from there: a warm start.
    refused.options.max_iterations = 100;
    refused.start = jml::Start::given;
    EXPECT_EQ(refused.solve().status, Status::ok);
    for (int k = 0; k <= 60; ++k) EXPECT_LE((refused.x(k) - full.x(k)).norm(), 1e-9);
  }
}

// No data: the prior is the answer, carried along; J = 0, w = 0, and P is the prediction's.
TEST(BatchEdges, NoMeasurement) {
  for (const auto start : {jml::Start::filter, jml::Start::prediction, jml::Start::given}) {
    auto batch = batch_of(Plant{});
    Vector<double, 2> x = prior().x;
    Matrix<double, 2, 2> P = prior().P;
    std::vector<Vector<double, 2>> states{x};
    std::vector<Matrix<double, 2, 2>> covariances{P};
    for (int k = 0; k < 20; ++k) {
      const jml::StepContext<double, 1> at{0, 0.02 * (k % 3), Vector<double, 1>(0.1 * k)};
      const Matrix<double, 2, 2> A = Plant{}.dynamics_jacobian(x, at);
      const Matrix<double, 2, 1> G = Plant{}.disturbance_input(x, at);
      P = (A * P * A.transpose() + G * G.transpose()).eval();
      x = Plant{}.dynamics(Vector<double, 2>(x), at);
      states.push_back(x);
      covariances.push_back(P);
      ASSERT_EQ(batch.predict(at.dt, at.control), Status::ok);
      batch.guess(x + Vector<double, 2>(0.1, -0.2));
    }
    batch.start = start;
    const auto report = batch.solve();
    EXPECT_EQ(report.status, Status::ok);
    EXPECT_EQ(report.cost, 0);
    EXPECT_EQ(report.gradient, 0);
    for (std::size_t k = 0; k < states.size(); ++k) {
      const int node = static_cast<int>(k);
      EXPECT_LE((batch.x(node) - states[k]).norm(), 1e-15) << k;
      EXPECT_LE((batch.P(node) - covariances[k]).norm(), 1e-14) << k;
      if (node < batch.steps()) {
        EXPECT_EQ(batch.w(node)(0), 0) << k;
      }
    }
  }
}

/// A linear m of a given R.
struct Precise : Direct {
  static constexpr bool linear = true;
  double r = 0.25;
  Matrix<double, 1, 1> noise_covariance() const { return Matrix<double, 1, 1>(r); }
};
// An ε of 1e6, 1.2e-10, is much of a deviation of 3e-13, and next to none of one half.
TEST(BatchEdges, AMeasurementFinerThanTheDigitsOfAState) {
  for (const double r : {0.25, 1e-25}) {
    jml::Batch batch{Walk{}, jml::sensors<Precise>, near_one, {2}};
    for (const double y : {1e6, 1e6 + 1}) ASSERT_EQ(batch.step(Precise{{}, r}, y), Status::ok);
    EXPECT_EQ(batch.solve().status, r < 0.25 ? Status::accuracy_not_met : Status::ok);
  }
}

TEST(BatchEdges, NoStep) {
  jml::Batch batch{Walk{}, jml::sensors<Direct>, near_one, {3, 4}, 7.5};
  EXPECT_EQ(batch.solve().status, Status::ok);
  EXPECT_EQ(batch.steps(), 0);
  EXPECT_EQ(batch.x(0)(0), 1);
  EXPECT_NEAR(batch.P(0)(0, 0), 0.5, 1e-15);
  EXPECT_EQ(batch.time(0), 7.5);
  // Two measurements of x_0: weights 1/0.5, 1/0.25, 1/0.25.
  EXPECT_EQ(batch.update(Direct{}, 2.0), Status::ok);
  EXPECT_EQ(batch.update(Direct{}, 4.0), Status::ok);
  const auto report = batch.solve();
  EXPECT_EQ(report.status, Status::ok);
  EXPECT_NEAR(batch.x(0)(0), 2.6, 1e-14);
  EXPECT_NEAR(batch.P(0)(0, 0), 0.1, 1e-15);
  EXPECT_NEAR(report.cost, (1.6 * 1.6 / 0.5 + 0.6 * 0.6 / 0.25 + 1.4 * 1.4 / 0.25) / 2, 1e-14);
}

TEST(BatchEdges, SolveTwiceGivesTheSameBits) {
  for (const auto start : {jml::Start::filter, jml::Start::prediction}) {
    auto batch = batch_of(Plant{});
    fly(batch);
    batch.start = start;
    const auto first = batch.solve();
    const auto copy = batch;
    const auto second = batch.solve();
    EXPECT_EQ(first.status, Status::ok);
    EXPECT_EQ(second.status, Status::ok);
    EXPECT_EQ(first.iterations, second.iterations);
    EXPECT_EQ(first.cost, second.cost);
    EXPECT_EQ(first.gradient, second.gradient);
    expect_same_answer(batch, copy);
  }
}

// Solved half-way, then filled: what it would be had nobody looked.
TEST(BatchEdges, MoreMeasurementsAfterASolve) {
  for (const auto start : {jml::Start::filter, jml::Start::prediction}) {
    auto looked = batch_of(Plant{}, {120}), straight = batch_of(Plant{}, {120});
    for (auto* batch : {&looked, &straight}) {
      batch->start = start;
      fly(*batch, {}, 0, 25);
      if (batch == &looked) {
        EXPECT_EQ(batch->solve().status, Status::ok);
        EXPECT_TRUE(jml::all_finite(batch->P(25)));
      }
      ASSERT_EQ(batch->update(Both{}, {0.9, 0.2}), Status::ok);
      fly(*batch, {}, 25, 45);
    }
    const auto a = looked.solve(), b = straight.solve();
    EXPECT_EQ(a.status, Status::ok);
    EXPECT_EQ(a.cost, b.cost);
    expect_same_answer(looked, straight);
  }
}

// The clock of a batch is that of a filter, whether the model reads it or not.
TEST(BatchEdges, TimeOfANode) {
  auto batch = batch_of(Plant{});
  jml::Batch deaf{Walk{}, jml::sensors<Direct>, near_one, {3}, 5.0};
  for (const double step : {0.5, 0.0, 0.25}) {
    ASSERT_EQ(batch.predict(step), Status::ok);
    ASSERT_EQ(deaf.step(Direct{}, 1.0, step), Status::ok);
  }
  const double expected[] = {5, 5.5, 5.5, 5.75};
  for (int k = 0; k <= 3; ++k) {
    EXPECT_EQ(batch.time(k), expected[k]) << k;
    EXPECT_EQ(deaf.time(k), expected[k]) << k << ", a model that reads no time";
  }
}

/// m = √x, not finite below zero, where the first undamped step would go.
struct Root {
  static constexpr int measurements = 1;
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 1>& x) const {
    using std::sqrt;
    return Vector<T, 1>(sqrt(x(0)));
  }
  Matrix<double, 1, 1> noise_covariance() const { return Matrix<double, 1, 1>(1e-4); }
};

/// ∂J/∂x_k of a walk, noises as they are at the answer; q(x): of the step from x; slope(x): ∂/∂x of what the
/// measurements of a node after the first add to J.
template <typename Batch, typename Q, typename Slope>
void expect_stationary_walk(const Batch& batch, const jml::Estimate<double, 1>& start, const Q& q,
                            const Slope& slope) {
  for (int k = 0; k <= batch.steps(); ++k) {
    const double x = batch.x(k)(0), before = k == 0 ? 0 : batch.x(k - 1)(0);
    double sum = k == 0 ? (x - start.x(0)) / start.P(0, 0) : (x - before) / q(before);
    if (k < batch.steps()) sum -= (batch.x(k + 1)(0) - x) / q(x);
    const double data = k == 0 ? 0 : slope(x);
    EXPECT_NEAR(sum + data, 0, 1e-9 * (1 + std::abs(data))) << "node " << k;
  }
}

TEST(BatchEdges, FirstStepLeavesTheDomain) {
  const Walk walk{1e-4};
  const jml::Estimate<double, 1> start{Vector<double, 1>(1.0), Matrix<double, 1, 1>(1.0)};
  ASSERT_LT(1.0 + (0.1 - 1.0) / 0.5, 0);  // Gauss-Newton from x = 1
  for (const auto from : {jml::Start::filter, jml::Start::prediction, jml::Start::given}) {
    jml::Batch batch{walk, jml::sensors<Root>, start, {10}};
    for (int k = 0; k < 10; ++k) ASSERT_EQ(batch.step(Root{}, 0.1), Status::ok);
    batch.start = from;
    ASSERT_EQ(batch.solve().status, Status::ok);
    EXPECT_NEAR(batch.x(10)(0), 0.01, 1e-3);
    expect_stationary_walk(
        batch, start, [](double) { return 1e-4; },
        [](double x) { return -(0.1 - std::sqrt(x)) / (2 * std::sqrt(x)) / 1e-4; });
  }
}

/// A walk with steps the longer the farther it is from 0.
struct GrowingWalk : Walk {
  [[nodiscard]] static double variance(double x) { return 0.1 + 0.2 * x * x; }
  template <typename X>
  Matrix<double, 1, 1> disturbance_covariance(const X& x) const {
    return Matrix<double, 1, 1>(variance(jml::plain_value(x(0))));
  }
};
/// Two measurements of x, R = T(x) T(x)ᵀ, T = [spread 0; correlation 1].
struct Correlated {
  static constexpr int measurements = 2;
  double growth = 0, twist = 0;
  [[nodiscard]] double spread(double x) const { return 1 + growth * x * x; }
  [[nodiscard]] double correlation(double x) const { return twist * std::tanh(x); }
  template <typename T>
  Vector<T, 2> measurement(const Vector<T, 1>& x) const {
    return {x(0), 0.5 * x(0)};
  }
  template <typename X>
  Matrix<double, 2, 2> noise_covariance(const X& x) const {
    const double s = spread(jml::plain_value(x(0))), c = correlation(jml::plain_value(x(0)));
    Matrix<double, 2, 2> R;
    R << s * s, s * c, s * c, 1 + c * c;
    return R;
  }
};

// State-dependent Q and R are frozen until the trajectory agrees with them: ∇J = 0 with those of the answer.
template <typename D, typename Q>
void expect_noise_of_the_answer(const D& walk, const Q& q, const Correlated& sensor) {
  const jml::Estimate<double, 1> start{Vector<double, 1>(0.3), Matrix<double, 1, 1>(4.0)};
  jml::Batch batch{walk, jml::sensors<Correlated>, start, {3}};
  for (int k = 0; k < 3; ++k) ASSERT_EQ(batch.step(sensor, {1.5, -0.5}), Status::ok);
  ASSERT_EQ(batch.solve().status, Status::ok);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(batch.w(k)(0), batch.x(k + 1)(0) - batch.x(k)(0), 1e-9);
  }
  expect_stationary_walk(batch, start, q, [&](double x) {
    const double s = sensor.spread(x), c = sensor.correlation(x);
    const double r0 = (1.5 - x) / s, r1 = -0.5 - 0.5 * x - c * r0;  // T⁻¹ r
    return -(r0 / s + r1 * (0.5 - c / s));                          // T⁻¹ m_x = (1/s, 0.5 - c/s)
  });
}

TEST(BatchEdges, FrozenQIsThatOfTheAnswer) {
  expect_noise_of_the_answer(GrowingWalk{}, GrowingWalk::variance, {});
}

TEST(BatchEdges, FrozenVarianceIsThatOfTheAnswer) {
  expect_noise_of_the_answer(Walk{}, [](double) { return 0.5; }, {.growth = 0.3});
}

TEST(BatchEdges, FrozenCorrelationIsThatOfTheAnswer) {
  expect_noise_of_the_answer(Walk{}, [](double) { return 0.5; }, {.twist = 3});
}

/// Precise below 1, poor above.
struct Flipping {
  static constexpr int measurements = 1;
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 1>& x) const {
    return x;
  }
  template <typename X>
  Matrix<double, 1, 1> noise_covariance(const X& x) const {
    return Matrix<double, 1, 1>(jml::plain_value(x(0)) > 1 ? 10.0 : 0.1);
  }
};

// R = 0.1 leads above 1, R = 10 below: no trajectory agrees with its R, and the report must not say that one
// does.
TEST(BatchEdges, NoiseThatNeverSettlesIsNotOk) {
  const jml::Estimate<double, 1> start{Vector<double, 1>(0.0), Matrix<double, 1, 1>(1.0)};
  jml::Batch batch{Walk{}, jml::sensors<Flipping>, start, {1}};
  ASSERT_EQ(batch.step(Flipping{}, 1.5), Status::ok);
  EXPECT_NE(batch.solve().status, Status::ok);
}

/// y = x².
struct Squared {
  static constexpr int measurements = 1;
  double r = 1;
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 1>& x) const {
    return Vector<T, 1>(x(0) * x(0));
  }
  Matrix<double, 1, 1> noise_covariance() const { return Matrix<double, 1, 1>(r); }
};
// Gauss-Newton steps of which each is 0.7 of the last go on to the minimum, 0 = (x - ½) - 2 x (y - x²);
// and those that swing from side to side, which fall by next to nothing, are damped.
TEST(BatchEdges, SlowGaussNewtonStepsGoOn) {
  for (const double y : {-0.2, -0.35, -0.42, -0.46, -0.5, -0.6, -1.0, -2.0}) {
    double low = 0, high = 0.5;
    for (int i = 0; i < 100; ++i) {
      const double x = (low + high) / 2;
      (x - 0.5 - 2 * x * (y - x * x) < 0 ? low : high) = x;
    }
    jml::Batch batch{Walk{}, jml::sensors<Squared>, jml::Estimate<double, 1>{0.5, 1.0}, {1}};
    batch.options.newton = false;
    ASSERT_EQ(batch.update(Squared{}, y), Status::ok);
    const auto report = batch.solve();
    EXPECT_TRUE(jml::usable(report.status)) << y << ": " << jml::describe(report.status);
    EXPECT_NEAR(batch.x(0)(0), low, 1e-6) << y;
    if (y <= -0.42 && y >= -0.5) {
      EXPECT_LE(report.iterations, 20) << y;
    }
  }
}

/// w has a mean that depends on x, and nothing else varies.
struct Pushed : Walk {
  template <typename X>
  Vector<double, 1> disturbance_mean(const X& x) const {
    return Vector<double, 1>(0.3 * jml::plain_value(x(0)));
  }
};
// The mean is that of the answer: x_0 = x̂ + k (y - x̂ - 0.3 x_0), k = P/(P + Q + R).
TEST(BatchEdges, AMeanThatVariesAloneIsThatOfTheAnswer) {
  jml::Batch batch{Pushed{}, jml::sensors<Direct>, near_one, {1}};
  ASSERT_EQ(batch.step(Direct{}, 3.0), Status::ok);
  ASSERT_EQ(batch.solve().status, Status::ok);
  const double k = 0.5 / 1.25, x0 = (1 + 2 * k) / (1 + 0.3 * k), miss = 3 - 1 - 0.3 * x0;
  EXPECT_NEAR(batch.x(0)(0), x0, 1e-9);
  EXPECT_NEAR(batch.x(1)(0), x0 + 0.3 * x0 + 0.5 / 1.25 * miss, 1e-9);
}

}  // namespace
