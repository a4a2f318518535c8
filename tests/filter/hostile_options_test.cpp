// SPDX-License-Identifier: BSD-3-Clause
// Options that are no options, each at both ends of its type: refused by a status before anything is computed
// from them, or, where a bound is only large, harmless. For a compiler with -fsanitize=undefined,address too.
#include <gtest/gtest.h>

#include <jml/jml.hpp>
#include <limits>

namespace {

using jml::Status, jml::usable;
template <int n>
using Vec = jml::Vector<double, n>;
template <int rows, int cols>
using Mat = jml::Matrix<double, rows, cols>;

constexpr int most = std::numeric_limits<int>::max(), least = std::numeric_limits<int>::min();
constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinite = std::numeric_limits<double>::infinity();
constexpr double no_numbers[] = {nan, infinite, -infinite, -1.0, 1e308, -1e308};

template <bool says_linear>
struct Drift {
  static constexpr int states = 1, disturbances = 1;
  static constexpr bool linear = says_linear;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(0.9 * x(0) + (says_linear ? 0 : 0.1) * x(0) * x(0));
  }
  Mat<1, 1> disturbance_covariance() const { return Mat<1, 1>(0.1); }
};
template <bool says_linear>
struct Position {
  static constexpr int measurements = 1;
  static constexpr bool linear = says_linear;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  Mat<1, 1> noise_covariance() const { return Mat<1, 1>(0.2); }
};
using Bent = Drift<false>;
using Straight = Drift<true>;
const jml::Estimate<double, 1> start{0.5, 1.0};

TEST(HostileOptions, Iterations) {
  const auto step = [](const jml::IterationOptions& options) {
    jml::Filter exact{jml::IteratedJml{options}, Bent{}, start};
    jml::Filter once{jml::Iekf{options}, Bent{}, start};
    jml::Filter factored{jml::Factored{jml::Iekf{options}}, Bent{}, start};
    const Status status = exact.step(Position<false>{}, 1.0).status;
    EXPECT_EQ(once.step(Position<false>{}, 1.0).status, status);
    EXPECT_EQ(factored.step(Position<false>{}, 1.0).status, status);
    return status;
  };
  for (const int bad : {least, -1, 0}) EXPECT_EQ(step({.max_iterations = bad}), Status::invalid_option);
  for (const int bad : {least, -1}) EXPECT_EQ(step({.max_newton = bad}), Status::invalid_option);
  for (const double bad : no_numbers) EXPECT_EQ(step({.tolerance = bad}), Status::invalid_option) << bad;
  for (const auto method :
       {jml::Iteration::anderson, jml::Iteration::newton, jml::Iteration::picard, jml::Iteration::none})
    EXPECT_EQ(step({.method = method, .max_iterations = most, .max_newton = most}), Status::ok);
  for (const int bound : {least, -1, 0, most}) {
    jml::IteratedJml rule{jml::IterationOptions{.method = jml::Iteration::none}};
    rule.fallback.max_iterations = bound;
    jml::Filter filter{rule, Bent{}, start};
    EXPECT_EQ(filter.step(Position<false>{}, 1.0).status, Status::ok)
        << "Newton follows, from where it begins";
  }
}

template <bool linear>
void intervals() {
  using D = Drift<linear>;
  using S = Position<linear>;
  const auto lagged = [](const jml::LagOptions& options) {
    jml::Filter lag{jml::FixedLag<3>{options}, D{}, jml::sensors<S>, start};
    Status status = Status::ok;
    for (int k = 0; k < 5; ++k) {
      status = lag.step(S{}, 1.0 + k).status;
      EXPECT_EQ(lag.depth(), usable(status) ? std::min(k + 1, 3) : 0);
    }
    return status;
  };
  const auto solved = [](const jml::BatchOptions& options) {
    jml::Batch batch{D{}, jml::sensors<S>, start, {.steps = 5}};
    for (int k = 0; k < 5; ++k) EXPECT_EQ(batch.step(S{}, 1.0 + k).status, Status::ok);
    batch.options = options;
    return batch.solve().status;
  };
  for (const int bad : {least, -1, 0}) {
    EXPECT_EQ(lagged({.sweeps = bad}), Status::invalid_option);
    EXPECT_EQ(solved({.max_iterations = bad}), Status::invalid_option);
  }
  for (const double bad : no_numbers) {
    EXPECT_EQ(lagged({.tolerance = bad}), Status::invalid_option) << bad;
    EXPECT_EQ(solved({.tolerance = bad}), Status::invalid_option) << bad;
    for (const auto loss : {jml::Loss::huber(bad), jml::Loss::cauchy(bad)}) {
      EXPECT_EQ(lagged({.loss = loss}), Status::invalid_option) << bad;
      EXPECT_EQ(solved({.loss = loss}), Status::invalid_option) << bad;
    }
  }
  for (const double tolerance : {0.0, 1e-300, 1e-7}) {
    EXPECT_TRUE(usable(lagged({.sweeps = most, .tolerance = tolerance})));
    EXPECT_TRUE(usable(solved({.max_iterations = most, .tolerance = tolerance})));
  }
}
TEST(HostileOptions, IntervalsOfALinearModel) { intervals<true>(); }
TEST(HostileOptions, IntervalsOfAnother) { intervals<false>(); }

