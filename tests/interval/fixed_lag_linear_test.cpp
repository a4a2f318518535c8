// SPDX-License-Identifier: BSD-3-Clause
// On a linear system a fixed-lag filter of any length is the Kalman filter, and its older states are the
// fixed-lag smoother. The oracle keeps the joint Gaussian of all states so far, dense and in long double.
#include <gtest/gtest.h>

#include <cstdio>
#include <jml/filter/filter.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <optional>
#include <vector>

#include "models/linear.hpp"
#include "riccati/oracle.hpp"

namespace {

using namespace jml::operators;

using oracle::big;
using oracle::Big;

/// N(mean, covariance) of x_0 … x_k stacked, given the data so far. A measurement conditions all of them at
/// once: no recursion over time, no root, no inverse but that of S.
class JointGaussian {
 public:
  JointGaussian(const Big& x, const Big& P) : n_(x.rows()), mean_(x), covariance_(P) {}

  /// Appends x_{k+1} = F x_k + push + N(0, noise).
  void predict(const Big& F, const Big& push, const Big& noise) {
    const Eigen::Index old = mean_.rows();
    const Big cross = F * covariance_.bottomRows(n_);
    const Big next = F * mean_.bottomRows(n_) + push;
    const Big P = cross.rightCols(n_) * F.transpose() + noise;
    mean_.conservativeResize(old + n_, 1);
    covariance_.conservativeResize(old + n_, old + n_);
    mean_.bottomRows(n_) = next;
    covariance_.bottomLeftCorner(n_, old) = cross;
    covariance_.topRightCorner(old, n_) = cross.transpose();
    covariance_.bottomRightCorner(n_, n_) = P;
  }
  /// y = M x_k + N(0, R).
  void measure(const Big& M, const Big& R, const Big& y) {
    const Big PM = covariance_.rightCols(n_) * M.transpose();
    const Big gain = PM * oracle::inverse(M * PM.bottomRows(n_) + R);
    mean_ += Big(gain * Big(y - M * mean_.bottomRows(n_)));
    covariance_ -= Big(gain * PM.transpose());
  }
  [[nodiscard]] Big x(int age) const { return mean_.middleRows(start(age), n_); }
  [[nodiscard]] Big P(int age) const { return covariance_.block(start(age), start(age), n_, n_); }

 private:
  [[nodiscard]] Eigen::Index start(int age) const { return mean_.rows() - (age + 1) * n_; }

  Eigen::Index n_;
  Big mean_, covariance_;
};

/// What happens in one step: over `dt` under `control`, then up to one measurement of each sensor.
template <int p, int r>
struct Event {
  double dt = 0;
  jml::Vector<double, 1> control{0};
  std::optional<jml::Vector<double, p>> first;
  std::optional<jml::Vector<double, r>> second;
};

/// Linear, and everything in it moves: f reads dt and the control, G, Q and w̄ read time, dt and control. One
/// disturbance: G Q Gᵀ has rank one.
struct Driven {
  static constexpr int states = 3, disturbances = 1, controls = 1;
  static constexpr bool linear = true;

  static jml::Matrix<double, 3, 3> F(const auto& at) {
    jml::Matrix<double, 3, 3> A;
    A << -0.3, 1, 0.2, -1.5, -0.2, 0.4, 0.1, -0.6, -0.5;
    return jml::Matrix<double, 3, 3>::Identity() + at.dt * A;
  }
  static jml::Vector<double, 3> push(const auto& at) {
    return at.dt * at.control(0) * jml::Vector<double, 3>(0.2, -1, 0.5);
  }
  template <typename T>
  jml::Vector<T, 3> dynamics(const jml::Vector<T, 3>& x, const auto& at) const {
    return F(at).template cast<T>() * x + push(at).template cast<T>();
  }
  template <typename T>
  jml::Matrix<T, 3, 3> dynamics_jacobian(const jml::Vector<T, 3>&, const auto& at) const {
    return F(at).template cast<T>();
  }
  jml::Matrix<double, 3, 1> disturbance_input(const jml::Vector<double, 3>&, const auto& at) const {
    return {0.1, 1 + 0.3 * std::sin(at.time), -0.4};
  }
  jml::Matrix<double, 1, 1> disturbance_covariance(const jml::Vector<double, 3>&, const auto& at) const {
    return jml::Matrix<double, 1, 1>(0.5 * at.dt);
  }
  jml::Vector<double, 1> disturbance_mean(const jml::Vector<double, 3>&, const auto& at) const {
    return jml::Vector<double, 1>(0.3 * at.dt - 0.2 * at.control(0));
  }
};

/// y = M(t) x + v, with t the time of the sample.
struct Turning {
  static constexpr int measurements = 2;
  static constexpr bool linear = true;
  jml::Matrix<double, 2, 2> R = (jml::Matrix<double, 2, 2>() << 0.05, 0.02, 0.02, 0.08).finished();

