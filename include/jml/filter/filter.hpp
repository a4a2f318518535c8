// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filter: a method, a model, and a belief that moves from sample to sample. Time, control, gate, status
/// and the last good belief are kept here, once for every method.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/filter_core.hpp>
#include <jml/filter/local_method.hpp>
#include <jml/model/sensors.hpp>
#include <utility>

namespace jml {
namespace detail {
template <typename Scalar, int n>
struct Loosening;  // filter/way_out.hpp

/// Two things after the dynamics that are neither a start and its time nor a list of sensors and a start.
template <typename A, typename B>
concept NoStart = !std::is_convertible_v<const B&, double> && !is_list_of_sensors<A>;
}  // namespace detail

/// A recursive estimator.
///
///     jml::Filter filter{jml::Ekf{}, VanDerPol{}, jml::Estimate{x0, P0}};
///     const auto report = filter.step(SaturatingPosition{}, y);
///
/// M: a rule of Table 1 (Kalman, Ekf, Sddre, Jml), Iekf, IteratedJml, FixedLag, Continuous, Algebraic,
/// Linearised, Guaranteed, Paved, or your own (filter/method.hpp). A refusal leaves belief and time as they
/// were. Refused by all: invalid_time_step, invalid_control, invalid_measurement, dynamics_not_finite,
/// sensor_not_finite, and a Q, R or bound that is none, by its name; what else, the method says. Fixed size,
/// no heap (but a recorder's constructor and CVODE's), no exceptions; objects are independent.
template <typename M, typename D, typename Scalar = double>
class Filter {
  static_assert(detail::require_method<typename MethodOf<M>::type>() && detail::require_dynamics<D>());
  static_assert(detail::require_accepted<typename MethodOf<M>::type, D>());
  using Core = detail::FilterCore<M, D, Scalar>;
  using Method = typename Core::Method;

 public:
  using Belief = typename Core::Belief;  ///< of the method: what moves from sample to sample
  static constexpr int states = DynamicsTraits<D>::states;  ///< numbers of x, n
  static constexpr int degrees = degrees_of<D>;         ///< of freedom: `states`, but for states in a space
  using State = Vector<Scalar, states>;                 ///< a state, n
  using Covariance = Matrix<Scalar, degrees, degrees>;  ///< of the errors of x
  using Control = typename Core::Control;               ///< u, as the dynamics say; of size 0: none
  using At = typename Core::At;                         ///< time, dt and control, as a model is given them
  template <typename S>
  using Report = typename Core::template Report<S>;  ///< of a measurement by S
  template <typename S>
  using Measurement = typename Core::template Measurement<S>;  ///< of S: a Vector of p, a number where p = 1

  /// `start`: what the method makes its belief of: an Estimate{x, P}, a Box, a state (its docstring says what
  /// is refused). `time`: s, of `start`. A bad one does not throw: status() names it, and every verb answers
  /// it until reset() gives a good one.
  template <typename Start = typename detail::StartOf<Method, Scalar, D>::type>
  Filter(M method, D dynamics, const Start& start, double time = 0) : core_(std::move(method), dynamics) {
    reset(start, time);
  }
  /// A method that needs no start, as a box that the first measurements make.
  Filter(M method, D dynamics) : core_(std::move(method), dynamics) {
    static_assert(
        requires { core_.method.start(core_.model, core_.belief); },
        "jml: this method needs to know where to start: give the filter an estimate");
    core_.status = core_.method.start(core_.model, core_.belief);
  }
  /// Something else: refused in words.
  template <typename A, typename B>
    requires detail::NoStart<A, B>
  Filter(M method, D dynamics, const A&, const B&) : core_(std::move(method), dynamics) {
    static_assert(
        !sizeof(A*),
        "jml: a filter is made as Filter{method, dynamics, start}, with jml::sensors<…> before the "
        "start where the method remembers; a start is jml::Estimate{x, P} or jml::Box{lower, upper}");
  }
  /// A method with a memory for measurements: `list` is `jml::sensors<…>`, the types of all sensors.
  template <typename Bare, typename... S, typename Start>
    requires std::is_same_v<typename Bare::template With<Sensors<S...>>, M>
  Filter(const Bare& method, D dynamics, Sensors<S...>, const Start& start, double time = 0)
      : Filter(M(method), std::move(dynamics), start, time) {}

  /// Innovation gate for every measurement; off by default. Methods without an innovation matrix do not read
  /// it.
  Gate gate;

  /// Starts again.
  template <typename Start = typename detail::StartOf<Method, Scalar, D>::type>
  Status reset(const Start& start, double time) {
    core_.start(start, time);
    return core_.status;
  }