// A minimum that is none: |x| against a negative y, sought without end.
struct Kink {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(jml::plain_value(x(0)) < 0 ? T(-x(0)) : T(x(0)));
  }
  Mat<1, 1> noise_covariance() const { return Mat<1, 1>(1e-12); }
};
TEST(HostileOptions, ABoundThatIsNoneComesToAnEnd) {
  for (const double y : {-0.2, -5.0}) {
    jml::Filter lag{jml::FixedLag<3>{{.sweeps = most}}, Bent{}, jml::sensors<Kink>, start};
    for (int k = 0; k < 5; ++k) (void)lag.step(Kink{}, y);
    jml::Batch batch{Bent{}, jml::sensors<Kink>, start, {.steps = 3}};
    for (int k = 0; k < 3; ++k) EXPECT_EQ(batch.step(Kink{}, y).status, Status::ok);
    batch.options.max_iterations = most;
    (void)batch.solve();
    jml::Filter exact{jml::IteratedJml{jml::IterationOptions{.max_iterations = 1000, .max_newton = most}},
                      Bent{}, start};
    (void)exact.step(Kink{}, y);
    EXPECT_TRUE(jml::all_finite(lag.x()) && jml::all_finite(exact.x()));
  }
}

// More memory than there is, is no memory.
TEST(HostileOptions, Capacities) {
  const auto batch = [](const jml::Capacity& capacity) {
    return jml::Batch{Bent{}, jml::sensors<Position<false>>, start, capacity}.status();
  };
  for (const int bad : {least, -1, most, most - 1})
    EXPECT_EQ(batch({.steps = bad}), Status::invalid_option) << bad;
  for (const int bad : {least, -2}) EXPECT_EQ(batch({3, bad}), Status::invalid_option) << bad;
  EXPECT_EQ(batch({0, 0}), Status::ok);
#ifndef __SANITIZE_ADDRESS__              // which ends the program where there is no memory
  const Status large = batch({3, most});  // 50 GB, which some machine may have
  EXPECT_TRUE(large == Status::ok || large == Status::invalid_option) << jml::describe(large);
#endif
  const jml::Filter filter{jml::Ekf{}, Bent{}, start};
  for (const int capacity : {least, -1, 0, most}) {
    jml::Smoother smoother{filter, capacity};
    EXPECT_EQ(smoother.status(), capacity == most ? Status::invalid_option : Status::ok);
    EXPECT_EQ(smoother.predict(), capacity == most ? Status::invalid_option : Status::memory_full);
  }
}

struct Flowing {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  double rate = -0.5;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(rate * x(0));
  }
  Mat<1, 1> disturbance_spectral_density() const { return Mat<1, 1>(0.1); }
};
struct FlowingFloat {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1, disturbances = 1;
  float rate = -0.5F;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(rate * x(0));
  }
  jml::Matrix<float, 1, 1> disturbance_spectral_density() const { return jml::Matrix<float, 1, 1>(0.1F); }
};
struct Seen {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  Mat<1, 1> noise_spectral_density() const { return Mat<1, 1>(0.2); }
};
TEST(HostileOptions, Integrators) {
  const auto step = [](const auto& integrator) {
    jml::Filter filter{jml::Continuous{jml::Ekf{}, integrator}, Flowing{}, start};
    const Status status = filter.step(Seen{}, 1.0, 0.1).status;
    EXPECT_EQ(filter.predict(0.1), status);
    return status;
  };
  for (const int bad : {least, -1, 0}) {
    EXPECT_EQ(step(jml::RungeKutta4{bad}), Status::invalid_option);
    EXPECT_EQ(step(jml::DavisonMaki{.substeps = bad}), Status::invalid_option);
    EXPECT_EQ(step(jml::DavisonMaki{.max_pieces = bad}), Status::invalid_option);
    jml::Filter factored{jml::Factored{jml::Continuous{jml::Ekf{}, jml::RungeKutta4{bad}}}, Flowing{}, start};
    EXPECT_EQ(factored.step(Seen{}, 1.0, 0.1).status, Status::invalid_option);
  }
  EXPECT_EQ(step(jml::DavisonMaki{.max_pieces = most}), Status::ok);
  // As many pieces as an int can count, or one more: P overflows in the first hundred of them.
  for (const double rate : {1e9, 1e10, 1e308}) {
    jml::Filter fast{jml::Continuous{jml::Ekf{}, jml::DavisonMaki{.max_pieces = most}}, Flowing{rate}, start};
    EXPECT_FALSE(usable(fast.predict(1.0)));
    EXPECT_EQ(fast.x()(0), 0.5);
    const jml::Estimate<float, 1> single{jml::Vector<float, 1>(0.5F), jml::Matrix<float, 1, 1>(1.0F)};
    for (const float share : {0.5F, 0.99F, 1.0F, 2.0F, 2.147483648F, 4.0F}) {
      jml::Filter coarse{jml::Continuous{jml::Ekf{}, jml::DavisonMaki{.max_pieces = most}},
                         FlowingFloat{share * static_cast<float>(std::min(rate, 1e10))}, single};
      EXPECT_FALSE(usable(coarse.predict(1.0F)));
    }
  }
}