  static jml::Matrix<double, 2, 3> M(const auto& at) {
    jml::Matrix<double, 2, 3> M;
    M << std::cos(at.time), std::sin(at.time), 0.3, -0.5, 0.2, 1;
    return M;
  }
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 3>& x, const auto& at) const {
    return M(at).template cast<T>() * x;
  }
  jml::Matrix<double, 2, 2> noise_covariance() const { return R; }
};

/// Beside the library: F, G w̄ + push, G Q Gᵀ and M as plain matrices.
template <int n, int q>
void predict(JointGaussian& joint, const models::LinearDynamics<n, q>& d, const jml::StepContext<double, 1>&) {
  joint.predict(big(d.F), Big::Zero(n, 1), big(d.G) * big(d.Q) * big(d.G).transpose());
}
void predict(JointGaussian& joint, const Driven& d, const jml::StepContext<double, 1>& at) {
  const jml::Vector<double, 3> anywhere = jml::Vector<double, 3>::Zero();
  const Big G = big(d.disturbance_input(anywhere, at)), w = big(d.disturbance_mean(anywhere, at));
  joint.predict(big(Driven::F(at)), big(Driven::push(at)) + G * w,
                G * big(d.disturbance_covariance(anywhere, at)) * G.transpose());
}
template <int n, int p>
Big row(const models::LinearSensor<n, p>& s, double) {
  return big(s.M);
}
Big row(const Turning&, double time) { return big(Turning::M(jml::StepContext<double>{.time = time})); }

struct Worst {
  double x = 0, P = 0;  // newest, against the Kalman filter
  double x_old = 0, P_old = 0;
};

/// Runs `events` through a window of L steps, and compares after each.
template <int L, typename D, typename First, typename Second, int n, int p, int r>
Worst run(const D& dynamics, const First& first, const Second& second, const jml::Estimate<double, n>& start,
          const std::vector<Event<p, r>>& events, double time) {
  jml::Filter lagged{jml::FixedLag<L>{}, dynamics, jml::sensors<First, Second>, start, time};
  jml::Filter kalman{jml::Kalman{}, dynamics, start, time};
  JointGaussian joint(big(start.x), big(start.P));
  Worst worst;
  double scale = 0;  // largest |x|: an estimate that passes through zero has no relative error
  const auto measure = [&](const auto& sensor, const auto& y) {
    EXPECT_TRUE(jml::usable(lagged.update(sensor, y).status));
    EXPECT_TRUE(jml::usable(kalman.update(sensor, y).status));
    joint.measure(row(sensor, time), big(sensor.R), big(y));
  };
  bool begun = false;
  for (const auto& event : events) {
    if (begun) {  // the first event has no step: it is measured at x_0
      const jml::StepContext<double, 1> at{time, event.dt, event.control};
      predict(joint, dynamics, at);
      time += event.dt;
      const auto control = [&] {
        if constexpr (jml::DynamicsTraits<D>::controls == 1)
          return event.control;
        else
          return jml::Vector<double, 0>();
      }();
      if (event.first) {
        EXPECT_TRUE(jml::usable(lagged.step(first, *event.first, event.dt, control).status));
        EXPECT_TRUE(jml::usable(kalman.step(first, *event.first, event.dt, control).status));
        joint.measure(row(first, time), big(first.R), big(*event.first));
      } else {
        EXPECT_EQ(lagged.predict(event.dt, control), jml::Status::ok);
        EXPECT_EQ(kalman.predict(event.dt, control), jml::Status::ok);
      }
    } else if (event.first) {
      measure(first, *event.first);
    }
    begun = true;
    if (event.second) measure(second, *event.second);
    EXPECT_DOUBLE_EQ(lagged.time(), kalman.time());

    scale = std::max(scale, kalman.x().cwiseAbs().maxCoeff());
    worst.x = std::max(worst.x, (lagged.x() - kalman.x()).cwiseAbs().maxCoeff() / scale);
    worst.P = std::max(worst.P, oracle::distance(lagged.P(), big(kalman.P())));
    for (int age = 0; age <= lagged.depth(); ++age) {
      const Big off = big(lagged.x(age)) - joint.x(age);
      worst.x_old = std::max(worst.x_old, static_cast<double>(off.cwiseAbs().maxCoeff()) / scale);
      worst.P_old = std::max(worst.P_old, oracle::distance(lagged.P(age), joint.P(age)));
    }
  }
  EXPECT_EQ(lagged.depth(), std::min<int>(L, static_cast<int>(events.size()) - 1));
  return worst;
}