  // A way out of a refusal (covariance_lost, or a gate that has shut) that keeps x; of methods with a P that
  // can be changed. For these include jml/filter/way_out.hpp (jml.hpp does).
  /// P ← P + diag(variances), n, ≥ 0, units of x². A window begins anew at the present. invalid_option: a
  /// negative entry or a NaN. Nothing is changed on refusal.
  [[nodiscard]] Status inflate(const Argument<Scalar, degrees>& variances) {
    detail::Loosening<Scalar, degrees> by;
    by.added = variances;
    return core_.status == Status::ok ? loosen(core_.belief, by, time()) : core_.status;
  }
  /// P_ii = variance, ≥ 0, units of x_i² (a factored filter takes an infinite one), and no covariance with
  /// the other states. invalid_option: no such state, or a variance that is none.
  [[nodiscard]] Status reset_variance(int state, Scalar variance) {
    if (core_.status != Status::ok) return core_.status;
    if (state < 0 || state >= degrees) return Status::invalid_option;
    detail::Loosening<Scalar, degrees> by;
    by.kept(state) = Scalar(0);
    by.added(state) = variance;
    return loosen(core_.belief, by, time());
  }

  /// P ← S P S + diag(variances), S = diag(factors), n, ≥ 0: every covariance of state i times factors(i). A
  /// P stays one. invalid_option: a factor or variance that is none.
  [[nodiscard]] Status rescale(const Argument<Scalar, degrees>& factors,
                               const Argument<Scalar, degrees>& variances) {
    detail::Loosening<Scalar, degrees> by;
    by.kept = factors;
    by.added = variances;
    return core_.status == Status::ok ? loosen(core_.belief, by, time()) : core_.status;
  }

  /// Other parameters of the dynamics (Q, a coefficient) from here on; x and P stay. A constant Q or G that
  /// is none is refused (invalid_disturbance_covariance), and the old ones stay. A window begins anew.
  [[nodiscard]] Status retune(const D& dynamics) { return core_.retune(dynamics); }

  /// Predict over dt and correct with y, the measurement at its end. y: p entries, or a number where p = 1.
  /// dt: s, zero or positive, or at_time(t); a model that reads neither dt nor time may leave it out.
  /// control: held over the step. After a refusal the filter still stands at its old time: predict(dt) to go
  /// on without the measurement.
  template <typename S, typename Step = NoTime>
  [[nodiscard]] Report<S> step(const S& sensor, const Measurement<S>& y, const Step& dt = {},
                               const Control& control = kernel::zeros<Control>()) {
    static_assert(detail::require_accepted_sensor<Method, S>());
    static_assert(detail::look_at_dynamics<Method, Scalar, D>());
    static_assert(detail::look_at_sensor<Method, Scalar, D, S>());
    static_assert(!std::is_same_v<Step, NoTime> ||
                      (!reads_context<Scalar, D>() && !sensor_reads_context<S, State, At>()),
                  "jml: this model reads time, dt or control: pass dt, step(sensor, y, dt)");
    if constexpr (Sensor<S>)
      return core_.template step<S>(sensor, Core::measured(sensor, y), core_.length(dt), control, gate);
    else
      return {};
  }

  /// Of a continuous method: y a jml::Line, or any function double → Vector of p of the absolute time, smooth
  /// over the step.
  template <typename S, Signal<Scalar, SensorTraits<S>::measurements> Y, typename Step>
  [[nodiscard]] Report<S> step(const S& sensor, const Y& y, const Step& dt,
                               const Control& control = kernel::zeros<Control>()) {
    static_assert(detail::require_accepted_sensor<Method, S>());
    static_assert(detail::look_at_sensor<Method, Scalar, D, S>());
    static_assert(
        ContinuousDynamics<D>,
        "jml: a jml::Line or a function of time is what a continuous filter measures; to a discrete "
        "one give y, a jml::Vector or a number");
    if constexpr (ContinuousDynamics<D> && Sensor<S>)
      return core_.template step<S>(sensor, y, core_.length(dt), control, gate);
    else
      return {};
  }

  /// A step without a measurement.
  template <typename Step = NoTime>
  [[nodiscard]] Status predict(const Step& dt = {}, const Control& control = kernel::zeros<Control>()) {
    static_assert(detail::look_at_dynamics<Method, Scalar, D>());
    static_assert(!std::is_same_v<Step, NoTime> || !reads_context<Scalar, D>(),
                  "jml: this model reads time, dt or control: pass dt, predict(dt)");
    return core_.predict(core_.length(dt), control);
  }

