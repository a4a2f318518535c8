// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One run of a campaign (component jml::campaign): the true states and what the sensor measured, and how to
/// fly any discrete model.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/campaign/counter_noise.hpp>
#include <jml/interval/noise_root.hpp>
#include <jml/model/concepts.hpp>
#include <vector>

namespace jml {

/// What a scenario's fly() fills. The campaign has sized everything and set `dt` and `measured_at_start`.
template <int n, int p, int controls = 0>
struct Flight {
  int steps = 0;                                 ///< k = 0 … steps
  double dt = 0;                                 ///< s, the same for every step
  bool measured_at_start = false;                ///< y[0] counts
  std::vector<Vector<double, n>> truth;          ///< 0 … steps
  std::vector<Vector<double, p>> y;              ///< 1 … steps, and 0 where measured at the start
  std::vector<Vector<double, controls>> control; /**< 0 … steps - 1; [k] is held from sample k to k + 1 */
  /// For the factories of estimators, where the scenario draws an initial guess; never read by the campaign.
  Vector<double, n> guess = kernel::zeros<Vector<double, n>>();

  /// Sizes for `count` steps, everything zero.
  void resize(int count) {
    const auto size = static_cast<std::size_t>(count);
    steps = count;
    truth.assign(size + 1, kernel::zeros<Vector<double, n>>());
    y.assign(size + 1, kernel::zeros<Vector<double, p>>());
    control.assign(size, kernel::zeros<Vector<double, controls>>());
  }
  [[nodiscard]] double time(int k) const { return k * dt; }  ///< s, of sample k
};

/// Normal, with the model's Q (and mean) or R.
struct GaussianNoise {};
/// Uniform between the model's bounds: disturbance_bound(), noise_bound().
struct UniformNoise {};
/// At the one or the other bound, each component with even odds at every step.
struct BangBang {};

namespace detail {

template <typename Kind>
concept BoundedKind = std::is_same_v<Kind, UniformNoise> || std::is_same_v<Kind, BangBang>;

template <typename Kind, int size>
Vector<double, size> within(const Kind&, const Vector<double, size>& bound, CounterNoise& noise) {
  Vector<double, size> out;
  for (int i = 0; i < size; ++i) {
    if constexpr (std::is_same_v<Kind, UniformNoise>)
      out(i) = noise.uniform(-bound(i), bound(i));
    else
      out(i) = noise.uniform() < 0.5 ? -bound(i) : bound(i);
  }
  return out;
}

/// The next true state. One object a flight: what is constant is factored once.
template <typename D, typename Kind>
class TrueDynamics {
  using Traits = DynamicsTraits<D>;
  static constexpr int n = Traits::states, q = Traits::disturbances;
  using X = Vector<double, n>;
  using At = StepContext<double, Traits::controls>;
  using Root = NoiseRoot<double, D>;

 public:
  TrueDynamics(const D& d, const Kind& kind) : d_(d), kind_(kind) {
    if constexpr (std::is_same_v<Kind, GaussianNoise> && Root::constant) form(kernel::zeros<X>(), At{});
  }

  X next(const X& x, const At& at, CounterNoise& noise) {
    if constexpr (q == 0) {
      return dynamics(d_, x, at);
    } else if constexpr (std::is_same_v<Kind, GaussianNoise>) {
      if constexpr (!Root::constant) form(x, at);
      return predicted_state(d_, x, at) + root_.B * noise.template normal_vector<q>();
    } else {
      const Vector<double, q> w = disturbance(x, at, noise);
      return dynamics(d_, x, at) + disturbance_input(d_, x, at) * w;
    }
  }

 private:
  Vector<double, q> disturbance(const X& x, const At& at, CounterNoise& noise) {
    if constexpr (BoundedKind<Kind>) {
      static_assert(
          HasHook<hooks::DisturbanceBound, D, X, At>,
          "jml: a bounded disturbance needs the dynamics' disturbance_bound(), q, as (), (x) or (x, at)");
      return within(kind_, evaluate<hooks::DisturbanceBound, q, 1>(d_, x, at), noise);
    } else {
      return kind_(x, at, noise);
    }
  }
  void form(const X& x, const At& at) {
    if (!root_.form(d_, x, at)) root_.B.setConstant(std::numeric_limits<double>::quiet_NaN());
  }

