// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What an estimator has to say to run in jml::Filter: a method is a belief with two verbs.
///
/// A method carries a Belief from sample to sample, and moves it with pure functions: what they read is
/// `prior`, what they answer is `next`. Everything else (time, control, gate, status, the last good belief on
/// refusal) is Filter's. A method of one's own is a struct such as
///
///     struct Mine {
///       template <typename Scalar, jml::Dynamics D> using Belief = jml::Estimate<Scalar, jml::states_of<D>>;
///
///       // Makes a belief of what the user gives to the filter, or says why not.
///       template <typename Model, typename Start, typename Belief>
///       jml::Status start(const Model& model, const Start& start, Belief& belief) const;
///
///       // Over at.dt, with at.control, from at.time.
///       template <typename Model, typename Belief, typename At>
///       jml::Status predict(const Model& model, const Belief& prior, const At& at, Belief& next) const;
///
///       // With one measurement; fills the report: its status is ok at first.
///       template <typename Model, typename Belief, typename Sample, typename Report>
///       void correct(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
///                    Report& report) const;
///     };
///
/// and may say more:
///   Model<Scalar, D>        what the verbs see of the dynamics; default NoisyDynamics. Made from the
///                           dynamics, or from them and the method. A method that keeps a workspace keeps it
///                           there, and takes its model as not const.
///   Report<Scalar, D, S>    default StepReport.
///   Start<Scalar, D>        what {…} means where it starts; default Estimate.
///   step(model, prior, sample, next, report)   one joint step, where predicting and correcting are one thing
///                           or are cheaper together; sample.at is the step's. Default: predict, correct.
///   attempt(model, prior, sample, next, report)   the usual way of step(), which gives up (false) where it
///   is
///                           not enough. For speed alone, with
///   again(model, prior, sample, next, report)   what step() does then, out of its way.
///   accepts<D>(), accepts_sensor<S>()   consteval: static_asserts what a model must be.
///   symmetric               true: P is a covariance, symmetric, no negative variance; check_method() asks.
///   optimal_on_linear       true: it equals the Kalman filter on a linear system; check_method() then asks.
///   correct_late(belief, sensor, y, lateness, report)   of a method with a memory: a measurement of before,
///                           which any other method refuses (older_than_window).
///   RunsOn<Scalar, n>       the numbers on which it runs a model that brings no derivatives, as Dual: for
///                           compile-time errors in jml's words.
///   begins_as_prior         true: `next` arrives as a copy of the prior, for verbs that work in place.
///   rolls_back              true: a belief too large to copy. It holds the dynamics itself, is made from
///                           them, its verbs are predict(belief, at), correct(belief, sample, report) and
///                           step(belief, sample, report), and each restores it on refusal.
///
/// A belief and a method of numbers, matrices and plain structs of them are saved by filter/save.hpp without
/// a word; another class names its parts (image/parts.hpp). A workspace in a Model is not saved.
///
/// Examples, with their tests: examples/write_your_own/.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/estimate.hpp>
#include <jml/filter/report.hpp>
#include <jml/model/part.hpp>
#include <jml/riccati/process_noise.hpp>

namespace jml {

/// The method behind a short spelling, such as a rule of Table 1; by default the type itself.
template <typename M>
struct MethodOf {
  using type = M;  ///< where nobody says otherwise
};

/// A measurement on its way into a belief. Y: a Vector of p; of a continuous method perhaps a Signal.
template <typename S, typename Y, typename At>
struct Sample {
  static constexpr int measurements = SensorTraits<S>::measurements;  ///< p
  const S& sensor;                                                    ///< that measured
  const Y& y;                                                         ///< p numbers, units of the sensor
  const At& at;      ///< of the sample; in a joint step, of the step
  const Gate& gate;  ///< that the report is to be judged by
};
/// Types from the arguments.
/// @{
template <typename S, typename Y, typename At>
Sample(const S&, const Y&, const At&, const Gate&) -> Sample<S, Y, At>;
template <typename S, typename Scalar, int p, typename At>
Sample(const S&, const Argument<Scalar, p>&, const At&, const Gate&) -> Sample<S, Vector<Scalar, p>, At>;
/// @}

/// Dynamics, and G Q Gᵀ, which is formed and checked once where it is a constant.
template <typename Scalar, typename D>
struct NoisyDynamics {
  /// A copy of the dynamics; status() says whether Q and G are good.
  explicit NoisyDynamics(const D& model) : dynamics(model), noise(model) {}