TEST(HostileOptions, AlgebraicSubsteps) {
  for (const int bad : {least, -1, 0, (1 << 29), most}) {
    const jml::AlgebraicOptions options{.substeps = bad};
    jml::Filter filter{jml::Algebraic{jml::Sddre{}, options}, Flowing{}, Vec<1>(0.5)};
    EXPECT_EQ(filter.status(), Status::invalid_option) << bad;
    jml::Filter later{jml::Algebraic{jml::Sddre{}}, Flowing{}, Vec<1>(0.5)};
    later.method().options = options;
    EXPECT_EQ(later.step(Seen{}, 1.0, 0.1).status, Status::invalid_option) << bad;
    EXPECT_EQ(later.predict(0.1), Status::invalid_option) << bad;
  }
}

TEST(HostileOptions, GatesRowsAndAges) {
  jml::Filter filter{jml::Ekf{}, Bent{}, start};
  jml::Filter lag{jml::FixedLag<3>{}, Bent{}, jml::sensors<Position<false>>, start};
  for (const double bad : {nan, infinite, -infinite, -1.0, 0.0, 1e308}) {
    filter.gate.probability = lag.gate.probability = bad;
    EXPECT_EQ(filter.update(Position<false>{}, 1.0).status, Status::invalid_option) << bad;
    EXPECT_EQ(lag.update(Position<false>{}, 1.0).status, Status::invalid_option) << bad;
  }
  filter.gate = lag.gate = {};
  for (const long long row : {-1LL, 1LL, 63LL, 64LL, 1LL << 32, std::numeric_limits<long long>::max(),
                              std::numeric_limits<long long>::min(), static_cast<long long>(most)})
    EXPECT_EQ(filter.update(Position<false>{}, 1.0, jml::only(row)).status, Status::invalid_measurement)
        << row;
  EXPECT_EQ(
      filter.update(Position<false>{}, 1.0, jml::only(std::numeric_limits<std::uint64_t>::max())).status,
      Status::invalid_measurement);
  for (const int count : {most, 2})
    EXPECT_EQ(filter.update(Position<false>{}, 1.0, jml::first(count)).status, Status::invalid_measurement);
  for (const int count : {least, -1, 0})
    EXPECT_EQ(filter.update(Position<false>{}, 1.0, jml::first(count)).degrees, 0);
  for (const int age : {least, -1})
    EXPECT_EQ(lag.update(Position<false>{}, 1.0, jml::age(age)).status, Status::invalid_option);
  EXPECT_EQ(lag.update(Position<false>{}, 1.0, jml::age(most)).status, Status::older_than_window);
  for (const double time : {nan, infinite, -infinite, 1e308}) {
    EXPECT_EQ(lag.update(Position<false>{}, 1.0, jml::at_time(time)).status, Status::invalid_time_step);
    EXPECT_FALSE(usable(lag.predict(jml::at_time(std::isfinite(time) ? -time : time))));
  }
  EXPECT_EQ(lag.update(Position<false>{}, 1.0, jml::at_time(-1e308)).status, Status::older_than_window);
  EXPECT_EQ(filter.inflate(Vec<1>(nan)), Status::invalid_option);
  for (const int state : {least, -1, 1, most})
    EXPECT_EQ(filter.reset_variance(state, 1.0), Status::invalid_option);
}

// The row S18: a sine over a box of 2e10 turns.
struct Swing {
  static constexpr int states = 2, disturbances = 0;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    using std::sin, std::cos, std::tan;
    return {x(0) + 0.1 * x(1), x(1) - 0.1 * sin(x(0)) + 0.01 * cos(x(1)) + 1e-3 * tan(x(1))};
  }
};
struct Angle {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    return jml::Vector<T, 1>(x(0));
  }
  Vec<1> noise_bound() const { return Vec<1>(0.1); }
};
TEST(HostileOptions, Boxes) {
  for (const double large : {1e8, 1e10, 1e18, 1e150, 1e308, infinite, nan}) {
    for (const double other : {large, 1.0}) {
      const Vec<2> lower(-large, -other), upper(large, other);
      jml::Filter forward{jml::Guaranteed{}, Swing{}, jml::Box<double, 2>{lower, upper}};
      (void)forward.step(Angle{}, 0.5);
      (void)forward.predict();
      jml::Filter inside_out{jml::Guaranteed{}, Swing{}, jml::Box<double, 2>{upper, lower}};
      EXPECT_FALSE(usable(inside_out.status())) << large;
      EXPECT_FALSE(usable(inside_out.step(Angle{}, 0.5).status));
    }
  }
}

}  // namespace