  const D& d_;
  const Kind& kind_;
  Root root_;
};

/// The next measurement, likewise.
template <typename S, int n, int controls, typename Kind>
class TrueSensor {
  using Traits = SensorTraits<S>;
  static constexpr int p = Traits::measurements;
  using X = Vector<double, n>;
  using At = StepContext<double, controls>;
  static constexpr bool constant = ConstantHook<hooks::NoiseCovariance, S, X, At>;

 public:
  TrueSensor(const S& s, const Kind& kind) : s_(s), kind_(kind) {
    if constexpr (std::is_same_v<Kind, GaussianNoise> && constant) form(kernel::zeros<X>(), At{});
  }

  Vector<double, p> measure(const X& x, const At& at, CounterNoise& noise) {
    if constexpr (std::is_same_v<Kind, GaussianNoise>) {
      if constexpr (!constant) form(x, at);
      return measurement(s_, x, at) + L_ * noise.template normal_vector<p>();
    } else if constexpr (BoundedKind<Kind>) {
      static_assert(HasHook<hooks::NoiseBound, S, X, At>,
                    "jml: bounded noise needs the sensor's noise_bound(), p, as (), (x) or (x, at)");
      const Vector<double, p> v = within(kind_, evaluate<hooks::NoiseBound, p, 1>(s_, x, at), noise);
      return measurement(s_, x, at) + v;
    } else {
      const Vector<double, p> v = kind_(x, at, noise);
      return measurement(s_, x, at) + v;
    }
  }

 private:
  void form(const X& x, const At& at) {
    const Matrix<double, p, p> R = noise_covariance(s_, x, at);
    if (is_covariance(R))
      L_ = kernel::SemidefiniteFactor<double, p>(R).L;
    else
      L_.setConstant(std::numeric_limits<double>::quiet_NaN());
  }

  const S& s_;
  const Kind& kind_;
  Matrix<double, p, p> L_ = kernel::zeros<Matrix<double, p, p>>();
};

}  // namespace detail

/// Fills a flight with a discrete model from x0, n: truth 0 … steps, and y wherever the flight is measured.
/// `disturbance`, `measurement_noise`: GaussianNoise, UniformNoise, BangBang, or a callable
/// (x, at, CounterNoise&) that returns w (q) or v (p). flight.control is read where the model has controls.
/// A Q or R that is no covariance makes the numbers NaN, and so the run a failed one.
template <typename D, typename S, typename W, typename V, int n, int p, int controls>
void simulate(const D& d, const S& s, const Vector<double, n>& x0, const W& disturbance,
              const V& measurement_noise, CounterNoise& noise, Flight<n, p, controls>& flight) {
  static_assert(detail::require_discrete<D>() && detail::require_sensor<S>());
  static_assert(states_of<D> == n && measurements_of<S> == p && DynamicsTraits<D>::controls == controls,
                "jml: the flight has not the states, measurements or controls of the model");
  using At = StepContext<double, controls>;
  detail::TrueDynamics<D, W> dynamics(d, disturbance);
  detail::TrueSensor<S, n, controls, V> sensor(s, measurement_noise);
  flight.truth[0] = x0;
  if (flight.measured_at_start) flight.y[0] = sensor.measure(x0, At{0, flight.dt}, noise);
  for (std::size_t k = 0; k < static_cast<std::size_t>(flight.steps); ++k) {
    At at{flight.time(static_cast<int>(k)), flight.dt, flight.control[k]};
    flight.truth[k + 1] = dynamics.next(flight.truth[k], at, noise);
    at.time = flight.time(static_cast<int>(k) + 1);
    flight.y[k + 1] = sensor.measure(flight.truth[k + 1], at, noise);
  }
}

}  // namespace jml
#include <jml/warnings_end.hpp>