  [[no_unique_address]] D dynamics;  ///< of the user
  ProcessNoise<Scalar, D> noise;     ///< G Q Gᵀ

  /// invalid_disturbance_covariance where a constant Q or G is none.
  [[nodiscard]] Status status() const {
    return noise.valid() ? Status::ok : Status::invalid_disturbance_covariance;
  }
};

/// Dynamics alone, for a method that reads no Q.
template <typename D>
struct PlainDynamics {
  explicit PlainDynamics(const D& model) : dynamics(model) {}  ///< a copy of the dynamics
  [[no_unique_address]] D dynamics;                            ///< of the user
};

namespace detail {

template <typename M, typename Scalar, typename D>
struct ModelOf {
  using type = NoisyDynamics<Scalar, D>;
};
template <typename M, typename Scalar, typename D>
  requires requires { typename M::template Model<Scalar, D>; }
struct ModelOf<M, Scalar, D> {
  using type = typename M::template Model<Scalar, D>;
};

template <typename M, typename Scalar, typename D, typename S>
struct ReportOf {
  using type = StepReport<Scalar, degrees_of<D>, SensorTraits<S>::measurements>;
};
template <typename M, typename Scalar, typename D, typename S>
  requires requires { typename M::template Report<Scalar, D, S>; }
struct ReportOf<M, Scalar, D, S> {
  using type = typename M::template Report<Scalar, D, S>;
};

template <typename M, typename Scalar, typename D>
struct StartOf {
  using type = Estimate<Scalar, DynamicsTraits<D>::states, degrees_of<D>>;
};
template <typename M, typename Scalar, typename D>
  requires requires { typename M::template Start<Scalar, D>; }
struct StartOf<M, Scalar, D> {
  using type = typename M::template Start<Scalar, D>;
};

template <typename M>
consteval bool rolls_back() {
  if constexpr (requires { M::rolls_back; })
    return M::rolls_back;
  else
    return false;
}

template <typename M>
consteval bool begins_as_prior() {
  if constexpr (requires { M::begins_as_prior; })
    return M::begins_as_prior;
  else
    return false;
}

template <typename M>
consteval bool require_method() {
  if constexpr (count_of_states<M>() > 0) {
    using X = Vector<double, count_of_states<M>()>;
    static_assert(!HasHook<hooks::Dynamics, M, X, StepContext<double, controls_of<M>()>>,
                  "jml: a model in place of the method: write jml::Filter{jml::Ekf{}, dynamics, start}");
  }
  return true;
}

template <typename M, typename D>
consteval bool require_accepted() {
  if constexpr (requires { M::template accepts<D>(); }) return M::template accepts<D>();
  return true;
}

/// A function of a model on the numbers that a method also runs it on, where it has no derivative of its own:
/// compiled before that on plain ones, as for what is wrong with both jml has words there.
template <typename M, typename Scalar, int n, typename At, typename Hook, typename... Given, typename Model>
consteval bool look_first(std::type_identity<Model>) {
  using X = Vector<Scalar, n>;
  constexpr bool given =
      (HasHook<Given, Model, X, At> || ...) ||
      (requires(const Model& model, const X& x) { Given::of(model, x, x); } || ...) ||
      (requires(const Model& model, const X& x, const At& at) { Given::of(model, x, x, at); } || ...);
  if constexpr (!given && requires { typename M::template RunsOn<Scalar, n>; }) {
    using Z = Vector<typename M::template RunsOn<Scalar, n>, n>;
    if constexpr (Generic<HookOf<Hook, Model>, Z, At>)
      static_cast<void>(sizeof(look_into<Hook>(std::declval<const Model&>(), std::declval<const Z&>(),
                                               std::declval<const At&>())));
  }
  return true;
}
template <typename M, typename Scalar, typename D>
consteval bool look_at_dynamics() {
  if constexpr (Dynamics<D>)
    return look_first<M, Scalar, DynamicsTraits<D>::states, ContextOf<D, Scalar>, hooks::Dynamics,
                      hooks::DynamicsJacobian, hooks::DynamicsSdc, hooks::DynamicsSdcAbout>(
        std::type_identity<D>());
  return true;
}
template <typename M, typename Scalar, typename D, typename S>
consteval bool look_at_sensor() {
  if constexpr (Dynamics<D> && Sensor<S>)
    return look_first<M, Scalar, DynamicsTraits<D>::states, ContextOf<D, Scalar>, hooks::Measurement,
                      hooks::MeasurementJacobian, hooks::MeasurementSdc, hooks::MeasurementSdcAbout>(
        std::type_identity<S>());
  return true;
}

template <typename M, typename S>
consteval bool require_accepted_sensor() {
  if constexpr (requires { M::template accepts_sensor<S>(); }) return M::template accepts_sensor<S>();
  return require_sensor<S>();
}

template <typename M, typename D>
consteval bool runs_locally();
template <typename Inner, typename D>
struct LocalMethod;  // filter/local_method.hpp
template <typename Inner, typename D>
struct LocalRecord;  // interval/local_record.hpp
template <typename Inner, typename D>
struct LocalSmoother;  // interval/local_smoother.hpp

/// What a method is over states in a space.
template <typename Inner, typename D>
struct LocalFor {
  using type = LocalMethod<Inner, D>;
};

/// M as it runs on D: itself in ℝⁿ.
template <typename M, typename D>
struct MethodFor {
  using type = typename MethodOf<M>::type;
};
template <typename M, typename D>
  requires(runs_locally<typename MethodOf<M>::type, D>())
struct MethodFor<M, D> {
  using Of = typename MethodOf<M>::type;
  static constexpr bool remembers = rolls_back<Of>(), lists = requires { typename Of::SensorList; };
  using Memory = std::conditional_t<lists, LocalRecord<Of, D>, LocalSmoother<Of, D>>;
  using type = typename std::conditional_t<remembers, std::type_identity<Memory>, LocalFor<Of, D>>::type;
};

}  // namespace detail

/// What the verbs of M see of the dynamics D.
template <typename M, typename D, typename Scalar = double>
using ModelOf = typename detail::ModelOf<typename detail::MethodFor<M, D>::type, Scalar, D>::type;
/// What M carries from sample to sample.
template <typename M, typename D, typename Scalar = double>
using BeliefOf = typename detail::MethodFor<M, D>::type::template Belief<Scalar, D>;
/// What M reports of a measurement by S.
template <typename M, typename D, typename S, typename Scalar = double>
using ReportOf = typename detail::ReportOf<typename detail::MethodFor<M, D>::type, Scalar, D, S>::type;

/// M can carry a belief of D through time. (What it asks of sensors shows where one is given.)
template <typename M, typename D, typename Scalar = double>
concept Method = requires { typename BeliefOf<M, D, Scalar>; } &&
                 (requires(const typename detail::MethodFor<M, D>::type& method, ModelOf<M, D, Scalar>& model,
                           const BeliefOf<M, D, Scalar>& prior, BeliefOf<M, D, Scalar>& next,
                           const StepContext<Scalar, DynamicsTraits<D>::controls>& at) {
                   { method.predict(model, prior, at, next) } -> std::same_as<Status>;
                 } || requires(const typename MethodOf<M>::type& method, BeliefOf<M, D, Scalar>& belief,
                               const StepContext<Scalar, DynamicsTraits<D>::controls>& at) {
                   requires MethodOf<M>::type::rolls_back;
                   { method.predict(belief, at) } -> std::same_as<Status>;
                 });

}  // namespace jml
#include <jml/warnings_end.hpp>