  /// Correct with a measurement of the present time: a second sensor, or after predict(). A sensor that reads
  /// the control sees that of the last step. `which`: in any order
  ///   only(0, 2), first(k), finite_rows(y)   the rows of y that were measured; nothing else of y is read
  ///   at_time(t)    when y was taken, s: the present, or earlier, where the method takes late measurements
  ///   age(k)        the same, k steps ago
  /// A time too old for the method: older_than_window. One that has not come yet: invalid_time_step.
  template <typename S, typename... Which>
  [[nodiscard]] Report<S> update(const S& sensor, const Measurement<S>& y, const Which&... which) {
    static_assert(detail::require_accepted_sensor<Method, S>());
    static_assert(detail::look_at_sensor<Method, Scalar, D, S>());
    if constexpr (!Sensor<S>) {
      return {};
    } else if constexpr ((std::is_same_v<Which, Rows> || ...)) {
      static_assert((0 + ... + std::is_same_v<Which, Rows>) == 1, "jml: one set of rows, please");
      static_assert(detail::require_accepted_sensor<Method, Part<S>>());
      return core_.template correct<S>(part(sensor, std::get<Rows>(std::tuple(which...))), y, gate, which...);
    } else {
      return core_.template correct<S>(sensor, y, gate, which...);
    }
  }

  [[nodiscard]] Status status() const { return core_.status; }  ///< of the start and the model's constants
  [[nodiscard]] double time() const { return core_.clock.time(); }     ///< s
  [[nodiscard]] const Belief& belief() const { return core_.belief; }  ///< of the present
  /// As they were given, or retuned.
  [[nodiscard]] const D& dynamics() const {
    if constexpr (Core::rolls_back)
      return core_.belief.dynamics();
    else if constexpr (requires { core_.model.dynamics.model; })
      return core_.model.dynamics.model;
    else
      return core_.model.dynamics;
  }
  /// A rule of Table 1, or another method.
  [[nodiscard]] const Method& method() const { return core_.method; }
  [[nodiscard]] Method& method() { return core_.method; }  ///< for its options

  /// The estimate of the present state.
  [[nodiscard]] decltype(auto) x() const {
    if constexpr (requires { core_.belief.x(); })
      return core_.belief.x();
    else
      return (core_.belief.x);
  }
  /// Its Riccati matrix, n×n: of a symmetric rule the covariance, to first order.
  [[nodiscard]] decltype(auto) P() const
    requires detail::HasRiccati<Belief>
  {
    if constexpr (requires { core_.belief.P(); })
      return core_.belief.P();
    else
      return (core_.belief.P);
  }
  /// x() and P().
  [[nodiscard]] decltype(auto) estimate() const
    requires detail::HasRiccati<Belief>
  {
    if constexpr (std::is_base_of_v<Estimate<Scalar, states>, Belief>)
      return static_cast<const Estimate<Scalar, states>&>(core_.belief);
    else
      return Estimate<Scalar, states, degrees>{x(), P()};
  }
  /// Of a method that remembers: the state `age` steps ago, 0 … depth().
  [[nodiscard]] decltype(auto) x(int age) const
    requires detail::HasAges<Belief>
  {
    return core_.belief.x(age);
  }
  /// Likewise, its covariance.
  [[nodiscard]] Covariance P(int age) const
    requires detail::HasAges<Belief>
  {
    return core_.belief.P(age);
  }
  /// Likewise, its time, s.
  [[nodiscard]] double time(int age) const
    requires detail::HasAges<Belief>
  {
    return core_.belief.time(age);
  }
  /// Of a method that remembers: how many steps back its memory goes now.
  [[nodiscard]] int depth() const
    requires detail::HasAges<Belief>
  {
    return core_.belief.depth();
  }
  /// Of a method that carries a box: the states that are possible.
  [[nodiscard]] decltype(auto) box() const
    requires requires(const Belief& b) { b.box; }
  {
    return (core_.belief.box);
  }
  /// Of a union of boxes: its parts, as long as the filter stays as it is.
  [[nodiscard]] auto parts() const
    requires requires(const Belief& b) { b.parts(); }
  {
    return core_.belief.parts();
  }

 protected:
  Belief& mutable_belief() { return core_.belief; }  ///< for what is built upon a filter

 private:
  friend struct PartsOf<Filter>;
  Core core_;
};

/// All that changes in a filter: see filter/save.hpp.
template <typename M, typename D, typename Scalar>
struct PartsOf<Filter<M, D, Scalar>> {
  static auto each(auto& filter, auto&& f) { return f(filter.gate, filter.core_); }
};

/// Types from the arguments.
/// @{
template <typename M, typename D, typename Start>
Filter(M, D, const Start&, double = 0) -> Filter<M, D, detail::ScalarOf<Start>>;
template <typename M, typename D, typename A, typename B>
  requires detail::NoStart<A, B>
Filter(M, D, const A&, const B&) -> Filter<M, D, double>;
template <typename M, typename D>
Filter(M, D) -> Filter<M, D, double>;
template <typename M, typename D, typename... S, typename Start>
Filter(M, D, Sensors<S...>, const Start&, double = 0)
    -> Filter<typename M::template With<Sensors<S...>>, D, detail::ScalarOf<Start>>;
/// @}

}  // namespace jml
#include <jml/warnings_end.hpp>