template <int L, typename... A>
void expect_exact(const A&... arguments) {
  SCOPED_TRACE(L);
  const Worst worst = run<L>(arguments...);
  std::printf("L = %2d: newest x %.1e, P %.1e; all ages x %.1e, P %.1e\n", L, worst.x, worst.P, worst.x_old,
              worst.P_old);
  EXPECT_LT(worst.x, 1e-12);
  EXPECT_LT(worst.P, 1e-12);
  EXPECT_LT(worst.x_old, 1e-12);
  EXPECT_LT(worst.P_old, 1e-12);
}

/// A third of the measurements is missing, each sensor on its own; the numbers are noise, which is as good as
/// any for an equality.
template <int p, int r>
std::vector<Event<p, r>> random_events(jml::Noise& noise, int steps) {
  std::vector<Event<p, r>> events(static_cast<std::size_t>(steps) + 1);
  for (auto& event : events) {
    event.dt = noise.uniform(0.02, 0.3);
    event.control(0) = noise.uniform(-1, 1);
    const bool first = noise.uniform() < 0.7, second = noise.uniform() < 0.5;
    if (first) event.first = noise.normal_vector<p>();
    if (second) event.second = noise.normal_vector<r>();
  }
  return events;
}

// P_0 = 0 and G Q Gᵀ of rank one, so that P gains its rank step by step; irregular dt, control, time-varying
// G, Q and w̄, a sensor that reads the time.
TEST(FixedLagLinear, EverythingVaries) {
  jml::Noise noise(12);
  const auto first = models::random_linear_sensor<3, 1>(noise);
  jml::Estimate<double, 3> start{{1, -0.5, 0.3}, jml::Matrix<double, 3, 3>::Zero()};
  const auto events = random_events<1, 2>(noise, 60);
  expect_exact<1>(Driven{}, first, Turning{}, start, events, 7.0);
  expect_exact<3>(Driven{}, first, Turning{}, start, events, 7.0);
  expect_exact<8>(Driven{}, first, Turning{}, start, events, 7.0);
  expect_exact<50>(Driven{}, first, Turning{}, start, events, 7.0);
  const jml::Vector<double, 3> along(0.5, 1, -2);
  start.P = along * along.transpose();
  expect_exact<8>(Driven{}, first, Turning{}, start, events, 7.0);
}

// The window is longer than the interval: nothing is ever summed up in the arrival cost.
TEST(FixedLagLinear, LongerThanTheInterval) {
  jml::Noise noise(14);
  const auto first = models::random_linear_sensor<3, 1>(noise);
  const jml::Estimate<double, 3> start{{1, -0.5, 0.3}, models::random_covariance<3>(noise, 0.2)};
  expect_exact<50>(Driven{}, first, Turning{}, start, random_events<1, 2>(noise, 40), 7.0);
}

// A model without time or control, whose Jacobians the library derives.
TEST(FixedLagLinear, ConstantModel) {
  jml::Noise noise(11);
  const auto dynamics = models::random_linear_dynamics<3, 2>(noise);
  const auto first = models::random_linear_sensor<3, 1>(noise);
  const auto second = models::random_linear_sensor<3, 2>(noise);
  const jml::Estimate<double, 3> start{{1, -0.5, 0.3}, models::random_covariance<3>(noise, 0.2)};
  expect_exact<3>(dynamics, first, second, start, random_events<1, 2>(noise, 60), 0.0);
}

// No disturbance at all: a constant to be found, whose window has one unknown.
struct Constant {
  static constexpr int states = 2, disturbances = 0;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return x;
  }
};
void predict(JointGaussian& joint, const Constant&, const jml::StepContext<double, 1>&) {
  joint.predict(Big::Identity(2, 2), Big::Zero(2, 1), Big::Zero(2, 2));
}

TEST(FixedLagLinear, NoDisturbance) {
  jml::Noise noise(13);
  const auto first = models::random_linear_sensor<2, 1>(noise);
  const auto second = models::random_linear_sensor<2, 2>(noise);
  const jml::Estimate<double, 2> start{{1, -0.5}, models::random_covariance<2>(noise, 0.2)};
  expect_exact<3>(Constant{}, first, second, start, random_events<1, 2>(noise, 30), 0.0);
}

}  // namespace
